#include "core/optics/lommel.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/optics/bessel.h"
#include "core/optics/defocus_field.h"

namespace fstop {
namespace {

// sum over s of (-1)^s ratio^(n+2s) J_(n+2s) for n and n + 1.
struct PairOfSums {
  double first = 0.0;
  double second = 0.0;
};

// J_0 to J_top with their relative digits however small: on the wrong side they meet huge powers.
// Downwards, in long double for its range of exponents.
std::vector<long double> bessel_with_digits(double v, std::size_t top) {
  std::vector<long double> bessel(top + 1);
  long double above = 0.0L;
  long double value = 1e-2400L;
  long double even_sum = 0.0L;
  for (std::size_t n = top; n > 0; --n) {
    bessel[n] = value;
    if (n % 2 == 0) even_sum += value;
    const long double below = 2.0L * static_cast<long double>(n) / v * value - above;
    above = value;
    value = below;
  }
  bessel[0] = value;
  for (long double& entry : bessel) entry /= value + 2.0L * even_sum;
  return bessel;
}

// Rounded to double on the way, as a plain evaluation would be.
PairOfSums lommel_sums(const std::vector<long double>& bessel, std::size_t n, double ratio) {
  PairOfSums sums;
  long double power = n == 0 ? 1.0L : ratio;
  double sign = 1.0;
  for (std::size_t order = n; order + 1 < bessel.size(); order += 2) {
    sums.first += sign * static_cast<double>(power * bessel[order]);
    sums.second += sign * static_cast<double>(power * ratio * bessel[order + 1]);
    power *= static_cast<long double>(ratio) * ratio;
    sign = -sign;
  }
  return sums;
}

}  // namespace

std::complex<double> lommel_field(double v, double defocus, LommelSide side) {
  const double U = std::abs(defocus);
  if (!(U > 0.0 && U <= kLargestDefocus && v > 0.0 && v <= 1e5)) {
    throw Error(ErrorCode::outside_domain,
                "Lommel's series need 0 < |U| <= 10000 and 0 < v <= 100000");
  }
  // Orders until J itself is negligible, and on the wrong side until the powers are, too.
  const double ratio = side == LommelSide::u_series ? U / v : v / U;
  const double reach = bessel_negligible_order(v) * std::max(1.0, std::min(4.0, ratio));
  const std::vector<long double> bessel =
      bessel_with_digits(v, static_cast<std::size_t>(reach) + 4);
  const std::complex<double> rim = std::polar(1.0, 0.5 * U);
  const std::complex<double> i(0.0, 1.0);
  std::complex<double> field;
  if (side == LommelSide::u_series) {
    const PairOfSums sums = lommel_sums(bessel, 1, ratio);
    field = rim / U * (sums.first - i * sums.second);
  } else {
    const PairOfSums sums = lommel_sums(bessel, 0, ratio);
    field = i / U * (std::polar(1.0, -0.5 * v * ratio) - rim * (sums.first - i * sums.second));
  }
  return defocus < 0.0 ? std::conj(field) : field;
}

}  // namespace fstop
