#pragma once

#include <cstdint>

#include "core/scene/ray_scene.h"

namespace fstop {

/// Radiance of every lane, linear Rec. 709.
struct LaneColors {
  alignas(64) std::array<float, kLanes> r = {};
  alignas(64) std::array<float, kLanes> g = {};
  alignas(64) std::array<float, kLanes> b = {};

  void set(int lane, const Rgb& color) noexcept {
    const auto k = static_cast<std::size_t>(lane);
    r[k] = color[0];
    g[k] = color[1];
    b[k] = color[2];
  }
  Rgb get(int lane) const noexcept {
    const auto k = static_cast<std::size_t>(lane);
    return {r[k], g[k], b[k]};
  }
};

/// What the light at a packet's hits depends on beside the hits.
struct ShadingInputs {
  const RayScene& scene;
  SampleSequence sequence;  // chooses points of area lights
  SampleKeys keys = {};
  float footprint_rate = 0.0F;  // width that a texture lookup averages over, per metre of path
  int depth = 0;                // bounces before this packet: another stream of light samples
};

/// Local light of every valid lane: emission + ambient * ambient_light + the sum over lights of
/// f_radial f_angular intensity (diffuse (N.L) + specular (R.V)^n), with shadow rays; misses get
/// the background. `path_length` is added to each lane's own distance for texture footprints.
/// `surfaces` receives the surface of every lane that hit; `rays` grows by the shadow rays.
void shade_locally(const ShadingInputs& in, const RayPacket& packet, const LaneMask& valid,
                   float path_length, std::array<Surface, kLanes>& surfaces, LaneColors& colors,
                   std::uint64_t& rays) noexcept;

}  // namespace fstop
