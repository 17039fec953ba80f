#pragma once

#include <string>
#include <vector>

namespace fstop {

/// A value where an axis is marked, with what stands there; lines between have no label.
struct AxisTick {
  double value = 0.0;
  std::string label = {};
};

/// An axis on which equal ratios are equal lengths.
class LogAxis {
 public:
  /// Spans all positive `values` with some room, at least a factor of ten, and goes from `begin` to
  /// `end` in pixels. Without positive values it spans 0.1 to 1.
  LogAxis(const std::vector<double>& values, double begin, double end);

  double lowest() const noexcept { return lowest_; }
  double highest() const noexcept { return highest_; }
  /// Pixels. Values at or below zero, and those beyond the ends, lie on the nearest end.
  double position(double value) const noexcept;
  /// Powers of ten, and where they are few also 2 and 5 of each, or all of 1 to 9 in the grid.
  std::vector<AxisTick> ticks() const;

 private:
  double lowest_ = 0.1;
  double highest_ = 1.0;
  double begin_;
  double end_;
};

/// The shortest decimal of four digits or fewer: "0.003", "20", "1e-05" below 0.0001.
std::string short_number(double value);

}  // namespace fstop
