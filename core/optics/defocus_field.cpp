#include "core/optics/defocus_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "core/error.h"
#include "core/optics/bessel.h"

namespace fstop {
namespace {

// Room for the weights of |U| = kLargestDefocus: 2500 + 11.5 * 2500^(1/3) + 6 = 2662, and the pair.
constexpr std::size_t kMostWeights = 2680;
// Below this J_0(vt) is 1 to the last bit.
constexpr double kOnAxis = 1e-8;
// Beyond this |G| is below 1e-150.
constexpr double kBeyond = 1e100;
constexpr std::size_t kLanes = 8;
// Small enough to grow by 1e250 on the way down, large enough to be a normal number.
constexpr double kLaneSeed = 1e-290;

void require_defocus(double defocus) {
  if (!(std::abs(defocus) <= kLargestDefocus)) {
    throw Error(ErrorCode::outside_domain,
                "the defocus |U| must be at most 10000 rad (1591 Fresnel zones or 796 waves)");
  }
}

// The plain product: std::complex's own checks for infinities on the way.
std::complex<double> product(std::complex<double> a, std::complex<double> b) noexcept {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

// (exp(iU/2) - 1) / (iU).
std::complex<double> axis_field(double defocus) noexcept {
  const double quarter = 0.25 * defocus;
  const double sinc = std::abs(quarter) < kOnAxis ? 1.0 : std::sin(quarter) / quarter;
  return 0.5 * sinc * std::complex<double>(std::cos(quarter), std::sin(quarter));
}

// Fills (2n + 1) j_n(U/4) with the signs of (-i)^n, even n real, odd n imaginary: 1, -i, -1, i.
// Returns how many; the count is even.
int fill_weights(double defocus, std::span<double> weights) noexcept {
  const double x = 0.25 * std::abs(defocus);
  if (x < 1e-12) {
    weights[0] = 1.0;
    weights[1] = 0.0;  // j_1 = x/3 is of no account
    return 2;
  }
  const int count = (bessel_negligible_order(x) + 1) & ~1;
  // Even and odd orders come down side by side, which halves the wait for each other's result:
  // j_(n-2) = (4 o (o - 1)/x^2 - 2 o/(o + 1)) j_n - (o - 1)/(o + 1) j_(n+2) with o = n + 1/2.
  const double inverse = 1.0 / x;
  const double q = 4.0 * inverse * inverse;
  double odd = 1e-30;                             // j_(count-1); j_count = 0 and so
  double odd_above = -odd;                        // j_(count+1) = -j_(count-1)
  double even = (2 * count - 1) * inverse * odd;  // j_(count-2)
  double even_above = 0.0;
  const auto two_below = [q](double order, double reciprocal, double value, double above) {
    return (q * (order * (order - 1.0)) - (2.0 - 2.0 * reciprocal)) * value -
           (1.0 - 2.0 * reciprocal) * above;
  };
  for (int n = count - 1; n > 1; n -= 2) {
    weights[static_cast<std::size_t>(n)] = odd;
    weights[static_cast<std::size_t>(n - 1)] = even;
    const double order = n + 0.5;
    const double both = 1.0 / (order * (order + 1.0));  // one division for two reciprocals
    const double odd_below = two_below(order, both * order, odd, odd_above);
    const double even_below = two_below(order - 1.0, both * (order + 1.0), even, even_above);
    odd_above = odd;
    odd = odd_below;
    even_above = even;
    even = even_below;
  }
  weights[1] = odd;
  weights[0] = even;
  // j_0 and j_1 fix the scale together: their squares never vanish at one x. Below 0.5 the closed
  // form of j_1 cancels, and j_0 is close to 1.
  const double j0 = std::sin(x) * inverse;
  const double j1 = x < 0.5 ? 0.0 : (j0 - std::cos(x)) * inverse;
  const double first = x < 0.5 ? 0.0 : weights[1];
  const double scale = (j0 * weights[0] + j1 * first) / (weights[0] * weights[0] + first * first);
  for (int n = 0; n < count; n += 4) {
    const auto i = static_cast<std::size_t>(n);
    weights[i] *= scale * (2 * n + 1);
    weights[i + 1] *= -scale * (2 * n + 3);
    if (n + 2 < count) {
      weights[i + 2] *= -scale * (2 * n + 5);
      weights[i + 3] *= scale * (2 * n + 7);
    }
  }
  return count;
}

// Pairs of n from which on J_(2n+1)(v) is negligible.
int negligible_pairs(double v) noexcept { return (bessel_negligible_order(v) + 5) / 4; }

// Twice the sum of weights J_(2n+1)(v)/v, the odd orders alone:
//
//     J_(2n-1) = (8 n (2n+1)/v^2 - (2n+1)/(n+1)) J_(2n+1) - n/(n+1) J_(2n+3)
//
// (the three-term recurrence, applied three times; Abramowitz & Stegun 9.1.27). Downwards the
// scale is that of  sum (2n+1) J_(2n+1) = v/2, whose terms are never large against it.
std::complex<double> downward(double v, std::span<const double> weights) noexcept {
  const double q = 8.0 / (v * v);
  const int top = 2 * negligible_pairs(v);
  double above = 0.0;
  double value = 1e-30;
  double sum = 0.0;
  double real = 0.0;
  double imaginary = 0.0;
  const auto step = [&](int n) {
    const double order = 2 * n + 1;
    const double inverse = 1.0 / (n + 1);
    const double below = (q * (n * order) - (2.0 - inverse)) * value - (1.0 - inverse) * above;
    sum += order * value;
    above = value;
    value = below;
  };
  int n = top - 1;
  for (; n >= static_cast<int>(weights.size()); --n) step(n);
  for (; n > 0; n -= 2) {
    imaginary += weights[static_cast<std::size_t>(n)] * value;
    step(n);
    real += weights[static_cast<std::size_t>(n - 1)] * value;
    step(n - 1);
  }
  const double scale = 0.5 / sum;
  return {real * scale, imaginary * scale};
}

// Upwards from J_1 and J_3, for orders up to v only.
std::complex<double> upward(double v, std::span<const double> weights) noexcept {
  const double inverse_v = 1.0 / v;
  const double q = 8.0 * inverse_v * inverse_v;
  const BesselPair start = bessel_j0_j1(v);
  double below = start.j1;
  double value = 4.0 * inverse_v * (2.0 * inverse_v * start.j1 - start.j0) - start.j1;
  double real = weights[0] * below;
  double imaginary = weights[1] * value;
  for (std::size_t i = 2; i + 1 < weights.size(); i += 2) {
    const auto step = [&](double n) {
      const double ratio = 1.0 + 1.0 / n;
      const double above =
          (q * (n + 1.0) * (2.0 * n + 1.0) - (2.0 * n + 1.0) / n) * value - ratio * below;
      below = value;
      value = above;
    };
    step(static_cast<double>(i - 1));
    real += weights[i] * value;
    step(static_cast<double>(i));
    imaginary += weights[i + 1] * value;
  }
  return {real * inverse_v, imaginary * inverse_v};
}

std::complex<double> weighted_sum(double v, std::span<const double> weights) noexcept {
  const auto useful = std::min(weights.size(), 2 * static_cast<std::size_t>(negligible_pairs(v)));
  const std::span<const double> terms = weights.first(useful);
  const bool orders_below_v = v >= kHankelFrom && 2.0 * static_cast<double>(useful) <= v;
  return orders_below_v ? upward(v, terms) : downward(v, terms);
}

using Lanes = std::array<double, kLanes>;

struct LaneSums {
  Lanes real = {};
  Lanes imaginary = {};
};

// downward() for eight v at once, as long as the series of the largest.
LaneSums downward(const Lanes& v, double largest, std::span<const double> weights) noexcept {
  Lanes q;
  Lanes above;
  Lanes value;
  Lanes sum;
  LaneSums sums;
  for (std::size_t l = 0; l < kLanes; ++l) {
    q[l] = 8.0 / (v[l] * v[l]);
    above[l] = sum[l] = 0.0;
    value[l] = kLaneSeed;
  }
  const auto step = [&](int n) {
    const double order = 2 * n + 1;
    const double product = n * order;
    const double inverse = 1.0 / (n + 1);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const double below =
          (q[l] * product - (2.0 - inverse)) * value[l] - (1.0 - inverse) * above[l];
      sum[l] += order * value[l];
      above[l] = value[l];
      value[l] = below;
    }
  };
  int n = 2 * negligible_pairs(largest) - 1;
  for (; n >= static_cast<int>(weights.size()); --n) step(n);
  for (; n > 0; n -= 2) {
    const double odd = weights[static_cast<std::size_t>(n)];
    const double even = weights[static_cast<std::size_t>(n - 1)];
    for (std::size_t l = 0; l < kLanes; ++l) sums.imaginary[l] += odd * value[l];
    step(n);
    for (std::size_t l = 0; l < kLanes; ++l) sums.real[l] += even * value[l];
    step(n - 1);
  }
  for (std::size_t l = 0; l < kLanes; ++l) {
    sums.real[l] *= 0.5 / sum[l];
    sums.imaginary[l] *= 0.5 / sum[l];
  }
  return sums;
}

// upward() for eight v at once.
LaneSums upward(const Lanes& v, std::span<const double> weights) noexcept {
  Lanes inverse_v;
  Lanes q;
  Lanes below;
  Lanes value;
  LaneSums sums;
  for (std::size_t l = 0; l < kLanes; ++l) {
    const BesselPair start = bessel_j0_j1(v[l]);
    inverse_v[l] = 1.0 / v[l];
    q[l] = 8.0 * inverse_v[l] * inverse_v[l];
    below[l] = start.j1;
    value[l] = 4.0 * inverse_v[l] * (2.0 * inverse_v[l] * start.j1 - start.j0) - start.j1;
    sums.real[l] = weights[0] * below[l];
    sums.imaginary[l] = weights[1] * value[l];
  }
  const auto step = [&](double n) {
    const double product = (n + 1.0) * (2.0 * n + 1.0);
    const double inverse = 1.0 / n;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const double above =
          (q[l] * product - (2.0 + inverse)) * value[l] - (1.0 + inverse) * below[l];
      below[l] = value[l];
      value[l] = above;
    }
  };
  for (std::size_t i = 2; i + 1 < weights.size(); i += 2) {
    step(static_cast<double>(i - 1));
    for (std::size_t l = 0; l < kLanes; ++l) sums.real[l] += weights[i] * value[l];
    step(static_cast<double>(i));
    for (std::size_t l = 0; l < kLanes; ++l) sums.imaginary[l] += weights[i + 1] * value[l];
  }
  for (std::size_t l = 0; l < kLanes; ++l) {
    sums.real[l] *= inverse_v[l];
    sums.imaginary[l] *= inverse_v[l];
  }
  return sums;
}

// Whether the smallest v of a block bears starting at the order of the largest: J at that order,
// about (e v / 2 order)^order, must not leave the range of a double.
bool one_start_serves(double smallest, double largest) noexcept {
  if (smallest < kOnAxis || largest > kBeyond) return false;
  const double order = 4.0 * negligible_pairs(largest);
  const double ratio = 2.0 * order / (2.718281828459045 * smallest);
  return ratio < 1.0 || order * std::log10(ratio) < 250.0;
}

}  // namespace

