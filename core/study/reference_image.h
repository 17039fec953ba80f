#pragma once

#include <vector>

#include "core/film/image.h"

namespace fstop {

/// The mean of independent pictures of one thing, and how noisy that mean is.
class ReferenceImage {
 public:
  /// `picture`: another replicate, of the same size as those before it.
  void add(const Image& picture);

  int replicates() const noexcept { return replicates_; }
  /// Of what was added so far.
  Image mean() const;
  /// Mean over pixels and channels of the variance of that mean, values clipped to [0,1]:
  ///
  ///     s^2/n,   s^2 = sum over replicates of (x - m)^2/(n - 1).
  ///
  /// Each replicate is clipped, where the mean is clipped once: at the ends of [0,1] the variance
  /// errs downwards. Needs 2 replicates or more, as all below.
  double clipped_variance() const;
  /// Mean of s^2/n / (m^2 + 0.01): what it adds to a relMSE against this mean.
  double relative_variance() const;
  /// Standard error of the sum over all values, over that sum; 0 for a black picture.
  double energy_error() const;

 private:
  // Running mean and sum of squared differences (Welford 1962): no digits are lost.
  struct Moments {
    double mean = 0.0;
    double squares = 0.0;
    void add(double value, int count) noexcept;
  };
  double variance_of_mean(const Moments& moments) const noexcept;

  int replicates_ = 0;
  int width_ = 0;
  int height_ = 0;
  std::vector<Moments> values_ = {};
  std::vector<Moments> clipped_ = {};
  Moments energy_ = {};
};

}  // namespace fstop
