#pragma once

#include <algorithm>
#include <cmath>

namespace fstop {

/// Mean of squared differences over pixels, and its one-sided 95 % bound.
struct SquareSums {
  double sum = 0.0;
  double sum_of_squares = 0.0;

  void add(double square) noexcept {
    sum += square;
    sum_of_squares += square * square;
  }
  void add(const SquareSums& other) noexcept {
    sum += other.sum;
    sum_of_squares += other.sum_of_squares;
  }
  double mean(double pixels) const noexcept { return sum / pixels; }
  /// `shared`: pixels that carry one and the same error, so that as many fewer tell of it.
  double upper_95(double pixels, double shared = 1.0) const noexcept {
    constexpr double kOneSided95 = 1.6448536269514722;  // quantile of the normal distribution
    const double scatter = std::max(0.0, sum_of_squares / pixels - mean(pixels) * mean(pixels));
    // Twice: the error that was made scatters about its expectation as much as the estimate does.
    return mean(pixels) +
           kOneSided95 * std::sqrt(2.0 * scatter * std::min(shared, pixels) / pixels);
  }
};

}  // namespace fstop
