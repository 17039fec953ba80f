#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/camera/film_projection.h"
#include "core/film/image.h"
#include "core/parallel.h"
#include "core/render/block_tracer.h"
#include "core/render/emitter_choice.h"
#include "core/sampling/warp.h"

namespace fstop {

/// What splats are made from: a scene, a camera, its emitters, and how light becomes pixel values.
struct SplatSource {
  const RayScene& scene;
  const Camera& camera;
  const EmitterChoice& choice;
  PupilWarp pupil;
  std::uint32_t seed = 0;
  bool falloff = false;           // multiply by the chief ray's cos^4
  float exposure = 1.0F;          // factor from radiance to pixel value
  float shutter_seconds = 0.0F;   // > 0: rays are spread over the time the shutter is open
  float texture_width_px = 0.0F;  // pixels that a texture lookup averages over
  Illumination illumination = Illumination::recursive;
  bool hides_background = false;  // as SampleSource
};

/// What is splatted beside the camera rays of `rays`, whose `mask` is the choice's camera_mask.
SplatSource splat_source(const SampleSource& rays, const EmitterChoice& choice, std::uint32_t seed);

/// A range of an emitter's points: indices first to first + count of its sequence.
struct SplatRange {
  std::uint32_t emitter = 0;  // in EmitterChoice::emitters
  std::uint32_t first = 0;    // a multiple of count
  std::uint32_t count = 0;    // a power of two
  double weight = 1.0;        // the light is added this many times
};

/// Where a range's light went.
struct SplatTotals {
  std::array<double, 3> light = {};  // sum over pixels of what was added, without `weight`
  double seen_px = 0.0;     // size of the sharp image, pixels, that the pupil would see if nothing
                            // lay before it and the film had no borders, on average over the pupil
  double reached_px = 0.0;  // the part of it that reached the film

  double reached_share() const noexcept { return seen_px > 0.0 ? reached_px / seen_px : 0.0; }
};

/// Where light falls: pixel values, 3 channels, in double precision since discs of many points add
/// up small numbers.
class SplatImage {
 public:
  SplatImage(int width, int height)
      : width_(width),
        height_(height),
        values_(std::size_t{3} * static_cast<std::size_t>(width) *
                static_cast<std::size_t>(height)) {}

  int width() const noexcept { return width_; }
  int height() const noexcept { return height_; }
  double* at(std::size_t pixel) noexcept { return values_.data() + 3 * pixel; }
  const double* at(std::size_t pixel) const noexcept { return values_.data() + 3 * pixel; }
  std::vector<double>& values() noexcept { return values_; }
  const std::vector<double>& values() const noexcept { return values_; }

 private:
  int width_;
  int height_;
  std::vector<double> values_;  // row by row, channels interleaved
};

/// In single precision.
Image image_of(const SplatImage& light);

/// Sends light of the chosen emitters through the pupil onto the film. For a point P of an emitter
/// and a point L of the pupil, with nothing that is not splatted between them, the pixel where
/// L's ray to P falls receives
///
///     (L_e - L_without) dq/dA / p        for each of M points: / M
///
/// L_e is the radiance that leaves P towards L, L_without that along the same ray where the
/// splatted groups are masked out, as camera rays see it: both are shaded alike, so that splats and
/// masked camera rays add up to the picture. What lies before P behind a mirror, glass or a thin
/// sheet is left to camera rays, which see emitters after their first hit. The pixel filter is the
/// box: P falls into one pixel.
///
/// Every range adds its estimate of its emitter's whole light, times `weight`, to `light`;
/// `totals`, if not empty, has one element a range. `replicate`s are scrambled independently; the
/// points are keyed by (seed, replicate, the emitter's number in the scene, index). Bytes do not
/// depend on the number of threads. Returns the number of rays.
/// Throws: Error{cancelled} within milliseconds of a stop; `light` is then left part done.
std::uint64_t splat(const SplatSource& source, std::uint32_t replicate,
                    std::span<const SplatRange> ranges, SplatImage& light,
                    std::span<SplatTotals> totals, const RunControl& run);

/// Light of a point that is not laid on the film yet: where it falls, from how far off it comes,
/// and the light that it hides there, which comes from farther off.
struct SharpSplat {
  float raster_x = 0.0F;
  float raster_y = 0.0F;
  float depth = 0.0F;         // metres along the axis
  float depth_behind = 0.0F;  // infinity: the background
  Rgb light = {};             // pixel values, as `splat` adds them, without the hidden light
  Rgb hidden = {};            // to be taken away
};

/// Sees splats in the order of their ranges and indices, from one thread at a time.
class SharpSplatSink {
 public:
  virtual ~SharpSplatSink() = default;
  virtual void add(const SharpSplat& splat) = 0;
};

/// The same as `splat`, handed on splat by splat instead of being added up.
std::uint64_t splat_sharp(const SplatSource& source, std::uint32_t replicate,
                          std::span<const SplatRange> ranges, SharpSplatSink& sink,
                          const RunControl& run);

}  // namespace fstop
