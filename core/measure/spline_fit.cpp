#include "core/measure/spline_fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"

namespace fstop {
namespace {

constexpr double kRelativePenalty = 1e-6;

// The four B-splines over one interval at t in [0, 1], and their slopes in t.
std::array<double, 4> basis(double t) noexcept {
  const double s = 1.0 - t;
  return {s * s * s / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
          (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0, t * t * t / 6.0};
}

std::array<double, 4> basis_slopes(double t) noexcept {
  const double s = 1.0 - t;
  return {-s * s / 2.0, (-4.0 * t + 3.0 * t * t) / 2.0, (4.0 * s - 3.0 * s * s) / 2.0, t * t / 2.0};
}

struct Interval {
  std::size_t index = 0;
  double t = 0.0;
};

Interval interval_of(double x, double first, double spacing, std::size_t coefficients) noexcept {
  const double place = (x - first) / spacing;
  const double last = static_cast<double>(coefficients - 4);
  const double index = std::clamp(std::floor(place), 0.0, last);
  return {static_cast<std::size_t>(index), place - index};
}

std::size_t coefficient_count(double first, double last, double spacing) {
  return static_cast<std::size_t>(std::ceil((last - first) / spacing - 1e-9)) + 3;
}

}  // namespace

CubicSpline::CubicSpline(double first, double spacing, std::vector<double> coefficients)
    : first_(first), spacing_(spacing), coefficients_(std::move(coefficients)) {
  if (!(spacing > 0.0) || coefficients_.size() < 4) {
    throw Error(ErrorCode::outside_domain, "a cubic spline needs spacing > 0 and 4 coefficients");
  }
}

double CubicSpline::value(double x) const noexcept {
  const Interval at = interval_of(x, first_, spacing_, coefficients_.size());
  const auto weights = basis(at.t);
  double sum = 0.0;
  for (std::size_t k = 0; k < 4; ++k) sum += weights[k] * coefficients_[at.index + k];
  return sum;
}

double CubicSpline::slope(double x) const noexcept {
  const Interval at = interval_of(x, first_, spacing_, coefficients_.size());
  const auto weights = basis_slopes(at.t);
  double sum = 0.0;
  for (std::size_t k = 0; k < 4; ++k) sum += weights[k] * coefficients_[at.index + k];
  return sum / spacing_;
}

SplineFit::SplineFit(double first, double last, double spacing, std::vector<double> places)
    : first_(first), last_(last), spacing_(spacing), places_(std::move(places)) {
  const bool inside = std::ranges::any_of(places_, [this](double x) { return covers(x); });
  if (!(first < last && spacing > 0.0) || !inside) {
    throw Error(ErrorCode::outside_domain, "a spline fit needs first < last and a point between");
  }
  band_.resize(coefficient_count(first, last, spacing));
  for (const double x : places_) {
    if (!covers(x)) continue;
    const Interval at = interval_of(x, first_, spacing_, band_.size());
    const auto weights = basis(at.t);
    for (std::size_t k = 0; k < kBand; ++k) {
      for (std::size_t j = 0; j <= k; ++j) {
        band_[at.index + k][kBand - 1 - (k - j)] += weights[k] * weights[j];
      }
    }
  }
  factorise();
}

// band_[i][kBand - 1 - m] is the element (i, i - m).
void SplineFit::factorise() {
  double trace = 0.0;
  for (const auto& row : band_) trace += row[kBand - 1];
  const double penalty = kRelativePenalty * trace / static_cast<double>(band_.size());
  constexpr std::array<double, 3> kSecondDifference = {1.0, -2.0, 1.0};
  for (std::size_t i = 0; i + 2 < band_.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t j = 0; j <= k; ++j) {
        band_[i + k][kBand - 1 - (k - j)] += penalty * kSecondDifference[k] * kSecondDifference[j];
      }
    }
  }
  for (auto& row : band_) row[kBand - 1] += 1e-6 * penalty;  // where all points lie on one line
  for (std::size_t i = 0; i < band_.size(); ++i) {
    const std::size_t reach = std::min(i, kBand - 1);
    for (std::size_t m = reach + 1; m-- > 0;) {  // columns i - reach to i
      const std::size_t j = i - m;
      double sum = band_[i][kBand - 1 - m];
      for (std::size_t l = i - reach; l < j; ++l) {
        if (j - l < kBand) sum -= band_[i][kBand - 1 - (i - l)] * band_[j][kBand - 1 - (j - l)];
      }
      band_[i][kBand - 1 - m] = m == 0 ? std::sqrt(sum) : sum / band_[j][kBand - 1];
    }
  }
}

CubicSpline SplineFit::fitted(const std::vector<double>& values) const {
  const std::size_t count = band_.size();
  std::vector<double> x(count, 0.0);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (!covers(places_[i])) continue;
    const Interval at = interval_of(places_[i], first_, spacing_, count);
    const auto weights = basis(at.t);
    for (std::size_t k = 0; k < kBand; ++k) x[at.index + k] += weights[k] * values[i];
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t m = 1; m <= std::min(i, kBand - 1); ++m) {
      x[i] -= band_[i][kBand - 1 - m] * x[i - m];
    }
    x[i] /= band_[i][kBand - 1];
  }
  for (std::size_t i = count; i-- > 0;) {
    for (std::size_t m = 1; m < kBand && i + m < count; ++m) {
      x[i] -= band_[i + m][kBand - 1 - m] * x[i + m];
    }
    x[i] /= band_[i][kBand - 1];
  }
  return {first_, spacing_, std::move(x)};
}

}  // namespace fstop
