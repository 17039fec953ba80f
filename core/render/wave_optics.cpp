#include "core/render/wave_optics.h"

#include <cmath>
#include <numbers>

#include "core/error.h"

namespace fstop {
namespace {

// Of all bands the shortest mean: defocus is largest there.
constexpr double kReferenceWavelength = 465e-9;

}  // namespace

WaveOptics::WaveOptics(const Shot& shot)
    : light_{.monochromatic = shot.camera.monochromatic, .wavelength = shot.camera.wavelength},
      aperture_(aperture_of(shot.camera)),
      is_pinhole_(std::holds_alternative<PinholeSpec>(shot.camera.optics)),
      depth_matters_(shot.effects.defocus != EffectChoice::off),
      diameter_(pupil_diameter(shot.camera).si()),
      image_distance_(sensor_distance(shot.camera).si()),
      pixel_pitch_(shot.sensor.pixel_pitch.si()),
      scale_(1.0),
      reference_wavelength_(light_.monochromatic ? light_.wavelength.si() : kReferenceWavelength) {
  double focus_vergence = -1.0 / image_distance_;  // of a pinhole: no lens
  if (const auto* lens = std::get_if<LensSpec>(&shot.camera.optics)) {
    focus_vergence = 1.0 / lens->focus_distance.si();
    const double picture_distance = image_distance_;
    image_distance_ = fstop::image_distance(lens->lens.focal_length, lens->focus_distance).si();
    scale_ = picture_distance / image_distance_;
  }
  const double radius = 0.5 * diameter_;
  defocus_per_vergence_ = 2.0 * std::numbers::pi * radius * radius / reference_wavelength_;
  const double flat_vergence = is_pinhole_ ? -focus_vergence : 0.0;
  defocus_at_infinity_ = defocus_per_vergence_ * (depth_matters_ ? -focus_vergence : flat_vergence);
  px_per_defocus_ = diameter_ * image_distance_ * scale_ / (defocus_per_vergence_ * pixel_pitch_);
  q_ = shot.camera.wavelength.si() * image_distance_ / diameter_ * scale_ / pixel_pitch_;
}

CircularPupil WaveOptics::pupil(double defocus) const noexcept {
  return {.diameter = Length::si(diameter_),
          .image_distance = Length::si(image_distance_),
          .defocus = Vergence::si(defocus / defocus_per_vergence_),
          .has_lens = !is_pinhole_};
}

std::array<double, 3> WaveOptics::halo_px() const noexcept {
  // A pupil's rim sends 2/(pi v) of the light beyond v, in proportion to its length.
  const double rim = is_pinhole_ || aperture_.blades == 0
                         ? 1.0
                         : aperture_circumradius(aperture_) * aperture_.blades *
                               std::sin(std::numbers::pi / aperture_.blades) / std::numbers::pi;
  std::array<double, 3> halo = mean_wavelengths(light_);
  for (double& value : halo) {
    value *= 2.0 * rim * image_distance_ * scale_ /
             (std::numbers::pi * std::numbers::pi * diameter_ * pixel_pitch_);
  }
  return halo;
}

std::string WaveOptics::refusal() const {
  try {
    for (const SpectralSample& sample : picture_wavelengths(light_, 8)) {
      if (sample.weight[0] + sample.weight[1] + sample.weight[2] <= 1e-6) continue;
      require_wave_model(pupil(is_pinhole_ ? defocus_at_infinity_ : 0.0), sample.wavelength);
    }
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace fstop
