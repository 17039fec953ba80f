#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/camera/camera.h"
#include "core/film/film.h"
#include "core/parallel.h"
#include "core/sampling/sequence.h"
#include "core/sampling/warp.h"
#include "core/scene/ray_scene.h"
#include "core/shading/illumination.h"

namespace fstop {

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
  float texture_width_px = 0.0F;     // pixels that a texture lookup averages over
  std::uint32_t mask = 0xffffffffU;  // of rays that leave the pupil: EmitterChoice::camera_mask
};

/// A packet of complete samples: where they were taken, what they saw and how far off.
struct TracedPacket {
  LaneColors colors = {};
  alignas(64) LaneValues raster_x = {};
  alignas(64) LaneValues raster_y = {};
  alignas(64) std::array<float, kLanes> depth = {};  // metres along the axis; infinity: nothing
};

/// Sees every sample of a pass; samples of one tile come from one thread at a time.
class SampleSink {
 public:
  virtual ~SampleSink() = default;
  virtual void add(const LaneMask& valid, const TracedPacket& packet) = 0;
};

/// Pixels in tiles of this side: what one thread traces at a time.
inline constexpr int kTile = 16;

/// Which samples a pass takes, of which pixels.
struct SamplePass {
  std::uint32_t first = 0;                   // a multiple of count
  std::uint32_t count = 1;                   // a power of two
  double begin = 0.0;                        // progress reported goes from here
  double end = 1.0;                          // to here
  const std::vector<char>* tiles = nullptr;  // row by row: nonzero where traced; null: everywhere
  SampleSink* sink = nullptr;
};

/// Traces a pass into `film`'s pass under way and returns the number of rays.
/// Throws: Error{cancelled} within a few milliseconds of a stop.
std::uint64_t trace_pass(const SampleSource& source, const SamplePass& pass, Film& film,
                         const RunControl& run);

/// One packet of complete samples, from keys to radiance: the unit the pass is made of.
/// Returns the number of rays.
std::uint64_t trace_packet(const SampleSource& source, const SampleKeys& keys,
                           const LaneMask& valid, TracedPacket& traced) noexcept;

}  // namespace fstop
