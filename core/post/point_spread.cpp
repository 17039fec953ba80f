#include "core/post/point_spread.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <variant>

#include "core/error.h"
#include "core/optics/astigmatic_otf.h"
#include "core/optics/circular_psf.h"
#include "core/optics/oblique_pinhole.h"
#include "core/optics/pinhole.h"
#include "core/optics/polygon_otf.h"
#include "core/optics/polygon_psf.h"
#include "core/optics/transfer.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
// Where the wavelengths' number is tried: this many radii over the disc and some rings.
constexpr int kProbes = 192;
constexpr double kProbedRings = 3.0;  // Airy radii beyond the geometric rim

class RoundKernel {
 public:
  RoundKernel(const CircularPupil& pupil, Length wavelength)
      : psf_(pupil, wavelength), otf_(psf_.defocus()) {}

  double density(Vec2 p) const noexcept {
    return psf_.density(Length::si(std::hypot(p.x, p.y))).si();
  }
  void densities(std::span<const double> radii, std::span<double> result) const noexcept {
    psf_.densities(radii, result);
  }
  std::complex<double> otf(Vec2 frequency) const noexcept {
    return otf_(psf_.reduced_frequency(Vergence::si(std::hypot(frequency.x, frequency.y))));
  }
  double cut_off() const noexcept { return 2.0 / psf_.reduced_frequency(Vergence::si(1.0)); }
  double error() const noexcept { return psf_.error().total(); }
  // Eight lanes of the series, whose length grows as |U|/2.
  double density_cost(double) const noexcept { return 4.0 + std::abs(psf_.defocus()) / 16.0; }
  double otf_cost() const noexcept { return otf_.node_count(); }

 private:
  CircularPsf psf_;
  DefocusOtf otf_;
};

// The pupil's axes are the upright image's, the sensor's own are turned by half a turn.
class PolygonKernel {
 public:
  PolygonKernel(const CircularPupil& pupil, const Aperture& aperture, Length wavelength)
      : round_(pupil, wavelength),
        pupil_(aperture),
        otf_(aperture, round_.defocus()),
        blades_(aperture.blades),
        circumradius_(aperture_circumradius(aperture)),
        q_per_metre_(round_.reduced_radius(Length::si(1.0))),
        scale_(pupil_.energy_scale() * q_per_metre_ * q_per_metre_) {}

  double density(Vec2 p) const noexcept {
    return scale_ * pupil_.intensity(p * -q_per_metre_, round_.defocus());
  }
  void densities(std::span<const double> radii, std::span<double> result) const noexcept {
    for (std::size_t i = 0; i < radii.size(); ++i) result[i] = density({radii[i], 0.0});
  }
  std::complex<double> otf(Vec2 frequency) const noexcept {
    return otf_(frequency * -round_.reduced_frequency(Vergence::si(1.0)));
  }
  double cut_off() const noexcept {
    return 2.0 * circumradius_ / round_.reduced_frequency(Vergence::si(1.0));
  }
  double error() const noexcept { return round_.error().total(); }
  double density_cost(double radius) const noexcept {
    return 10.0 * blades_ + 4.0 * pupil_.node_count({radius * q_per_metre_, 0.0}, round_.defocus());
  }
  // Two sines an edge, about as much again for the overlap.
  double otf_cost() const noexcept { return 10.0 + 4.0 * blades_; }

 private:
  CircularPsf round_;
  PolygonPupil pupil_;
  PolygonOtf otf_;
  int blades_;
  double circumradius_;
  double q_per_metre_;
  double scale_;  // 1/m^2
};

class ObliqueKernel {
 public:
  ObliqueKernel(const PointSpreadSpec& spec, Length wavelength, Length largest_radius)
      : psf_(spec.pupil, wavelength, spec.field_angle, largest_radius),
        otf_(psf_.radial_defocus(), psf_.tangential_defocus()) {
    const double c = std::cos(spec.field_angle);
    const double a = 0.5 * spec.pupil.diameter.si();
    tangential_scale_ = wavelength.si() * spec.pupil.image_distance.si() / (a * c);
    radial_scale_ = tangential_scale_ / (c * c);
  }

  double density(Vec2 p) const noexcept {
    return psf_.density(Length::si(p.x), Length::si(p.y)).si();
  }
  void densities(std::span<const double> radii, std::span<double> result) const noexcept {
    for (std::size_t i = 0; i < radii.size(); ++i) result[i] = density({radii[i], 0.0});
  }
  std::complex<double> otf(Vec2 frequency) const noexcept {
    return otf_({frequency.x * radial_scale_, frequency.y * tangential_scale_});
  }
  double cut_off() const noexcept { return 2.0 / tangential_scale_; }
  double error() const noexcept { return psf_.error(); }
  // Bessel functions of some tens of orders at every node.
  double density_cost(double) const noexcept { return 10.0 * psf_.node_count(); }
  double otf_cost() const noexcept { return 2.0 * otf_.node_count(); }

 private:
  ObliquePinholePsf psf_;
  AstigmaticOtf otf_;
  double radial_scale_ = 0.0;  // s per cycle/m
  double tangential_scale_ = 0.0;
};

using Kernel = std::variant<RoundKernel, PolygonKernel, ObliqueKernel>;

