#include "core/study/sweep_range.h"

#include <cmath>

#include "core/error.h"

namespace fstop {
namespace {

constexpr double kThirdsPerOctave = 6.0;  // f-numbers double over two stops
constexpr double kSlack = 1e-9;           // of a step
constexpr double kMostCounted = 1e300;

double thirds_of(double f_number) { return std::round(kThirdsPerOctave * std::log2(f_number)); }

bool is_positive(double x) { return x > 0.0 && std::isfinite(x); }

// Steps between the ends, as a real number.
double steps_between(const SweepRange& range) {
  switch (range.spacing) {
    case Spacing::linear:
      return (range.to - range.from) / *range.step;
    case Spacing::log:
      return std::log(range.to / range.from) / std::log(*range.step);
    case Spacing::third_stop:
      return std::abs(thirds_of(range.to) - thirds_of(range.from)) / range.step.value_or(1.0);
    case Spacing::reciprocal:
      break;
  }
  return 0.0;
}

std::string objection_to_step(const SweepRange& range) {
  const double step = range.step.value_or(1.0);
  if (range.spacing == Spacing::reciprocal) return "needs count: step has no unit there";
  if (range.spacing == Spacing::third_stop) {
    const bool is_whole = step >= 1.0 && step == std::floor(step) && std::isfinite(step);
    return is_whole ? "" : "needs a step of 1 or more whole thirds of a stop";
  }
  if (!std::isfinite(step)) return "needs a finite step";
  const bool moves = range.spacing == Spacing::log ? step > 0.0 && step != 1.0 : step != 0.0;
  if (!moves) {
    return range.spacing == Spacing::log ? "needs a step, a ratio, above 0 and other than 1"
                                         : "needs a step other than 0";
  }
  return steps_between(range) < 0.0 ? "needs a step that leads from `from` to `to`" : "";
}

double value_at(const SweepRange& range, int i) {
  const double last = range.count.value_or(1) - 1;
  const double share = range.count && last > 0.0 ? i / last : 0.0;
  if (range.count && i > 0 && share == 1.0) return range.to;
  switch (range.spacing) {
    case Spacing::linear:
      // Divided last: whole numbers stay whole.
      if (range.count)
        return last > 0.0 ? range.from + i * (range.to - range.from) / last : range.from;
      return range.from + i * *range.step;
    case Spacing::log:
      return range.from *
             (range.count ? std::pow(range.to / range.from, share) : std::pow(*range.step, i));
    case Spacing::reciprocal: {
      const double begin = 1.0 / range.from;
      return i == 0 ? range.from : 1.0 / (begin + share * (1.0 / range.to - begin));
    }
    case Spacing::third_stop: {
      const double first = thirds_of(range.from);
      const double direction = thirds_of(range.to) < first ? -1.0 : 1.0;
      return std::exp2((first + direction * i * range.step.value_or(1.0)) / kThirdsPerOctave);
    }
  }
  return range.from;
}

}  // namespace

std::string objection(const SweepRange& range) {
  const bool is_reciprocal = range.spacing == Spacing::reciprocal;
  if (range.spacing == Spacing::linear) {
    if (!std::isfinite(range.from) || !std::isfinite(range.to)) return "needs finite ends";
  } else if (is_reciprocal) {
    if (!(range.from > 0.0 && range.to > 0.0)) return "needs ends above 0";
  } else if (!is_positive(range.from) || !is_positive(range.to)) {
    return "needs finite ends above 0";
  }
  if (range.spacing == Spacing::third_stop) {
    return range.count ? "has no count: its steps are thirds of a stop" : objection_to_step(range);
  }
  if (range.count.has_value() == range.step.has_value()) return "needs either count or step";
  if (range.count) return *range.count >= 1 ? "" : "needs a count of 1 or more";
  return objection_to_step(range);
}

double value_count(const SweepRange& range) {
  if (range.count) return *range.count;
  const double steps = std::floor(steps_between(range) + kSlack);
  return std::isfinite(steps) ? steps + 1.0 : kMostCounted;
}

std::vector<double> values_of(const SweepRange& range) {
  if (const std::string why = objection(range); !why.empty())
    throw Error(ErrorCode::outside_domain, "a range " + why);
  const auto count = static_cast<int>(value_count(range));
  std::vector<double> values;
  values.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) values.push_back(value_at(range, i));
  return values;
}

}  // namespace fstop
