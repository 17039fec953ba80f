#pragma once

#include <array>
#include <complex>
#include <vector>

#include "core/optics/diffraction.h"

namespace fstop {

/// The image of a point through a pinhole at a field angle, unit energy: the chief ray meets hole
/// and screen at `field_angle`, and the zones number differently along and across the plane of
/// incidence:
///
///     N_r = N_F cos^3(theta),   N_t = N_F cos(theta)
///     A = integral over the unit disc of exp(i [(U_r x^2 + U_t y^2)/2 - v_r x - v_t y]) dx dy
///     v_r = k a cos^3(theta) X/z,  v_t = k a cos(theta) Y/z,  U = 2 pi N
///     PSF = (k a/z)^2 cos^4(theta) |A|^2 / (4 pi^3)
///
/// X points away from the image centre, Y across, both on the screen from the chief ray's point.
/// Method: the angle's part in Fourier modes, A = 2 pi sum (2 - [m = 0]) (-i)^m cos(2 m psi)
///         integral of J_m(D r^2/2) exp(i M r^2/2) J_2m(v r) r dr with M, D = (U_r +- U_t)/2; the
///         radius by 16 Gauss-Legendre nodes for every 6 radians. 1e-13 of the peak.
/// Valid: as CircularPsf for the distance z/cos(theta); `error()` adds the cubic phase that this
///        form leaves out, 0.65 k a^3 sin(theta) cos^2(theta) / (2 z^2).
/// Source: the path's expansion to second order about the chief ray; A&S 9.1.44, 9.1.45.
class ObliquePinholePsf {
 public:
  /// `field_angle` in radians; `largest_radius` from the chief ray's point is what density()
  /// serves. Throws: Error{outside_domain} where require_wave_model() refuses the pupil, for a
  /// lens, for an
  ///         angle beyond 75 degrees, and where defocus or radius need over 500 modes or 4096
  ///         nodes.
  ObliquePinholePsf(const CircularPupil& pinhole, Length wavelength, double field_angle,
                    Length largest_radius);

  /// Energy per area at (radial, tangential) from the chief ray's point; NaN-free inside
  /// largest_radius, where nodes suffice; beyond it the accuracy decays.
  InverseArea density(Length radial, Length tangential) const noexcept;
  /// |E|^2 over that of the light falling on the hole.
  double intensity_over_incident(Length radial, Length tangential) const noexcept;

  double radial_defocus() const noexcept { return radial_defocus_; }
  double tangential_defocus() const noexcept { return tangential_defocus_; }
  /// Relative L2 error of the image's shape against Rayleigh-Sommerfeld's first integral.
  double error() const noexcept { return error_; }
  int node_count() const noexcept { return static_cast<int>(radii_.size()); }

 private:
  double squared_amplitude(double v_radial, double v_tangential) const noexcept;

  double radial_defocus_ = 0.0;
  double tangential_defocus_ = 0.0;
  double error_ = 0.0;
  double radial_scale_ = 0.0;  // v per metre
  double tangential_scale_ = 0.0;
  double density_scale_ = 0.0;  // 1/m^2
  double incident_scale_ = 0.0;
  int modes_ = 1;
  std::vector<double> radii_;                       // of the nodes, in (0, 1)
  std::vector<std::complex<double>> coefficients_;  // [node][mode]
};

}  // namespace fstop
