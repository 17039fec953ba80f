#include "core/optics/diffraction.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <sstream>
#include <string>

#include "core/error.h"
#include "core/optics/bessel.h"

namespace fstop {
namespace {

constexpr double kFewestWavelengths = 5.0;
constexpr double kLargestAberration = 0.1;
constexpr double kWidestLens = 0.5;  // a/z; f/1

void require(bool valid, const std::string& message) {
  if (!valid) throw Error(ErrorCode::outside_domain, message);
}

std::string text(double value) {
  std::ostringstream out;
  out.precision(3);
  out << value;
  return out.str();
}

}  // namespace

double airy_intensity(double v) noexcept {
  const double amplitude = jinc(v);
  return amplitude * amplitude;
}

double airy_encircled_energy(double v) noexcept {
  const BesselPair j = bessel_j0_j1(v);
  return (1.0 - j.j0) * (1.0 + j.j0) - j.j1 * j.j1;
}

CircularPupil pinhole_pupil(Length diameter, Length image_distance, Length object_distance) {
  require(diameter > Length{} && image_distance > Length{} && object_distance > Length{} &&
              is_finite(diameter) && is_finite(image_distance),
          "needs D > 0, f' > 0 and u > 0, D and f' finite");
  return {.diameter = diameter,
          .image_distance = image_distance,
          .defocus = 1.0 / image_distance + 1.0 / object_distance,
          .has_lens = false,
          .object_distance = object_distance};
}

CircularPupil lens_pupil(const ThinLens& lens, Length focus_distance, Length object_distance) {
  require(lens.focal_length > Length{} && focus_distance > lens.focal_length,
          "needs f > 0 and s > f");
  require(object_distance > Length{}, "needs u > 0");
  return {.diameter = aperture_diameter(lens),
          .image_distance = image_distance(lens.focal_length, focus_distance),
          .defocus = vergence_difference(object_distance, focus_distance),
          .has_lens = true,
          .object_distance = object_distance};
}

double reduced_defocus(const CircularPupil& pupil, Length wavelength) {
  require(wavelength > Length{} && is_finite(wavelength), "needs a finite wavelength above 0");
  const Length radius = pupil.diameter / 2.0;
  return 2.0 * std::numbers::pi * (radius / wavelength) * (radius * pupil.defocus);
}

double defocus_waves(double reduced_defocus) noexcept {
  return reduced_defocus / (4.0 * std::numbers::pi);
}

DiffractionRegime diffraction_regime(double reduced_defocus) noexcept {
  const double zones = std::abs(reduced_defocus) / (2.0 * std::numbers::pi);
  if (zones <= 0.1) return DiffractionRegime::fraunhofer;
  return zones < 10.0 ? DiffractionRegime::fresnel : DiffractionRegime::geometric_shadow;
}

std::string_view name_of(DiffractionRegime regime) noexcept {
  switch (regime) {
    case DiffractionRegime::fraunhofer:
      return "fraunhofer";
    case DiffractionRegime::fresnel:
      return "fresnel";
    case DiffractionRegime::geometric_shadow:
      return "geometric-shadow";
  }
  return "";
}

WaveModelError wave_model_error(const CircularPupil& pupil, Length wavelength) noexcept {
  const double a = 0.5 * pupil.diameter.si();
  const double z = pupil.image_distance.si();
  const double lambda = wavelength.si();
  WaveModelError error;
  error.obliquity = 0.25 * (lambda / a) * (lambda / a);
  const double slope = a / z;
  if (pupil.has_lens) {
    const double defocus = 2.0 * std::numbers::pi * (a / lambda) * a * pupil.defocus.si();
    const double m = 1.0 - z * pupil.defocus.si();
    error.aberration =
        slope * slope * (0.8 + std::max(3.0, 1.0 + m + m * m) / 6.0 * std::sqrt(std::abs(defocus)));
  } else {
    const double object_slope = a / pupil.object_distance.si();
    error.aberration =
        1.2 * (a / lambda) * (slope * slope * slope + object_slope * object_slope * object_slope);
  }
  return error;
}

void require_wave_model(const CircularPupil& pupil, Length wavelength) {
  require(wavelength > Length{} && is_finite(wavelength), "needs a finite wavelength above 0");
  require(pupil.diameter > Length{} && is_finite(pupil.diameter) &&
              pupil.image_distance > Length{} && is_finite(pupil.image_distance) &&
              is_finite(pupil.defocus),
          "needs a pupil of finite diameter > 0, screen distance > 0 and defocus");
  const double wavelengths = pupil.diameter / (2.0 * wavelength);
  require(wavelengths >= kFewestWavelengths,
          "the pupil's radius must be at least 5 wavelengths, got " + text(wavelengths) +
              ": below that the scalar theory is wrong by percents, and the screen's thickness "
              "and the light's polarisation matter");
  const WaveModelError error = wave_model_error(pupil, wavelength);
  if (pupil.has_lens) {
    const double slope = pupil.diameter / (2.0 * pupil.image_distance);
    require(slope <= kWidestLens,
            "the paraxial wave needs a working f-number of at least 1, got " + text(0.5 / slope));
  } else {
    require(error.aberration < kLargestAberration,
            "the screen is too close behind the hole for Fresnel's theory: 1.2 a^4/(lambda z^3) "
            "must be below 0.1, is " +
                text(error.aberration) + "; use the Rayleigh-Sommerfeld integral");
  }
}

}  // namespace fstop
