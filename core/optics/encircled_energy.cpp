#include "core/optics/encircled_energy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/optics/quadrature.h"

namespace fstop {
namespace {

constexpr double kPanel = 2.0 * std::numbers::pi;
constexpr double kLargestFraction = 0.99999;

// 2 integral of |G|^2 w dw over one panel, the 16 nodes in rising order for the eight lanes.
double panel_energy(const DefocusField& field, double from, double to) noexcept {
  constexpr std::size_t kHalf = kGauss16Nodes.size();
  const double centre = 0.5 * (from + to);
  const double half = 0.5 * (to - from);
  std::array<double, 2 * kHalf> v{};
  std::array<double, 2 * kHalf> intensity{};
  for (std::size_t i = 0; i < kHalf; ++i) {
    v[kHalf - 1 - i] = centre - half * kGauss16Nodes[i];
    v[kHalf + i] = centre + half * kGauss16Nodes[i];
  }
  field.intensities(v, intensity);
  double sum = 0.0;
  for (std::size_t i = 0; i < kHalf; ++i) {
    const std::size_t low = kHalf - 1 - i;
    const std::size_t high = kHalf + i;
    sum += kGauss16Weights[i] * (intensity[low] * v[low] + intensity[high] * v[high]);
  }
  return 2.0 * sum * half;
}

}  // namespace

double encircled_energy(const DefocusField& field, double v) {
  if (!(v >= 0.0) || !std::isfinite(v)) {
    throw Error(ErrorCode::outside_domain, "an encircled energy needs a finite radius >= 0");
  }
  if (v > 1e5 + 20.0 * std::abs(field.defocus())) return 1.0 - 2.0 / (std::numbers::pi * v);
  double energy = 0.0;
  double from = 0.0;
  for (; from + kPanel < v; from += kPanel) energy += panel_energy(field, from, from + kPanel);
  return energy + panel_energy(field, from, v);
}

double encircled_radius(const DefocusField& field, double fraction) {
  if (!(fraction > 0.0 && fraction <= kLargestFraction)) {
    throw Error(ErrorCode::outside_domain,
                "the encircled fraction must be above 0 and at most 0.99999: the light outside a "
                "radius falls only as its inverse");
  }
  double energy = 0.0;
  double from = 0.0;
  double panel = panel_energy(field, 0.0, kPanel);
  while (energy + panel < fraction) {
    energy += panel;
    from += kPanel;
    panel = panel_energy(field, from, from + kPanel);
  }
  // Newton with the slope 2 |G|^2 v, kept inside the panel, where E only rises.
  double low = from;
  double high = from + kPanel;
  double v = from + kPanel * (fraction - energy) / panel;
  for (int step = 0; step < 100; ++step) {
    const double excess = energy + panel_energy(field, from, v) - fraction;
    (excess < 0.0 ? low : high) = v;
    const double slope = 2.0 * field.intensity(v) * v;
    const double newton = v - excess / slope;
    const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (std::abs(next - v) <= 1e-15 * v) return next;
    v = next;
  }
  return v;
}

double half_maximum_radius(const DefocusField& field) {
  const double half = 0.5 * field.intensity(0.0);
  // Steps well below the finest fringe, pi wide; the geometric rim bounds the search.
  constexpr double kStep = 0.05;
  const double limit = std::abs(field.defocus()) + 40.0;
  double below = 0.0;
  double v = 0.0;
  double brightest = 0.0;
  for (int i = 1; v < limit; ++i) {
    v = kStep * i;
    const double intensity = field.intensity(v);
    brightest = std::max(brightest, intensity);
    if (below == 0.0 && intensity < half) below = v;
  }
  if (below == 0.0 || brightest > 2.0 * half * (1.0 + 1e-9)) {
    throw Error(ErrorCode::outside_domain,
                "no width at half maximum: a ring outshines the axis at this defocus");
  }
  double low = below - kStep;
  double high = below;
  while (high - low > 1e-15 * high) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) break;
    (field.intensity(middle) < half ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace fstop