std::complex<double> defocus_field(double v, double defocus) {
  require_defocus(defocus);
  const double magnitude = std::abs(v);
  if (!std::isfinite(v)) throw Error(ErrorCode::outside_domain, "needs a finite v");
  if (magnitude < kOnAxis) return axis_field(defocus);
  if (magnitude > kBeyond) return 0.0;
  std::array<double, kMostWeights> weights;  // filled as far as it is read
  const auto count = static_cast<std::size_t>(fill_weights(defocus, weights));
  const double quarter = 0.25 * std::abs(defocus);
  const std::complex<double> field =
      product({std::cos(quarter), std::sin(quarter)},
              weighted_sum(magnitude, std::span(weights).first(count)));
  return defocus < 0.0 ? std::conj(field) : field;
}

DefocusField::DefocusField(double defocus) : defocus_(defocus) {
  require_defocus(defocus);
  axis_ = axis_field(defocus);
  const double quarter = 0.25 * std::abs(defocus);
  phase_ = {std::cos(quarter), std::sin(quarter)};
  weights_.resize(kMostWeights);
  weights_.resize(static_cast<std::size_t>(fill_weights(defocus, weights_)));
  weights_.shrink_to_fit();
}

std::complex<double> DefocusField::operator()(double v) const noexcept {
  const double magnitude = std::abs(v);
  if (magnitude < kOnAxis) return axis_;
  if (magnitude > kBeyond) return 0.0;
  const std::complex<double> field = product(phase_, weighted_sum(magnitude, weights_));
  return defocus_ < 0.0 ? std::conj(field) : field;
}

void DefocusField::intensities(std::span<const double> v, std::span<double> result) const noexcept {
  std::size_t i = 0;
  for (; i + kLanes <= v.size(); i += kLanes) {
    Lanes block;
    for (std::size_t l = 0; l < kLanes; ++l) block[l] = std::abs(v[i + l]);
    const auto [smallest, largest] = std::ranges::minmax(block);
    const auto useful =
        std::min(weights_.size(), 2 * static_cast<std::size_t>(negligible_pairs(largest)));
    const auto terms = std::span(weights_).first(useful);
    const bool up = smallest >= kHankelFrom && 2.0 * static_cast<double>(useful) <= smallest &&
                    largest <= kBeyond;
    if (!up && !one_start_serves(smallest, largest)) {
      for (std::size_t l = i; l < i + kLanes; ++l) result[l] = intensity(v[l]);
      continue;
    }
    const LaneSums sums = up ? upward(block, terms) : downward(block, largest, terms);
    for (std::size_t l = 0; l < kLanes; ++l) {
      result[i + l] = sums.real[l] * sums.real[l] + sums.imaginary[l] * sums.imaginary[l];
    }
  }
  for (; i < v.size(); ++i) result[i] = intensity(v[i]);
}

}  // namespace fstop
