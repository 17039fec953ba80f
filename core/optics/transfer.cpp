#include "core/optics/transfer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/optics/bessel.h"
#include "core/optics/defocus_field.h"
#include "core/optics/diffraction.h"
#include "core/optics/quadrature.h"

namespace fstop {
namespace {

constexpr double kCutOff = 2.0;

}  // namespace

double diffraction_mtf(double s) noexcept {
  const double half = 0.5 * std::abs(s);
  if (half >= 1.0) return 0.0;
  // sqrt of the product keeps the digits of 1 - s/2 near the cut-off.
  return 2.0 / std::numbers::pi * (std::acos(half) - half * std::sqrt((1.0 - half) * (1.0 + half)));
}

DefocusOtf::DefocusOtf(double defocus) : defocus_(std::abs(defocus)) {
  if (!(defocus_ <= kLargestDefocus)) {
    throw Error(ErrorCode::outside_domain,
                "the defocus |U| must be at most 10000 rad (1591 Fresnel zones or 796 waves)");
  }
  QuadratureRule rule = gauss_legendre(16 + static_cast<int>(std::ceil(0.3 * defocus_)));
  for (double& node : rule.nodes) node = 0.5 * (1.0 + node);
  for (double& weight : rule.weights) weight *= 0.5;
  nodes_ = std::move(rule.nodes);
  weights_ = std::move(rule.weights);
}

double DefocusOtf::operator()(double s) const noexcept {
  const double half = 0.5 * std::abs(s);
  if (half >= 1.0) return 0.0;
  const double range = std::acos(half);
  const double phase = 2.0 * half * defocus_;
  double sum = 0.0;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const double tau = range * nodes_[i];
    const double sine = std::sin(tau);
    sum += weights_[i] * sine * sine * std::cos(phase * (std::cos(tau) - half));
  }
  return 4.0 / std::numbers::pi * range * sum;
}

void DefocusOtf::values(std::span<const double> s, std::span<double> result) const noexcept {
  for (std::size_t i = 0; i < s.size(); ++i) result[i] = (*this)(s[i]);
}

double model_otf(OtfModel model, double s, double defocus) noexcept {
  const double frequency = std::abs(s);
  switch (model) {
    case OtfModel::airy:
      return diffraction_mtf(frequency);
    case OtfModel::disc:
      return jinc(defocus * frequency);
    case OtfModel::disc_times_airy:
      return diffraction_mtf(frequency) * jinc(defocus * frequency);
    case OtfModel::stretched_disc: {
      if (frequency >= kCutOff) return 0.0;
      const double argument = defocus * frequency * (1.0 - 0.5 * frequency);
      return diffraction_mtf(frequency) * jinc(argument);
    }
  }
  return 0.0;
}

double model_otf_error(OtfModel model, double defocus) noexcept {
  const double waves = std::abs(defocus_waves(defocus));
  const double disc = waves > 0.0 ? 0.165 * std::pow(waves, -0.75) : 1.0;
  const double square = waves * waves;
  switch (model) {
    case OtfModel::airy:
      return std::min(2.23 * square, 1.14);
    case OtfModel::disc:
      return std::min(1.0, disc);
    case OtfModel::disc_times_airy:
      return std::min({6.97 * square, 0.26, disc});
    case OtfModel::stretched_disc:
      return std::min({0.0995 * square, 0.0168, waves > 0.0 ? 0.0168 / waves : 0.0168});
  }
  return 1.0;
}

}  // namespace fstop
