#pragma once

#include <cstdint>

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
  bool samples_pupil = true;      // false: every ray through the centre of projection
  bool falloff = false;           // multiply by the chief ray's cos^4
  float exposure = 1.0F;          // factor from radiance to pixel value
  float shutter_seconds = 0.0F;   // > 0: rays are spread over the time the shutter is open
  float texture_width_px = 0.0F;  // pixels that a texture lookup averages over
};

/// Traces samples [first, first + count) of every pixel into `film`'s pass under way.
/// `count` is a power of two and `first` a multiple of it. Progress goes from `begin` to `end`.
/// Returns the number of rays. Throws: Error{cancelled} within a few milliseconds of a stop.
std::uint64_t trace_pass(const SampleSource& source, std::uint32_t first, std::uint32_t count,
                         Film& film, const RunControl& run, double begin, double end);

/// One packet of complete samples, from keys to radiance: the unit the pass is made of.
/// Returns the number of rays.
std::uint64_t trace_packet(const SampleSource& source, const SampleKeys& keys,
                           const LaneMask& valid, LaneColors& colors) noexcept;

}  // namespace fstop
