#pragma once

#include <span>

#include "server/cost_features.h"

namespace fstop::server {

/// A render and what it took.
struct CostObservation {
  CostFeatures asked = {};
  bool is_wave = false;
  double log_samples = 0.0;      // of a pixel
  double log_nanoseconds = 0.0;  // of processor time a pixel
};

/// Renders of the bundled scenes, measured on one kind of processor (server/measured_costs.inc).
std::span<const CostObservation> measured_costs();

}  // namespace fstop::server
