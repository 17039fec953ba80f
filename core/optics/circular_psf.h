#pragma once

#include <span>

#include "core/optics/defocus_field.h"
#include "core/optics/diffraction.h"

namespace fstop {

/// The image of a point through a round pupil in monochromatic light, unit energy:
///
///     PSF(rho) = k^2 a^2 / (pi z^2) |G(k a rho / z, U)|^2
///
/// Pinhole and defocused lens alike. Rotationally symmetric, on axis.
/// Valid: scalar paraxial waves; `error()` bounds what that costs.
class CircularPsf {
 public:
  /// Throws: Error{outside_domain} with the reason where require_wave_model() refuses, or where
  ///         |U| exceeds kLargestDefocus.
  CircularPsf(const CircularPupil& pupil, Length wavelength);

  double defocus() const noexcept { return field_.defocus(); }
  DiffractionRegime regime() const noexcept { return diffraction_regime(field_.defocus()); }
  WaveModelError error() const noexcept { return error_; }
  const DefocusField& field() const noexcept { return field_; }

  /// v = k a rho / z and back.
  double reduced_radius(Length radius) const noexcept { return radius.si() * v_per_metre_; }
  Length radius(double v) const noexcept { return Length::si(v / v_per_metre_); }
  /// s = nu lambda z / a: 2 at the cut-off, for the functions of transfer.h.
  double reduced_frequency(Vergence frequency) const noexcept {
    return frequency.si() * s_per_frequency_;
  }
  /// Diameter of the geometric shadow or circle of confusion: v = |U|.
  Length geometric_diameter() const noexcept;

  /// Energy per area at `radius` from the centre; any sign, finite.
  InverseArea density(Length radius) const noexcept;
  /// The same for radii and densities in SI units (m, 1/m^2), eight at a time. Spans of one size,
  /// which may be the same span.
  void densities(std::span<const double> radii, std::span<double> result) const noexcept;
  /// Irradiance over that of the light falling on the pupil, at `radius`.
  double intensity_over_incident(Length radius) const noexcept;

  /// Share of the light within `radius`. Throws: Error{outside_domain} unless finite and >= 0.
  double encircled_energy(Length radius) const;
  /// Its inverse. Throws: Error{outside_domain} unless 0 < fraction <= 0.99999.
  Length encircled_radius(double fraction) const;

 private:
  DefocusField field_;
  WaveModelError error_;
  double v_per_metre_;
  double s_per_frequency_;
  double peak_;      // k^2 a^2 / (pi z^2), 1/m^2
  double incident_;  // (k a^2 / z)^2
};

}  // namespace fstop
