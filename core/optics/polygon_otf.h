#pragma once

#include <array>
#include <complex>

#include "core/geometry.h"
#include "core/optics/aperture.h"

namespace fstop {

/// OTF of a regular polygon's pupil, in focus and out of it:
///
///     H(s) = 1/pi integral over P(x + s/2) P(x - s/2) of exp(-i U s . x) dx dy,
///
/// s = nu lambda z/a, a the radius of the disc of the same area, so that the cut-off (2 for the
/// disc) differs by direction. It is the transform integral of PSF(r) exp(-2 pi i nu . r) of the
/// point spread that PolygonPupil::field gives at q = k a r/z: r in the pupil's axes on the real
/// sensor. In the upright image, where r has the other sign, the OTF is H(-s), the conjugate.
/// Complex where the blades are odd and U is not 0; H(-s) = conj H(s); H(0) = 1.
/// Method: two shifted copies' phases differ linearly, and the phase turns along s alone: the
/// overlap lies between the polygon's two chains where the chord along s is at least |s| long, and
///
///     H = i/(omega area) closed sum of (mean of exp(-i omega xi) along the edge - 1) d(eta),
///
/// omega = U |s|, xi along s, eta across. No quadrature: rounding alone, 1e-14 absolute.
/// Source: Goodman, Introduction to Fourier Optics, 6.4.3 (overlap with the phase difference);
///         Green's theorem for the edges.
class PolygonOtf {
 public:
  static constexpr int kMostBlades = 64;

  /// Throws: Error{outside_domain} unless 3 <= blades <= 64, the rotation is finite and |U| <=
  ///         kLargestDefocus.
  PolygonOtf(const Aperture& aperture, double defocus);

  /// H(s) for finite s; 0 where the copies do not overlap. Allocates nothing.
  std::complex<double> operator()(Vec2 s) const noexcept;

  double defocus() const noexcept { return defocus_; }
  /// The s along the unit vector `direction` from which on H is 0.
  double cut_off(Vec2 direction) const noexcept;

 private:
  using Corners = std::array<Vec2, static_cast<std::size_t>(kMostBlades)>;

  // (xi, eta) of the corners: xi along `direction`, eta a quarter turn further.
  Corners turned(Vec2 direction) const noexcept;

  int blades_;
  double defocus_;
  double circumradius_;
  Corners corners_ = {};  // counter-clockwise from +x towards +y
};

}  // namespace fstop
