#include "core/study/log_axis.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace fstop {

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

LogAxis::LogAxis(const std::vector<double>& values, double begin, double end)
    : begin_(begin), end_(end) {
  std::vector<double> shown;
  std::ranges::copy_if(values, std::back_inserter(shown),
                       [](double v) { return v > 0.0 && std::isfinite(v); });
  if (shown.empty()) return;
  constexpr double kRoom = 1.35;
  lowest_ = *std::ranges::min_element(shown) / kRoom;
  highest_ = *std::ranges::max_element(shown) * kRoom;
  const double missing = 10.0 / (highest_ / lowest_);
  if (missing <= 1.0) return;
  lowest_ /= std::sqrt(missing);
  highest_ *= std::sqrt(missing);
}

double LogAxis::position(double value) const noexcept {
  const double inside = std::clamp(value, lowest_, highest_);
  const double share = std::log(inside / lowest_) / std::log(highest_ / lowest_);
  return begin_ + (end_ - begin_) * share;
}

std::vector<AxisTick> LogAxis::ticks() const {
  const double decades = std::log10(highest_ / lowest_);
  const bool names_between = decades < 3.0;
  std::vector<AxisTick> ticks;
  const int first = static_cast<int>(std::floor(std::log10(lowest_)));
  const int last = static_cast<int>(std::floor(std::log10(highest_)));
  for (int power = first; power <= last; ++power) {
    for (int digit = 1; digit <= 9; ++digit) {
      const double value = digit * std::pow(10.0, power);
      if (value < lowest_ || value > highest_) continue;
      const bool is_named = digit == 1 || (names_between && (digit == 2 || digit == 5));
      ticks.push_back({value, is_named ? short_number(value) : std::string()});
    }
  }
  return ticks;
}

}  // namespace fstop
