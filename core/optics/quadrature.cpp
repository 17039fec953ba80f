#include "core/optics/quadrature.h"

#include <cmath>
#include <numbers>

#include "core/error.h"

namespace fstop {
namespace {

struct Legendre {
  double value = 0.0;
  double slope = 0.0;
};

Legendre legendre(int degree, double x) {
  double previous = 1.0;
  double value = x;
  for (int k = 2; k <= degree; ++k) {
    const double next = ((2.0 * k - 1.0) * x * value - (k - 1.0) * previous) / k;
    previous = value;
    value = next;
  }
  return {value, degree * (previous - x * value) / ((1.0 - x) * (1.0 + x))};
}

}  // namespace

QuadratureRule gauss_legendre(int count) {
  if (count < 1 || count > 100000) {
    throw Error(ErrorCode::outside_domain, "a Gauss-Legendre rule has 1 to 100000 nodes");
  }
  const auto size = static_cast<std::size_t>(count);
  QuadratureRule rule{std::vector<double>(size), std::vector<double>(size)};
  for (std::size_t i = 0; i < (size + 1) / 2; ++i) {
    const double angle = std::numbers::pi * (static_cast<double>(i) + 0.75) / (count + 0.5);
    double x = 2 * i + 1 == size ? 0.0 : std::cos(angle);
    // Newton doubles the digits of a guess that has at least three: four steps suffice.
    for (int step = 0; step < 4; ++step) {
      const Legendre p = legendre(count, x);
      x -= p.value / p.slope;
    }
    const double slope = legendre(count, x).slope;
    const double weight = 2.0 / ((1.0 - x) * (1.0 + x) * slope * slope);
    rule.nodes[i] = -x;
    rule.nodes[size - 1 - i] = x;
    rule.weights[i] = rule.weights[size - 1 - i] = weight;
  }
  return rule;
}

}  // namespace fstop
