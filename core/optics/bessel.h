#pragma once

#include <span>

namespace fstop {

/// J_0 and J_1 at one argument.
struct BesselPair {
  double j0 = 1.0;
  double j1 = 0.0;
};

/// From here on Hankel's asymptotic series reaches full precision.
inline constexpr double kHankelFrom = 25.0;

/// Bessel functions of the first kind, orders 0 and 1, to 4e-16 absolute for every finite x:
/// Miller's backward recurrence below kHankelFrom, Hankel's asymptotic series above.
/// Source: Abramowitz & Stegun 1964, 9.1.27, 9.1.46, 9.2.5, 9.2.9, 9.2.10.
BesselPair bessel_j0_j1(double x) noexcept;

/// 2 J_1(x)/x, 1 at x = 0: the transform of a uniform disc.
double jinc(double x) noexcept;

/// Fills `orders` with J_0(x), J_1(x), ... to 1e-15 absolute, for every finite x.
void bessel_j(double x, std::span<double> orders) noexcept;

/// An order n >= x from which on |J_n(x)| < 1e-18, and likewise the spherical j_n(x); x >= 0.
/// Past the turning point n = x the decay is Airy's, on the scale x^(1/3); the coefficients were
/// fitted to the orders where the functions fall below 1e-18 for x from 0 to 20000.
int bessel_negligible_order(double x) noexcept;

}  // namespace fstop
