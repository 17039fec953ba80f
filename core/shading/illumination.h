#pragma once

#include <cstdint>

#include "core/scene/lane_colors.h"
#include "core/scene/ray_scene.h"
#include "core/shading/illumination_choice.h"

namespace fstop {

/// What the light at a packet's hits depends on beside the hits.
struct ShadingInputs {
  const RayScene& scene;
  SampleSequence sequence;  // chooses points of area lights
  SampleKeys keys = {};
  float footprint_rate = 0.0F;  // width that a texture lookup averages over, per metre of path
  /// Light that adds less than this to every lane of a packet is traced as rarely as it is dim, and
  /// counted as much more: unbiased, and with fewer shadow rays. 0: all light is traced.
  float certain_light = 0.0F;
  /// Grows by the weight of every branch that is not followed, lane by lane; may be null.
  LaneFloats* cut = nullptr;
  int depth = 0;  // bounces before this packet: another stream of light samples
  Illumination illumination = Illumination::recursive;
};

/// Local light of every valid lane: emission + ambient * ambient_light + the sum over lights of
/// f_radial f_angular intensity (diffuse (N.L) + specular (R.V)^n), with shadow rays; misses get
/// the background. Global illumination has no ambient term: interreflection takes its place.
/// `path_length` is added to each lane's own distance for texture footprints.
/// `surfaces` receives the surfaces that were hit; `rays` grows by the shadow rays. `diffuse`,
/// which may be null, receives the diffuse colour of lanes that answer to light, black elsewhere.
void shade_locally(const ShadingInputs& in, const RayPacket& packet, const LaneMask& valid,
                   const LaneFloats& path_length, LaneSurfaces& surfaces, LaneColors& colors,
                   std::uint64_t& rays, LaneColors* diffuse = nullptr) noexcept;

}  // namespace fstop
