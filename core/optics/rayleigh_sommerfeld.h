#pragma once

#include "core/units.h"

namespace fstop {

/// A plane wave, or the wave of a point on the axis, falling squarely on a round hole in an opaque
/// screen.
struct RoundHole {
  Length radius = {};    // a
  Length distance = {};  // z, hole to screen
  Length wavelength = {};
};

struct IntensityEstimate {
  double value = 0.0;  // |E|^2 over that of the wave falling on the hole
  double error = 0.0;  // difference from the same quadrature with half the nodes
  int nodes = 0;
};

/// Rayleigh's and Sommerfeld's integral of the first kind for a plane wave, at `offset` from the
/// axis: the reference that the Fresnel forms are judged by. In polar coordinates about the foot of
/// the field point the radial integral is a perfect differential, which leaves the rim:
///
///     E = -1/(2 pi) closed integral of (F(R) - F(z)) w dtheta,   F(R) = (z/R) exp(ikR),
///     R^2 = z^2 + d^2,  d^2 = a^2 + rho^2 - 2 a rho cos(theta),  w = (a^2 - a rho cos(theta))/d^2
///
/// (F(z) carries the wave that passed unhindered: no jump at the shadow's edge). The integrand is
/// periodic and smooth, the trapezoidal rule converges exponentially; the node count follows the
/// phase and is doubled until two agree to 1e-13 of the largest intensity, 4.
/// Valid: scalar wave, infinitely thin screen. Below a = 2 wavelengths light is no scalar.
/// Throws: Error{outside_domain} unless all lengths are positive and finite, a and rho at most 1e5
///         wavelengths and z at least a/1000; Error{over_budget} if 2^22 nodes do not suffice.
/// Source: Goodman, Introduction to Fourier Optics, 3.5; the reduction to the rim after Maggi 1888,
///         Rubinowicz 1917 (Born & Wolf 8.9), here for the Rayleigh kernel.
IntensityEstimate rayleigh_sommerfeld_intensity(const RoundHole& hole, Length offset);

/// The same integral on the axis for the wave of a point at `object_distance`, radially.
/// Infinity is legal: |1 - (z/R) exp(ik(R - z))|^2 with R^2 = z^2 + a^2.
double rayleigh_sommerfeld_on_axis(const RoundHole& hole, Length object_distance = kInfinitelyFar);

}  // namespace fstop
