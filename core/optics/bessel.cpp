#include "core/optics/bessel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace fstop {
namespace {

// Terms of Hankel's series in 1/x^2; at x = 25 the first one left out is below 1e-17.
constexpr std::size_t kHankelTerms = 10;

// The coefficients of P (even k) and Q (odd k) with their alternating signs, lowest first:
// a_k = a_(k-1) (4 nu^2 - (2k - 1)^2) / (8 k).
struct HankelSeries {
  std::array<double, kHankelTerms> p = {};
  std::array<double, kHankelTerms> q = {};
};

constexpr HankelSeries hankel_series(double order) {
  HankelSeries series;
  double a = 1.0;
  double sign = 1.0;
  for (std::size_t i = 0; i < kHankelTerms; ++i) {
    const double k = 2.0 * static_cast<double>(i) + 1.0;
    series.p[i] = sign * a;
    a *= (4.0 * order * order - (2.0 * k - 1.0) * (2.0 * k - 1.0)) / (8.0 * k);
    series.q[i] = sign * a;
    a *= (4.0 * order * order - (2.0 * k + 1.0) * (2.0 * k + 1.0)) / (8.0 * (k + 1.0));
    sign = -sign;
  }
  return series;
}

constexpr HankelSeries kOrder0 = hankel_series(0.0);
constexpr HankelSeries kOrder1 = hankel_series(1.0);

BesselPair hankel(double x) noexcept {
  const double inverse = 1.0 / x;
  const double y = inverse * inverse;
  double p0 = kOrder0.p.back();
  double q0 = kOrder0.q.back();
  double p1 = kOrder1.p.back();
  double q1 = kOrder1.q.back();
  for (std::size_t i = kHankelTerms - 1; i-- > 0;) {
    p0 = p0 * y + kOrder0.p[i];
    q0 = q0 * y + kOrder0.q[i];
    p1 = p1 * y + kOrder1.p[i];
    q1 = q1 * y + kOrder1.q[i];
  }
  q0 *= inverse;
  q1 *= inverse;
  // sqrt(2/(pi x)) times the cosine and sine of x - pi/4, which lose no digit of x this way.
  const double amplitude = std::sqrt(inverse / std::numbers::pi);
  const double c = std::cos(x);
  const double s = std::sin(x);
  const double cosine = amplitude * (c + s);
  const double sine = amplitude * (s - c);
  return {cosine * p0 - sine * q0, sine * p1 + cosine * q1};
}

// Miller's recurrence down from a negligible order; calls store(n, unscaled J_n) for n from the
// top to 0 and returns the scale that J_0 + 2 J_2 + 2 J_4 + ... = 1 asks for.
template <typename Store>
double miller(double x, Store&& store) noexcept {
  const int top = bessel_negligible_order(x) | 1;
  const double two_over_x = 2.0 / x;
  double above = 0.0;
  double value = 1e-30;
  double even_sum = 0.0;
  store(top, value);
  for (int n = top; n > 0; --n) {
    const double below = n * two_over_x * value - above;
    above = value;
    value = below;
    store(n - 1, value);
    if (n % 2 != 0) even_sum += value;
  }
  return 1.0 / (2.0 * even_sum - value);
}

}  // namespace

int bessel_negligible_order(double x) noexcept {
  return static_cast<int>(x + 11.5 * std::cbrt(x) + 6.0);
}

BesselPair bessel_j0_j1(double x) noexcept {
  const double magnitude = std::abs(x);
  // Below 1e-8 the next terms of both series, x^2/4 and x^2/8, are beyond the last bit.
  if (magnitude < 1e-8) return {1.0, 0.5 * x};
  // Beyond 1e300 the amplitude is below 1e-150 and the reduction of x pointless.
  if (magnitude > 1e300) return {0.0, 0.0};
  BesselPair pair;
  if (magnitude >= kHankelFrom) {
    pair = hankel(magnitude);
  } else {
    const double scale = miller(magnitude, [&pair](int n, double value) {
      if (n == 1) pair.j1 = value;
      if (n == 0) pair.j0 = value;
    });
    pair.j0 *= scale;
    pair.j1 *= scale;
  }
  if (x < 0.0) pair.j1 = -pair.j1;
  return pair;
}

double jinc(double x) noexcept { return std::abs(x) < 1e-8 ? 1.0 : 2.0 * bessel_j0_j1(x).j1 / x; }

void bessel_j(double x, std::span<double> orders) noexcept {
  const double magnitude = std::abs(x);
  const std::size_t count = orders.size();
  if (magnitude < 1e-8 || magnitude > 1e300) {
    std::ranges::fill(orders, 0.0);
    const BesselPair pair = bessel_j0_j1(x);
    if (count > 0) orders[0] = pair.j0;
    if (count > 1) orders[1] = pair.j1;
    return;
  }
  // Upwards the recurrence is stable below the turning point n = x, downwards everywhere.
  if (magnitude >= kHankelFrom && static_cast<double>(count) <= magnitude) {
    const BesselPair pair = hankel(magnitude);
    if (count > 0) orders[0] = pair.j0;
    if (count > 1) orders[1] = pair.j1;
    for (std::size_t n = 2; n < count; ++n) {
      const double factor = 2.0 * (static_cast<double>(n) - 1.0) / magnitude;
      orders[n] = factor * orders[n - 1] - orders[n - 2];
    }
  } else {
    std::ranges::fill(orders, 0.0);
    const double scale = miller(magnitude, [&](int n, double value) {
      if (static_cast<std::size_t>(n) < count) orders[static_cast<std::size_t>(n)] = value;
    });
    for (double& value : orders) value *= scale;
  }
  if (x < 0.0) {
    for (std::size_t n = 1; n < count; n += 2) orders[n] = -orders[n];
  }
}

}  // namespace fstop
