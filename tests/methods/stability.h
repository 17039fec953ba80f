#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "tests/methods/regimes.h"

namespace fstop {

enum class Verdict {
  held,        // bound held, target met as far as is told
  over,        // bound held, but it is above the target, as the report says
  refused,     // refused with a reason
  broken,      // true error above the bound
  not_finite,  // a pixel, an error or a bound that is no finite number
  failed       // something else than a refusal
};

/// One method in one regime.
struct StabilityCell {
  std::string regime = {};
  std::string method = {};  // as asked for
  Verdict verdict = Verdict::failed;
  std::string taken = {};  // the method that was taken
  double target = 0.0;
  double bound = 0.0;       // upper_95
  double true_error = 0.0;  // negative: no reference could be afforded
  double scatter = 0.0;     // of the true error, from the references
  std::string note = {};    // refusal or failure in words
};

/// A regime by every method and by `auto`, on `threads` threads (0: all there are).
///
/// Methods of rays are held against lens sampling of other seeds with diffraction off. `wave` has
/// diffraction: it is held against the same rays where leaving diffraction out changes less than a
/// third of its own bound, else against itself, point spreads five times as exact.
///
/// A cell is broken where the true error, less twice its scatter, is over 1.25 bounds: a bound of
/// 95 % may be passed by a little in one picture of twenty.
std::vector<StabilityCell> stability_cells(const Regime& regime, int most_samples, int threads);

std::string_view verdict_name(Verdict verdict);
void print_stability(std::ostream& out, const std::vector<StabilityCell>& cells);
void write_stability_csv(std::ostream& out, const std::vector<StabilityCell>& cells);
/// A map of regimes by methods, one SVG document.
void write_stability_svg(std::ostream& out, const std::vector<StabilityCell>& cells);

}  // namespace fstop
