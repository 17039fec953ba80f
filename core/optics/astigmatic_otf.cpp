#include "core/optics/astigmatic_otf.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/optics/defocus_field.h"
#include "core/optics/quadrature.h"

namespace fstop {
namespace {

double sinc(double x) noexcept { return std::abs(x) < 1e-8 ? 1.0 : std::sin(x) / x; }

}  // namespace

AstigmaticOtf::AstigmaticOtf(double defocus_x, double defocus_y)
    : defocus_x_(defocus_x), defocus_y_(defocus_y) {
  const double largest = std::max(std::abs(defocus_x), std::abs(defocus_y));
  if (!(std::abs(defocus_x) <= kLargestDefocus && std::abs(defocus_y) <= kLargestDefocus)) {
    throw Error(ErrorCode::outside_domain,
                "the defocus |U| must be at most 10000 rad (1591 Fresnel zones or 796 waves)");
  }
  QuadratureRule rule = gauss_legendre(16 + static_cast<int>(std::ceil(0.6 * largest)));
  for (double& node : rule.nodes) node = 0.5 * (1.0 + node);
  for (double& weight : rule.weights) weight *= 0.5;
  nodes_ = std::move(rule.nodes);
  weights_ = std::move(rule.weights);
}

double AstigmaticOtf::operator()(Vec2 s) const noexcept {
  const double frequency = std::hypot(s.x, s.y);
  const double half = 0.5 * frequency;
  if (half >= 1.0) return 0.0;
  const Vec2 along = frequency > 0.0 ? Vec2{s.x / frequency, s.y / frequency} : Vec2{1.0, 0.0};
  const Vec2 gradient{defocus_x_ * s.x, defocus_y_ * s.y};
  const double phase_along = gradient.x * along.x + gradient.y * along.y;
  const double phase_across = gradient.y * along.x - gradient.x * along.y;
  const double range = std::acos(half);
  double sum = 0.0;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const double tau = range * nodes_[i];
    const double cosine = std::cos(tau);
    const double chord = cosine - half;
    sum += weights_[i] * cosine * chord * std::cos(phase_across * std::sin(tau)) *
           sinc(phase_along * chord);
  }
  return 4.0 / std::numbers::pi * range * sum;
}

}  // namespace fstop
