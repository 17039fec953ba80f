#pragma once

#include <span>
#include <vector>

#include "core/study/verification.h"

namespace fstop {

/// One planted error and what the checks that can show it said.
struct PlantedTrial {
  PlantedError error = PlantedError::focal_length;
  double factor = 1.0;
  std::vector<VerificationOutcome> outcomes = {};  // without pictures

  bool is_caught() const;  // one result at least is red
  /// The results that are red, over all there are.
  int red_results() const;
  int results() const;
};

/// The suite's checks against shots whose camera is wrong by `share`, both ways, in focal length,
/// aperture and wavelength: six trials. Checks that cannot show an error are left out, and trials
/// without any check.
/// `progress`: told after each check, 0 to 1. Throws: as verified().
std::vector<PlantedTrial> planted_trials(std::span<const VerificationCheck> checks, double share,
                                         const Photographer& photographer,
                                         const std::function<void(double)>& progress);

}  // namespace fstop
