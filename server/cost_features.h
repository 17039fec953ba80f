#pragma once

#include <cstdint>
#include <string>

#include "api/render_request.h"

namespace fstop::server {

/// What the cost of a render depends on and a request tells. Logarithms, each about a usual
/// request, but for `kind`, `scene` and what is true or false.
struct CostFeatures {
  double pixels = 0.0;       // 0 at 4e4
  double error = 0.0;        // that is asked for, 0 at 0.01; 0 where samples are forced
  double samples = 0.0;      // of a pixel, where they are forced, 0 at 8
  double f_number = 0.0;     // working, 0 at 4
  double diffraction = 0.0;  // lambda N_w over the pixel pitch
  double blur = 0.0;         // disc of what is infinitely far, 0 at 20 px; 0 of a pinhole
  double transform = 0.0;    // elements of a pixel, that its waves take
  bool is_pinhole = false;
  bool is_forced = false;
  bool is_twice = false;    // a sharp picture beside the first: all_in_focus
  std::uint64_t kind = 0;   // requests of one kind choose among the same methods
  std::uint64_t scene = 0;  // by its content
};

/// By method, effects, illumination and outputs: the camera does not count.
std::uint64_t cost_kind(const SimulationSpec& spec);

CostFeatures cost_features(const SimulationSpec& spec, const std::string& scene_hash);

/// As if the samples that a render took in its time had been asked for.
CostFeatures with_forced_samples(CostFeatures features, double samples);

}  // namespace fstop::server
