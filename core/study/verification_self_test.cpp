#include "core/study/verification_self_test.h"

#include <algorithm>

namespace fstop {

bool PlantedTrial::is_caught() const {
  // A check that could not measure says nothing: only a wrong number counts.
  return red_results() > 0;
}

int PlantedTrial::red_results() const {
  int red = 0;
  for (const VerificationOutcome& outcome : outcomes) {
    red += static_cast<int>(std::ranges::count_if(outcome.results, [](const VerificationResult& r) {
      return r.is_decisive() && !r.holds();
    }));
  }
  return red;
}

int PlantedTrial::results() const {
  int all = 0;
  for (const VerificationOutcome& outcome : outcomes)
    all += static_cast<int>(outcome.results.size());
  return all;
}

std::vector<PlantedTrial> planted_trials(std::span<const VerificationCheck> checks, double share,
                                         const Photographer& photographer,
                                         const std::function<void(double)>& progress) {
  std::vector<PlantedTrial> trials;
  constexpr PlantedError kErrors[] = {PlantedError::focal_length, PlantedError::aperture,
                                      PlantedError::wavelength};
  int planned = 0;
  for (const PlantedError error : kErrors) {
    for (const VerificationCheck& check : checks) planned += can_show(check, error) ? 2 : 0;
  }
  int done = 0;
  for (const PlantedError error : kErrors) {
    for (const double factor : {1.0 + share, 1.0 - share}) {
      PlantedTrial trial{.error = error, .factor = factor};
      for (const VerificationCheck& check : checks) {
        if (!can_show(check, error)) continue;
        trial.outcomes.push_back(verified(check, [&](const ChartShot& shot) {
          return photographer(with_planted(shot, error, factor));
        }));
        trial.outcomes.back().picture = {};
        trial.outcomes.back().curves.clear();
        ++done;
        if (progress) progress(static_cast<double>(done) / planned);
      }
      if (!trial.outcomes.empty()) trials.push_back(std::move(trial));
    }
  }
  return trials;
}

}  // namespace fstop
