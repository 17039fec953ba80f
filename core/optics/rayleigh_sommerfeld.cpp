#include "core/optics/rayleigh_sommerfeld.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/error.h"
#include "core/optics/quadrature.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kMostWavelengths = 1e5;
constexpr int kMostNodes = 1 << 22;
constexpr double kAgreement = 1e-13;

double sinc(double x) noexcept { return std::abs(x) < 1e-8 ? 1.0 : std::sin(x) / x; }

void require_hole(const RoundHole& hole, Length offset) {
  const bool finite = is_finite(hole.radius) && is_finite(hole.distance) && is_finite(offset);
  if (!(finite && hole.radius > Length{} && hole.distance > Length{} &&
        hole.wavelength > Length{} && offset >= Length{})) {
    throw Error(ErrorCode::outside_domain, "needs a > 0, z > 0, lambda > 0, rho >= 0, all finite");
  }
  if (std::max(hole.radius, offset) / hole.wavelength > kMostWavelengths ||
      hole.radius / hole.distance > 1000.0) {
    throw Error(ErrorCode::outside_domain,
                "needs a and rho of at most 100000 wavelengths and z of at least a/1000");
  }
}

// All in units of the wavelength, phases relative to k z.
class Rim {
 public:
  Rim(const RoundHole& hole, Length offset)
      : a_(hole.radius / hole.wavelength),
        z_(hole.distance / hole.wavelength),
        rho_(offset / hole.wavelength) {}

  // The band of the integrand as a periodic function of theta, and what its nearest singularity,
  // R = 0 at complex theta, adds.
  int first_node_count() const {
    const double slope = std::min({a_, rho_, a_ * rho_ / z_});
    const double band = 2.0 * kPi * slope;
    const double strip = std::sqrt(a_ * rho_) / z_;
    return static_cast<int>(1.1 * band + 12.0 * std::cbrt(band) + 40.0 * std::min(strip, 1e4)) + 64;
  }

  // (F(R) - F(z)) w exp(-ikz) at the angle theta.
  std::complex<double> value(double theta) const noexcept {
    const double half = std::sin(0.5 * theta);
    const double versine = 2.0 * half * half;  // 1 - cos(theta)
    const double square = (a_ - rho_) * (a_ - rho_) + 2.0 * a_ * rho_ * versine;
    const double R = std::sqrt(z_ * z_ + square);
    const double path = R + z_;
    const double half_phase = kPi * square / path;  // k (R - z)/2
    // F(R) - F(z) = (z/R)(exp(ik(R - z)) - 1) + (z/R - 1), both proportional to d^2 = square.
    const std::complex<double> turn(std::cos(half_phase), std::sin(half_phase));
    const std::complex<double> i(0.0, 1.0);
    const std::complex<double> per_square =
        z_ / R * (2.0 * kPi / path) * sinc(half_phase) * i * turn - 1.0 / (R * path);
    return per_square * (a_ * (a_ - rho_) + a_ * rho_ * versine);
  }

  // Trapezoidal sum over the whole turn by symmetry: nodes at theta = (j + shift) 2 pi / count.
  std::complex<double> half_sum(int count, double shift) const noexcept {
    std::complex<double> sum = 0.0;
    for (int j = 0; j < count; ++j) sum += value((j + shift) * 2.0 * kPi / count);
    return sum / static_cast<double>(count);
  }

 private:
  double a_;
  double z_;
  double rho_;
};

}  // namespace

IntensityEstimate rayleigh_sommerfeld_intensity(const RoundHole& hole, Length offset) {
  require_hole(hole, offset);
  const Rim rim(hole, offset);
  int count = rim.first_node_count();
  std::complex<double> mean = rim.half_sum(count, 0.0);
  while (count <= kMostNodes / 2) {
    // The nodes between the old ones: their mean with the old is the rule of twice the nodes.
    const std::complex<double> between = rim.half_sum(count, 0.5);
    const std::complex<double> finer = 0.5 * (mean + between);
    count *= 2;
    const double error = std::abs(std::norm(finer) - std::norm(mean));
    if (std::abs(finer - mean) <= kAgreement) return {std::norm(finer), error, count};
    mean = finer;
  }
  throw Error(ErrorCode::over_budget,
              "the Rayleigh-Sommerfeld integral needs over 4 million nodes");
}

double rayleigh_sommerfeld_on_axis(const RoundHole& hole, Length object_distance) {
  require_hole(hole, Length{});
  if (!(object_distance > Length{})) throw Error(ErrorCode::outside_domain, "needs u > 0");
  const double a = hole.radius / hole.wavelength;
  const double z = hole.distance / hole.wavelength;
  const double k = 2.0 * kPi;
  if (!is_finite(object_distance)) {
    const double R = std::sqrt(z * z + a * a);
    const double turn = k * a * a / (R + z);
    const double ratio = z / R;
    // |1 - r exp(i turn)|^2 without cancellation.
    const double sine = std::sin(0.5 * turn);
    return (1.0 - ratio) * (1.0 - ratio) + 4.0 * ratio * sine * sine;
  }
  const double u = object_distance / hole.wavelength;
  // In the variable r^2/2 the phase is nearly linear; 16 nodes for every 4 radians of it.
  const double turns = k * a * a * 0.5 * (1.0 / z + 1.0 / u);
  const int panels = static_cast<int>(turns / 4.0) + 4 + static_cast<int>(8.0 * a / std::min(z, u));
  const auto integrand = [&](double half_square) {
    const double square = 2.0 * half_square;
    const double R = std::sqrt(z * z + square);
    const double S = std::sqrt(u * u + square);
    const double phase = k * square * (1.0 / (R + z) + 1.0 / (S + u));
    const std::complex<double> wave(std::cos(phase), std::sin(phase));
    return wave * (u / S) * (z / (R * R)) * std::complex<double>(1.0 / R, -k);
  };
  std::complex<double> sum = 0.0;
  const double whole = 0.5 * a * a;
  for (int i = 0; i < panels; ++i) {
    sum += gauss16(whole * i / panels, whole * (i + 1) / panels, integrand);
  }
  return std::norm(sum);
}

}  // namespace fstop
