#include "core/study/pinhole_theory.h"

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/optics/spectrum.h"

namespace fstop {
namespace {

// Wavelengths 4.4 nm apart: bands of 60 nm and more are summed to rounding.
constexpr int kIntervals = 96;
constexpr double kSmallestWeight = 1e-9;

std::vector<std::pair<Length, double>> weights_of(const ChannelLight& light) {
  if (light.channel < 0 || light.channel > 2) {
    throw Error(ErrorCode::outside_domain, "a channel is 0, 1 or 2");
  }
  if (light.wavelength) return {{*light.wavelength, 1.0}};
  std::vector<std::pair<Length, double>> weights;
  for (const SpectralSample& sample : spectral_samples(SpectralBands::sensor, kIntervals)) {
    const double weight = sample.weight[static_cast<std::size_t>(light.channel)];
    if (weight > kSmallestWeight) weights.emplace_back(sample.wavelength, weight);
  }
  return weights;
}

double sinc(double x) noexcept {
  return x == 0.0 ? 1.0 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
}

}  // namespace

ChannelOtf::ChannelOtf(const CircularPupil& pupil, const ChannelLight& light, Length pixel_pitch,
                       Vec2 field)
    : pixel_pitch_(pixel_pitch.si()), finest_change_(0.0) {
  const double tangent = std::hypot(field.x, field.y);
  if (!(pixel_pitch_ >= 0.0))
    throw Error(ErrorCode::outside_domain, "a pixel pitch is not negative");
  if (tangent > 0.0) {
    if (pupil.has_lens) throw Error(ErrorCode::outside_domain, "off axis only pinholes are known");
    radial_ = field * (1.0 / tangent);
    cosine_ = 1.0 / std::sqrt(1.0 + tangent * tangent);
  }
  const double radius = 0.5 * pupil.diameter.si();
  const double cubed = cosine_ * cosine_ * cosine_;
  double widest = pixel_pitch_;
  for (const auto& [wavelength, weight] : weights_of(light)) {
    require_wave_model(pupil, wavelength);
    const double defocus = reduced_defocus(pupil, wavelength);
    const double s_per_frequency = wavelength.si() * pupil.image_distance.si() / radius;
    lines_.push_back({AstigmaticOtf(defocus * cubed, defocus * cosine_), s_per_frequency, weight});
    // The point spread's width: the geometric disc's and the Airy disc's.
    const double disc =
        std::abs(pupil.defocus.si()) * pupil.diameter.si() * pupil.image_distance.si();
    widest = std::max(widest, (disc + 1.22 * s_per_frequency) / cubed);
  }
  finest_change_ = 0.02 / widest;
}

double ChannelOtf::operator()(Vec2 frequency) const noexcept {
  const double cubed = cosine_ * cosine_ * cosine_;
  const double radial = (frequency.x * radial_.x + frequency.y * radial_.y) / cubed;
  const double across = (frequency.y * radial_.x - frequency.x * radial_.y) / cosine_;
  double sum = 0.0;
  for (const Line& line : lines_) {
    sum += line.weight * line.otf(Vec2{radial, across} * line.s_per_frequency);
  }
  return sum * sinc(frequency.x * pixel_pitch_) * sinc(frequency.y * pixel_pitch_);
}

Vergence ChannelOtf::first_frequency(const std::function<double(double)>& otf,
                                     double contrast) const {
  if (!(contrast > 0.0 && contrast < 1.0)) {
    throw Error(ErrorCode::outside_domain, "contrast must lie between 0 and 1");
  }
  double high = finest_change_;
  while (otf(high) > contrast) high += finest_change_;
  double low = high - finest_change_;
  for (int i = 0; i < 30; ++i) {
    const double middle = 0.5 * (low + high);
    (otf(middle) > contrast ? low : high) = middle;
  }
  return Vergence::si(0.5 * (low + high));
}

Vergence ChannelOtf::frequency_of_contrast(double contrast, Vec2 direction) const {
  return first_frequency([&](double nu) { return (*this)(direction * nu); }, contrast);
}

Vergence ChannelOtf::mean_frequency_of_contrast(double contrast) const {
  // Opposite directions are alike, and what is left varies as cosines of 2 and 4 times the angle.
  constexpr int kDirections = 8;
  const auto mean = [&](double nu) {
    double sum = 0.0;
    for (int i = 0; i < kDirections; ++i) {
      const double angle = std::numbers::pi * i / kDirections;
      sum += (*this)(Vec2{std::cos(angle), std::sin(angle)} * nu);
    }
    return sum / kDirections;
  };
  return first_frequency(mean, contrast);
}

}  // namespace fstop