Kernel kernel_of(const PointSpreadSpec& spec, Length wavelength, Length largest_radius) {
  if (spec.aperture.blades != 0) return PolygonKernel(spec.pupil, spec.aperture, wavelength);
  if (!spec.pupil.has_lens && spec.field_angle != 0.0) {
    return ObliqueKernel(spec, wavelength, largest_radius);
  }
  return RoundKernel(spec.pupil, wavelength);
}

}  // namespace

struct PointSpreadComponent {
  Channels weight = {};
  Kernel kernel;
};

Length airy_radius(const PointSpreadSpec& spec) {
  return 0.5 * airy_diameter(spec.wavelength, spec.pupil.image_distance / spec.pupil.diameter);
}

Length geometric_radius(const PointSpreadSpec& spec) noexcept {
  return spec.pupil.diameter * (0.5 * spec.pupil.image_distance * abs(spec.pupil.defocus));
}

PointSpread::PointSpread(const PointSpreadSpec& spec, Length largest_radius,
                         double spectral_tolerance)
    : spec_(spec) {
  if (!std::isfinite(spec.field_angle)) {
    throw Error(ErrorCode::outside_domain, "needs a finite field angle");
  }
  if (spec.aperture.blades != 0 && !spec.pupil.has_lens) {
    throw Error(ErrorCode::outside_domain, "a pinhole is round: it has no blades");
  }
  for (const SpectralSample& sample : light(spectral_tolerance)) {
    components_.push_back({sample.weight, kernel_of(spec, sample.wavelength, largest_radius)});
    std::visit(
        [this](const auto& kernel) {
          cut_off_ = std::max(cut_off_, kernel.cut_off());
          model_error_ = std::max(model_error_, kernel.error());
        },
        components_.back().kernel);
  }
  round_ = std::holds_alternative<RoundKernel>(components_.front().kernel);
}

PointSpread::~PointSpread() = default;
PointSpread::PointSpread(PointSpread&&) noexcept = default;
PointSpread& PointSpread::operator=(PointSpread&&) noexcept = default;

std::vector<SpectralSample> PointSpread::light(double spectral_tolerance) {
  if (!spec_.rgb) return {{.wavelength = spec_.wavelength, .weight = {1.0, 0.0, 0.0}}};
  const double reach = (geometric_radius(spec_) + kProbedRings * airy_radius(spec_)).si();
  std::vector<double> radii;
  for (int i = 0; i < kProbes; ++i) radii.push_back(reach * i / (kProbes - 1));
  const PolychromaticProfile profile =
      polychromatic_profile(spec_.pupil, SpectralBands::sensor, radii, spectral_tolerance);
  spectral_error_ = profile.spectral_error;
  return spectral_samples(SpectralBands::sensor, profile.wavelengths - 1);
}

int PointSpread::wavelengths() const noexcept { return static_cast<int>(components_.size()); }

bool PointSpread::has_phase() const noexcept {
  return spec_.aperture.blades % 2 == 1 && spec_.pupil.defocus != Vergence{};
}

Channels PointSpread::density(Vec2 point) const noexcept {
  Channels sum = {};
  for (const PointSpreadComponent& component : components_) {
    const double value =
        std::visit([point](const auto& kernel) { return kernel.density(point); }, component.kernel);
    for (std::size_t c = 0; c < 3; ++c) sum[c] += component.weight[c] * value;
  }
  return sum;
}

void PointSpread::densities(std::span<const double> radii, std::span<Channels> result) const {
  std::vector<double> single(radii.size());
  std::ranges::fill(result, Channels{});
  for (const PointSpreadComponent& component : components_) {
    std::visit([&](const auto& kernel) { kernel.densities(radii, single); }, component.kernel);
    for (std::size_t i = 0; i < radii.size(); ++i) {
      for (std::size_t c = 0; c < 3; ++c) result[i][c] += component.weight[c] * single[i];
    }
  }
}

std::array<std::complex<double>, 3> PointSpread::otf(Vec2 frequency) const noexcept {
  std::array<std::complex<double>, 3> sum = {};
  for (const PointSpreadComponent& component : components_) {
    const std::complex<double> value = std::visit(
        [frequency](const auto& kernel) { return kernel.otf(frequency); }, component.kernel);
    for (std::size_t c = 0; c < 3; ++c) sum[c] += component.weight[c] * value;
  }
  return sum;
}

double PointSpread::fresnel_number() const noexcept {
  const double radius = 0.5 * spec_.pupil.diameter.si();
  return std::abs(radius / spec_.wavelength.si() * radius * spec_.pupil.defocus.si());
}

DiffractionRegime PointSpread::regime() const noexcept {
  return diffraction_regime(2.0 * kPi * fresnel_number());
}

double PointSpread::density_cost(double radius) const noexcept {
  double cost = 0.0;
  for (const PointSpreadComponent& component : components_) {
    cost += std::visit([radius](const auto& kernel) { return kernel.density_cost(radius); },
                       component.kernel);
  }
  return cost;
}

double PointSpread::otf_cost() const noexcept {
  double cost = 0.0;
  for (const PointSpreadComponent& component : components_) {
    cost += std::visit([](const auto& kernel) { return kernel.otf_cost(); }, component.kernel);
  }
  return cost;
}

}  // namespace fstop
