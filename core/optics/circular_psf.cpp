#include "core/optics/circular_psf.h"

#include <cmath>
#include <numbers>

#include "core/optics/encircled_energy.h"

namespace fstop {
namespace {

double checked_defocus(const CircularPupil& pupil, Length wavelength) {
  require_wave_model(pupil, wavelength);
  return reduced_defocus(pupil, wavelength);
}

}  // namespace

CircularPsf::CircularPsf(const CircularPupil& pupil, Length wavelength)
    : field_(checked_defocus(pupil, wavelength)), error_(wave_model_error(pupil, wavelength)) {
  const double a = 0.5 * pupil.diameter.si();
  const double z = pupil.image_distance.si();
  v_per_metre_ = 2.0 * std::numbers::pi / wavelength.si() * (a / z);
  s_per_frequency_ = wavelength.si() * (z / a);
  peak_ = v_per_metre_ * v_per_metre_ / std::numbers::pi;
  incident_ = v_per_metre_ * a * (v_per_metre_ * a);
}

Length CircularPsf::geometric_diameter() const noexcept {
  return 2.0 * radius(std::abs(field_.defocus()));
}

InverseArea CircularPsf::density(Length radius) const noexcept {
  return InverseArea::si(peak_ * field_.intensity(reduced_radius(radius)));
}

void CircularPsf::densities(std::span<const double> radii,
                            std::span<double> result) const noexcept {
  for (std::size_t i = 0; i < radii.size(); ++i) result[i] = radii[i] * v_per_metre_;
  field_.intensities(result.first(radii.size()), result);
  for (std::size_t i = 0; i < radii.size(); ++i) result[i] *= peak_;
}

double CircularPsf::intensity_over_incident(Length radius) const noexcept {
  return incident_ * field_.intensity(reduced_radius(radius));
}

double CircularPsf::encircled_energy(Length radius) const {
  return fstop::encircled_energy(field_, reduced_radius(radius));
}

Length CircularPsf::encircled_radius(double fraction) const {
  return radius(fstop::encircled_radius(field_, fraction));
}

}  // namespace fstop
