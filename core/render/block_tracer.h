#pragma once

#include "core/camera/camera.h"
#include "core/film/block.h"
#include "core/sampling/sequence.h"
#include "core/sampling/warp.h"
#include "core/scene/ray_scene.h"
#include "core/shading/illumination.h"

namespace fstop {

static_assert(kBlockPixels == kLanes, "a packet holds one sample of every pixel of a block");

/// Everything a complete sample needs: scene, camera, and how its value is scaled.
struct SampleSource {
  const RayScene& scene;
  const Camera& camera;
  const Sensor& sensor;
  PupilWarp pupil;
  SampleSequence sequence;
  bool samples_pupil = true;         // false: every ray through the centre of projection
  bool falloff = false;              // multiply by the chief ray's cos^4
  float exposure = 1.0F;             // factor from radiance to pixel value
  float shutter_seconds = 0.0F;      // > 0: rays are spread over the time the shutter is open
  Vec3f velocity = {};               // of the camera, m/s, over that time
  float certain_light = 0.0F;        // ShadingInputs::certain_light
  float brightest = 1.0F;            // ShadingInputs::brightest
  float texture_width_px = 0.0F;     // pixels that a texture lookup averages over
  float texture_disc_share = 0.0F;   // or this much of a blur disc, if that is wider
  std::uint32_t mask = 0xffffffffU;  // of rays that leave the pupil: EmitterChoice::camera_mask
  Illumination illumination = Illumination::recursive;
  bool hides_background = false;  // where it is seen straight or through thin sheets alone
};

/// A packet of complete samples: where they were taken, what they saw and how far off.
struct alignas(64) TracedPacket {
  LaneColors colors = {};
  LaneFloats jitter_x = {};  // of the sample inside its pixel
  LaneFloats jitter_y = {};
  LaneFloats depth = {};  // metres along the axis; infinity: nothing
};

/// Takes the samples of one block of pixels. All pixels of a block share each sample's pupil point,
/// so that a packet's rays stay together and its origin is one; every pixel has its own points
/// inside the pixel, of light and of time.
class BlockTracer {
 public:
  BlockTracer(const SampleSource& source, const BlockGrid& grid, std::size_t block) noexcept;

  /// Blur diameter in pixels of a vergence of 1/metre beside the focus.
  double blur_px() const noexcept { return 2.0 * frame_.radius / frame_.slope; }

  /// Sum over all samples so far of the square of what branches that were not followed may add:
  /// where chance decides which are followed, of its mean over each pixel's samples.
  double cut_squares() const noexcept;

  /// Lanes whose pixel lies in the picture.
  const LaneMask& valid() const noexcept { return valid_; }

  /// Calls visit(packet) with each of the samples [first, first + count), one of every pixel.
  /// Returns the number of rays.
  template <typename Visit>
  std::uint64_t trace(std::uint32_t first, std::uint32_t count, const Visit& visit) {
    std::uint64_t rays = 0;
    TracedPacket traced;
    for (std::uint32_t i = first; i < first + count; ++i) {
      rays += trace_one(i, traced);
      visit(traced);
    }
    return rays;
  }
  /// The same into sums.
  std::uint64_t trace(std::uint32_t first, std::uint32_t count, BlockSums& sums) noexcept;

 private:
  // Smallest distance from the focus, 1/metre, of what the packet's valid lanes have met.
  float least_defocus(const TracedPacket& traced) const noexcept;
  // Whether a valid lane has met a mirror, something transparent, or a texture fixed to the
  // picture: what blur does not soften.
  bool meets_sharp() const noexcept;
  void note_cut() noexcept;
  std::uint64_t trace_one(std::uint32_t index, TracedPacket& traced) noexcept;
  std::uint64_t trace_any(std::uint32_t index, TracedPacket& traced) noexcept;
  std::uint64_t trace_wide(std::uint32_t index, TracedPacket& traced) noexcept;
  std::uint64_t sum_any(std::uint32_t first, std::uint32_t count, BlockSums& sums) noexcept;
  std::uint64_t sum_wide(std::uint32_t first, std::uint32_t count, BlockSums& sums) noexcept;
  void choose_pupil_points(std::uint32_t chunk) noexcept;

  const SampleSource& source_;
  AimFrame frame_;
  Vec3f right_;
  Vec3f down_;
  Vec3f forward_;
  float slope_;
  std::uint32_t block_;
  std::uint32_t lanes_ = 0;  // how many are valid
  alignas(64) LaneMask valid_ = {};
  ShadingInputs inputs_;
  alignas(64) LaneFloats corner_x_ = {};  // chief ray's slope at the pixels' upper left corners
  alignas(64) LaneFloats corner_y_ = {};
  alignas(64) LaneFloats pixel_left_ = {};  // raster, pixels
  alignas(64) LaneFloats pixel_top_ = {};
  FilmPlaces film_ = {};
  PencilWidths pencil_ = {};
  LaneSequence pixel_x_;
  LaneSequence pixel_y_;
  LaneSequence time_;
  RayPacket packet_ = {};
  std::uint32_t chunk_ = 0xffffffffU;  // of kLanes samples, whose pupil points are at hand
  alignas(64) LaneValues pupil_x_ = {};
  alignas(64) LaneValues pupil_y_ = {};
  bool is_cut_;  // paths branch, and some branches are not followed
  alignas(64) LaneFloats cut_ = {};
  double cut_squares_ = 0.0;
  // Of global illumination instead.
  alignas(64) LaneValues cut_sums_ = {};
  double traced_ = 0.0;  // samples of each pixel
};

}  // namespace fstop
