#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace fstop::server {

/// Linear regression that learns one observation after the other, from what is believed before the
/// first: weights normal about a mean. What lies long back fades away towards that belief.
/// Source: Bayesian linear regression with known noise (Bishop 2006, section 3.3).
template <std::size_t kSize>
class Regression {
 public:
  using Vector = std::array<double, kSize>;

  Regression(const Vector& mean, const Vector& deviation) {
    for (std::size_t i = 0; i < kSize; ++i) {
      prior_[i] = 1.0 / (deviation[i] * deviation[i]);
      prior_moment_[i] = prior_[i] * mean[i];
      precision_[i][i] = prior_[i];
    }
    moment_ = prior_moment_;
    weights_ = mean;
  }

  double predicted(const Vector& x) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < kSize; ++i) sum += weights_[i] * x[i];
    return sum;
  }

  void learn(const Vector& x, double y, double noise) {
    constexpr double kKept = 0.995;  // of each observation, with every further one
    const double precision = 1.0 / (noise * noise);
    for (std::size_t i = 0; i < kSize; ++i) {
      for (std::size_t j = 0; j < kSize; ++j)
        precision_[i][j] = kKept * precision_[i][j] + precision * x[i] * x[j];
      precision_[i][i] += (1.0 - kKept) * prior_[i];
      moment_[i] = kKept * moment_[i] + (1.0 - kKept) * prior_moment_[i] + precision * x[i] * y;
    }
    weights_ = solution();
    ++count_;
  }

  const Vector& weights() const noexcept { return weights_; }
  int count() const noexcept { return count_; }

 private:
  // Of precision * weights = moment, which is positive definite: elimination needs no pivots.
  Vector solution() const {
    auto a = precision_;
    Vector b = moment_;
    for (std::size_t i = 0; i < kSize; ++i) {
      for (std::size_t row = i + 1; row < kSize; ++row) {
        const double factor = a[row][i] / a[i][i];
        for (std::size_t column = i; column < kSize; ++column)
          a[row][column] -= factor * a[i][column];
        b[row] -= factor * b[i];
      }
    }
    for (std::size_t i = kSize; i-- > 0;) {
      for (std::size_t column = i + 1; column < kSize; ++column) b[i] -= a[i][column] * b[column];
      b[i] /= a[i][i];
    }
    return b;
  }

  std::array<Vector, kSize> precision_ = {};
  Vector moment_ = {};
  Vector prior_ = {};
  Vector prior_moment_ = {};
  Vector weights_ = {};
  int count_ = 0;
};

}  // namespace fstop::server
