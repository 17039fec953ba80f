#pragma once

#include <cmath>
#include <cstdint>

#include "core/scene/lane_colors.h"
#include "core/scene/ray_scene.h"
#include "core/shading/illumination_choice.h"

namespace fstop {

/// Where a packet's samples lie on the picture: u to the right, v up, 0 to 1 over the picture.
struct alignas(64) FilmPlaces {
  FilmPlaces() = default;
  /// A picture of `width` x `height` pixels, of which a lookup averages over `lookup_px`.
  FilmPlaces(int width, int height, float lookup_px) noexcept
      : per_width(1.0F / static_cast<float>(width)),
        per_height(1.0F / static_cast<float>(height)),
        lookup_width(lookup_px * std::sqrt(per_width * per_height)) {}

  /// The raster point of a lane, pixels.
  void set(std::size_t k, float raster_x, float raster_y) noexcept {
    u[k] = raster_x * per_width;
    v[k] = 1.0F - raster_y * per_height;
  }

  LaneFloats u = {};
  LaneFloats v = {};
  float per_width = 1.0F;  // 1/pixels
  float per_height = 1.0F;
  float lookup_width = 0.0F;  // in uv, of a square of the same area
};

/// How wide the pencil of rays of a packet's pixels is where they meet a surface, times a share:
/// width |1 - Z vergence| metres at the axial depth Z.
struct alignas(64) PencilWidths {
  LaneFloats cosines = {};  // of the rays to the axis
  float width = 0.0F;       // at the pupil, metres
  float vergence = 0.0F;    // of the focused plane, 1/metre
};

/// What the light at a packet's hits depends on beside the hits.
struct ShadingInputs {
  const RayScene& scene;
  SampleSequence sequence;  // chooses points of area lights
  SampleKeys keys = {};
  float footprint_rate = 0.0F;  // width that a texture lookup averages over, per metre of path
  const PencilWidths* pencil = nullptr;  // lookups are as wide as this at least; null: no share
  /// Light that adds less than this to every lane of a packet is traced as rarely as it is dim, and
  /// counted as much more: unbiased, and with fewer shadow rays. 0: all light is traced.
  float certain_light = 0.0F;
  /// Pixel value of the brightest surface that a branch may show, at least 1 (BranchBound).
  float brightest = 1.0F;
  /// Grows by what every branch that is not followed may add to the pixel, its weight times
  /// `brightest`, lane by lane; may be null.
  LaneFloats* cut = nullptr;
  /// Read where has_screen_maps(), by surfaces seen in mirrors too; null: the lower left corner.
  const FilmPlaces* film = nullptr;
  std::uint32_t without_background = 0;  // lanes, by bits, whose misses are black
  int depth = 0;  // bounces before this packet: another stream of light samples
  Illumination illumination = Illumination::recursive;
};

/// Local light of every valid lane: emission + ambient * ambient_light + the sum over lights of
/// f_radial f_angular intensity (diffuse (N.L) + specular (R.V)^n), with shadow rays; misses get
/// the background but for lanes `without_background`. Global illumination has no ambient term:
/// interreflection takes its place. `path_length` is added to each lane's own distance for texture
/// footprints. `surfaces` receives the surfaces that were hit; `rays` grows by the shadow rays.
/// `diffuse`, which may be null, receives the diffuse colour of lanes that answer to light, black
/// elsewhere.
void shade_locally(const ShadingInputs& in, const RayPacket& packet, const LaneMask& valid,
                   const LaneFloats& path_length, LaneSurfaces& surfaces, LaneColors& colors,
                   std::uint64_t& rays, LaneColors* diffuse = nullptr) noexcept;

/// Only the surfaces and their diffuse colours, as shade_locally tells them: no light, no shadow
/// rays. Texture lookups are as fine as the texture.
void diffuse_colors(const ShadingInputs& in, const RayPacket& packet, const LaneMask& valid,
                    LaneSurfaces& surfaces, LaneColors& diffuse) noexcept;

}  // namespace fstop
