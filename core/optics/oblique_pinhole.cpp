#include "core/optics/oblique_pinhole.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "core/error.h"
#include "core/optics/bessel.h"
#include "core/optics/quadrature.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kMostModes = 500;
constexpr int kMostPanels = 256;
constexpr double kWidestAngle = 75.0 * kPi / 180.0;

void require(bool valid, const char* message) {
  if (!valid) throw Error(ErrorCode::outside_domain, message);
}

}  // namespace

ObliquePinholePsf::ObliquePinholePsf(const CircularPupil& pinhole, Length wavelength,
                                     double field_angle, Length largest_radius) {
  require(!pinhole.has_lens, "the oblique form is that of a pinhole, without a lens");
  require_wave_model(pinhole, wavelength);
  require(std::abs(field_angle) <= kWidestAngle, "the field angle must be at most 75 degrees");
  require(largest_radius >= Length{} && is_finite(largest_radius), "needs a finite radius >= 0");
  const double c = std::cos(field_angle);
  const double U = reduced_defocus(pinhole, wavelength);
  radial_defocus_ = U * c * c * c;
  tangential_defocus_ = U * c;
  const double a = 0.5 * pinhole.diameter.si();
  const double z = pinhole.image_distance.si();
  const double k = 2.0 * kPi / wavelength.si();
  error_ = wave_model_error(pinhole, wavelength).total() +
           0.65 * k * a * (a / z) * (a / z) * std::abs(std::sin(field_angle)) * c * c / 2.0;
  tangential_scale_ = k * (a / z) * c;
  radial_scale_ = tangential_scale_ * c * c;
  density_scale_ = std::pow(k * (a / z) * c * c, 2) / (4.0 * kPi * kPi * kPi);
  incident_scale_ = std::pow(c * c * k * (a / z) * a / (2.0 * kPi), 2);

  const double mean = 0.5 * (radial_defocus_ + tangential_defocus_);
  const double difference = 0.5 * (radial_defocus_ - tangential_defocus_);
  modes_ = bessel_negligible_order(0.5 * std::abs(difference));
  require(static_cast<std::size_t>(modes_) <= kMostModes / 2,
          "the zones differ too much along and across the plane of incidence (over 160)");
  const double phase =
      0.5 * (std::abs(mean) + std::abs(difference)) + tangential_scale_ * largest_radius.si();
  require(phase <= 6.0 * kMostPanels, "the window is too wide: over 1536 radians of phase");
  const int panels = static_cast<int>(phase / 6.0) + 1;
  const auto orders = static_cast<std::size_t>(modes_);
  std::vector<double> bessel(orders);
  for (int panel = 0; panel < panels; ++panel) {
    const double half = 0.5 / panels;
    const double centre = (2 * panel + 1) * half;
    for (std::size_t i = 0; i < 2 * kGauss16Nodes.size(); ++i) {
      const double sign = i % 2 == 0 ? -1.0 : 1.0;
      const double r = centre + sign * half * kGauss16Nodes[i / 2];
      radii_.push_back(r);
      bessel_j(0.5 * difference * r * r, bessel);
      const std::complex<double> wave =
          2.0 * kPi * half * kGauss16Weights[i / 2] * r * std::polar(1.0, 0.5 * mean * r * r);
      std::complex<double> power = 1.0;  // (-i)^m
      for (std::size_t m = 0; m < orders; ++m) {
        coefficients_.push_back((m == 0 ? 1.0 : 2.0) * bessel[m] * power * wave);
        power *= std::complex<double>(0.0, -1.0);
      }
    }
  }
}

double ObliquePinholePsf::squared_amplitude(double v_radial, double v_tangential) const noexcept {
  const double v = std::hypot(v_radial, v_tangential);
  const auto modes = static_cast<std::size_t>(modes_);
  // cos(2 m psi) by Chebyshev's recurrence.
  const double cosine =
      v > 0.0 ? (v_radial - v_tangential) * (v_radial + v_tangential) / (v * v) : 1.0;
  std::array<double, kMostModes / 2> angular;
  double before = cosine;
  double now = 1.0;
  for (std::size_t m = 0; m < modes; ++m) {
    angular[m] = now;
    const double next = 2.0 * cosine * now - before;
    before = now;
    now = next;
  }
  std::array<double, kMostModes> bessel;
  double real = 0.0;
  double imaginary = 0.0;
  for (std::size_t i = 0; i < radii_.size(); ++i) {
    const double argument = v * radii_[i];
    // Orders beyond the argument's reach vanish.
    const auto reach = static_cast<std::size_t>(bessel_negligible_order(argument));
    const std::size_t useful = std::min(modes, reach / 2 + 1);
    bessel_j(argument, std::span(bessel).first(2 * useful - 1));
    const std::complex<double>* row = &coefficients_[i * modes];
    for (std::size_t m = 0; m < useful; ++m) {
      const double factor = bessel[2 * m] * angular[m];
      real += factor * row[m].real();
      imaginary += factor * row[m].imag();
    }
  }
  return real * real + imaginary * imaginary;
}

InverseArea ObliquePinholePsf::density(Length radial, Length tangential) const noexcept {
  return InverseArea::si(density_scale_ * squared_amplitude(radial.si() * radial_scale_,
                                                            tangential.si() * tangential_scale_));
}

double ObliquePinholePsf::intensity_over_incident(Length radial, Length tangential) const noexcept {
  return incident_scale_ *
         squared_amplitude(radial.si() * radial_scale_, tangential.si() * tangential_scale_);
}

}  // namespace fstop
