#pragma once

#include <string_view>

#include "core/optics/thin_lens.h"
#include "core/units.h"

namespace fstop {

using InverseArea = Quantity<-2>;  ///< energy per area, for unit energy

/// Intensity of the Airy pattern over its peak, (2 J_1(v)/v)^2; v = k a rho / z.
double airy_intensity(double v) noexcept;

/// Share of the light within v: 1 - J_0(v)^2 - J_1(v)^2. Source: Rayleigh 1881; Hecht 10.2.5.
double airy_encircled_energy(double v) noexcept;

/// A round pupil and the screen behind it: a pinhole, or a lens that images another plane.
struct CircularPupil {
  Length diameter = {};        // 2a
  Length image_distance = {};  // z, pupil to screen
  Vergence defocus = {};       // 1/z + 1/u - 1/f; 1/f = 0 for a pinhole; 0 in focus
  bool has_lens = false;
  Length object_distance = kInfinitelyFar;  // u, for the error bound of a pinhole
};

/// A pinhole of `diameter`; `object_distance` may be kInfinitelyFar.
/// Throws: Error{outside_domain} unless all lengths are positive, diameter and f' finite.
CircularPupil pinhole_pupil(Length diameter, Length image_distance,
                            Length object_distance = kInfinitelyFar);

/// The pupil of `lens` focused at `focus_distance` for a point at `object_distance`; both may be
/// kInfinitelyFar. Defocus 1/u - 1/s: positive in front of the focused plane.
/// Throws: Error{outside_domain} unless f > 0, N > 0, s > f and u > 0.
CircularPupil lens_pupil(const ThinLens& lens, Length focus_distance, Length object_distance);

/// U = k a^2 (1/z + 1/u - 1/f), in radians.
double reduced_defocus(const CircularPupil& pupil, Length wavelength);

/// W20 = U lambda / 4 pi over lambda: the defocus aberration at the rim, in waves.
double defocus_waves(double reduced_defocus) noexcept;

/// How much of the wave matters, by the Fresnel zones |U|/2 pi that the pupil shows.
enum class DiffractionRegime {
  fraunhofer,       ///< below 0.1: Airy's pattern, to 0.6 % of the OTF
  fresnel,          ///< neither limit holds
  geometric_shadow  ///< above 10: the disc of rays, to 4 % of the OTF
};
DiffractionRegime diffraction_regime(double reduced_defocus) noexcept;
std::string_view name_of(DiffractionRegime regime) noexcept;

/// Relative L2 error of the paraxial, scalar intensity against Rayleigh-Sommerfeld's first
/// integral.
struct WaveModelError {
  double obliquity = 0.0;   // 0.25 (lambda/a)^2: directions far from the axis
  double aberration = 0.0;  // the phase beyond the parabola
  double total() const { return obliquity + aberration; }
};

/// The bound of the model's own error:
///
///     0.25 (lambda/a)^2 + 1.2 a^4/lambda (1/z^3 + 1/u^3)                   for a pinhole
///     0.25 (lambda/a)^2 + (a/z)^2 [0.8 + max(3, 1 + m + m^2)/6 sqrt(|U|)]  for a lens
///
/// Both were fitted to quadratures of the first integral: the pinhole's for a from 0.5 to 300
/// wavelengths, the lens's for f/1.2 to f/16, -5 to 20 waves of defocus and m up to 17. The lens
/// makes a perfect sphere that converges at z/m, m = 1 - z (1/z + 1/u - 1/f), with uniform
/// amplitude over its flat pupil; its quartic phase is |U| (a/z)^2 (1 + m + m^2)/8. Valid: a >= 5
/// lambda; aberration below 0.1 (pinhole), a/z <= 0.5 (lens).
WaveModelError wave_model_error(const CircularPupil& pupil, Length wavelength) noexcept;

/// Throws: Error{outside_domain} with the reason where the bound above does not hold.
void require_wave_model(const CircularPupil& pupil, Length wavelength);

}  // namespace fstop
