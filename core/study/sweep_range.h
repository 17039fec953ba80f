#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace fstop {

/// How the values of a range follow each other.
enum class Spacing {
  linear,      ///< equal differences
  log,         ///< equal ratios
  reciprocal,  ///< equal differences of 1/x: of distances, equal steps in dioptres
  third_stop,  ///< f-numbers 2^(n/6): each step changes the light by 2^(1/3)
};

/// Values from one end to the other, rising or falling.
struct SweepRange {
  double from = 0.0;
  double to = 0.0;                  // reciprocal: either end may be infinite
  std::optional<int> count = {};    // values with both ends; else `step` says how many
  std::optional<double> step = {};  // linear: difference; log: ratio; third_stop: thirds of a stop
  Spacing spacing = Spacing::linear;
};

/// Why `range` has no values; empty where it has: neither or both of count and step, a step that
/// leads away from `to`, an end outside the spacing's domain (log and third_stop: positive;
/// reciprocal: positive or infinite, count only; third_stop: step only, whole).
std::string objection(const SweepRange& range);

/// How many values `range` has; 1e300 stands for more than fit a size. Valid: no objection.
double value_count(const SweepRange& range);

/// The values in order:
///
///     linear      from + i step, or from + i (to - from)/(count - 1)
///     log         from step^i, or from (to/from)^(i/(count - 1))
///     reciprocal  1/(1/from + i (1/to - 1/from)/(count - 1))
///     third_stop  2^(n/6) for whole n, from the one nearest to `from` to the one nearest to `to`:
///                 nominal f-numbers (1.8, 5.6, 13) mean the true ones (1.782, 5.657, 12.699)
///
/// By count both ends are met exactly; by step the last value is the last that does not pass `to`
/// by more than a billionth of a step. One value: `from`.
/// Throws: Error{outside_domain} with the objection.
std::vector<double> values_of(const SweepRange& range);

}  // namespace fstop
