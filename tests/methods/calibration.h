#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "core/render/simulation.h"
#include "tests/methods/truth.h"

namespace fstop {

/// One method's picture of a shot: what it promised, what is true and what it took.
struct MethodTrial {
  std::string method = {};
  std::string passed_over = {};  // why it was not rendered; empty if it was
  ImageError told = {};
  TrueError truth = {};
  std::uint64_t rays = 0;
  double cpu_seconds = 0.0;
  bool finite = true;

  bool holds() const { return truth.rmse <= told.upper_95 + 2.0 * truth.scatter; }
  bool meets_target() const { return truth.rmse <= told.target; }
};

struct CalibrationCase {
  std::uint32_t seed = 0;
  std::string what = {};
  double target = 0.0;
  double reference_noise = 0.0;
  int reference_samples = 0;
  MethodTrial chosen = {};                // method `auto`
  std::vector<MethodTrial> methods = {};  // every method by name, where asked for

  /// The references are sharp enough to tell: a third of the target at most.
  bool resolved() const { return reference_noise <= target / 3.0; }
};

struct CalibrationOptions {
  bool all_methods = false;
  double noise_share = 0.1;  // of the target: what the references' mean may scatter
  int most_samples = 8192;   // a pixel in each of the two references
};

/// The random shot of `seed`, with diffraction off where leaving it out would be told as more than
/// a tenth of the target, rendered by `auto` (and by every method) and held against its truth.
CalibrationCase calibrated(std::uint32_t seed, const CalibrationOptions& options);

/// Cases `first` to `first + count - 1`, `threads` of them at a time, each on one thread; `done` is
/// told of each as it ends, one at a time.
std::vector<CalibrationCase> calibrated(
    std::uint32_t first, int count, int threads, const CalibrationOptions& options,
    const std::function<void(const CalibrationCase&)>& done = {});

/// What many cases say together; shares of the cases that references resolve.
struct CalibrationSummary {
  int cases = 0;
  int unresolved = 0;
  double held = 0.0;          // true error <= upper_95
  double over_target = 0.0;   // true error > target
  double median_ratio = 0.0;  // estimate / true error
  double mean_used = 0.0;     // true error / target
};
CalibrationSummary summary_of(const std::vector<CalibrationCase>& cases);

/// How the planner's choices cost beside the cheapest method that truly meets the target.
struct ChoiceSummary {
  int cases = 0;              // where some method meets the target
  int missed = 0;             // where none does
  double good_by_rays = 0.0;  // share that costs at most 1.3 times the cheapest
  double good_by_time = 0.0;
  double worst_by_time = 0.0;
};
ChoiceSummary choices_of(const std::vector<CalibrationCase>& cases);

/// Tables by method and by target, and the worst cases.
void print_calibration(std::ostream& out, const std::vector<CalibrationCase>& cases);
void print_choices(std::ostream& out, const std::vector<CalibrationCase>& cases);
/// One line a trial, after a line of names.
void write_csv_names(std::ostream& out);
void write_csv(std::ostream& out, const CalibrationCase& one);

}  // namespace fstop
