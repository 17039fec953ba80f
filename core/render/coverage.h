#pragma once

#include <string_view>

#include "core/render/simulation.h"

namespace fstop {

/// How much of each pixel's light path the scene covers, and how wrong that may be.
struct Coverage {
  Image alpha = {};  // 1 channel, 0 to 1
  ImageError error = {};
  std::uint64_t rays = 0;
  bool missed_target = false;  // the bound stayed above max_error
};

/// The scene as a stencil: every surface sends 1, nothing else does. What it photographs as is its
/// coverage: of a thin sheet 1 - transmission, of what refracts all.
Scene matte_of(const Scene& scene);

/// The share of pixel, pupil and shutter time that `scene` covers, whatever its light, exposure and
/// falloff: a photograph of matte_of(scene) by the same camera from the same seed. `method`: how
/// the colours were rendered; where `spec` forces samples or a method, the stencil takes the same
/// kind of path, and lens-sampling's own samples in both.
/// Throws: as simulate().
Coverage coverage(const SimulationSpec& spec, const RayScene& scene, std::string_view method,
                  const RunControl& run);

}  // namespace fstop
