#pragma once

#include <algorithm>
#include <array>
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
    // So few units tell little of their own scatter: the 95 % quantile of F(n, n) instead, as of
    // the ratio of the error that was made to the one that is told, one degree of freedom each.
    constexpr std::array<double, 15> kQuantiles = {161.4, 19.0, 9.28, 6.39, 5.05, 4.28, 3.79, 3.44,
                                                   3.18,  2.98, 2.82, 2.69, 2.58, 2.48, 2.40};
    const double units = pixels / std::max(1.0, std::min(shared, pixels));
    if (units < 16.0) {
      return mean(pixels) * kQuantiles[static_cast<std::size_t>(std::max(1.0, units)) - 1];
    }
    // Twice: the error that was made scatters about its expectation as much as the estimate does.
    const double scatter = std::max(0.0, sum_of_squares / pixels - mean(pixels) * mean(pixels));
    return mean(pixels) +
           kOneSided95 * std::sqrt(2.0 * scatter * std::min(shared, pixels) / pixels);
  }
};

}  // namespace fstop
