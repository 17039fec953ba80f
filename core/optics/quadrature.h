#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace fstop {

/// Nodes in (-1, 1) in rising order, and their weights, which add up to 2.
struct QuadratureRule {
  std::vector<double> nodes = {};
  std::vector<double> weights = {};
};

/// The Gauss-Legendre rule of `count` nodes: exact for polynomials of degree 2 count - 1.
/// Newton's iteration on the Legendre recurrence; nodes and weights to a few units of 2^-53.
/// Throws: Error{outside_domain} unless 1 <= count <= 100000.
/// Source: Abramowitz & Stegun 1964, 25.4.29; first guess Tricomi's, 22.16.6.
QuadratureRule gauss_legendre(int count);

/// Half of the 16-node Gauss-Legendre rule; the other nodes are the negatives.
inline constexpr std::array<double, 8> kGauss16Nodes = {
    0.0950125098376374402, 0.2816035507792589132, 0.4580167776572273863, 0.6178762444026437484,
    0.7554044083550030339, 0.8656312023878317439, 0.9445750230732325761, 0.9894009349916499326};
inline constexpr std::array<double, 8> kGauss16Weights = {
    0.1894506104550684963, 0.1826034150449235889, 0.1691565193950025382, 0.1495959888165767321,
    0.1246289712555338720, 0.0951585116824927848, 0.0622535239386478929, 0.0271524594117540949};

/// The integral of `f` over [from, to] by 16 nodes: without allocation, for kernels. An integrand
/// that turns through w radians over the interval is met to about (w/4)^32 / 32!: 1e-16 for
/// 2 pi, 1e-13 for 10.
template <typename Function>
auto gauss16(double from, double to, Function&& f) {
  const double centre = 0.5 * (from + to);
  const double half = 0.5 * (to - from);
  auto sum = kGauss16Weights[0] *
             (f(centre - half * kGauss16Nodes[0]) + f(centre + half * kGauss16Nodes[0]));
  for (std::size_t i = 1; i < kGauss16Nodes.size(); ++i) {
    const double offset = half * kGauss16Nodes[i];
    sum += kGauss16Weights[i] * (f(centre - offset) + f(centre + offset));
  }
  return sum * half;
}

}  // namespace fstop
