#include "core/optics/polygon_psf.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/optics/quadrature.h"

namespace fstop {
namespace {

// Below this the defocus turns no phase by a rounding.
constexpr double kInFocus = 1e-100;
// A kernel serves any argument at a bounded cost: 120000 radians along an edge.
constexpr double kMostPanels = 2e4;

double dot(Vec2 a, Vec2 b) noexcept { return a.x * b.x + a.y * b.y; }

double sinc(double x) noexcept { return std::abs(x) < 1e-8 ? 1.0 : std::sin(x) / x; }

// sin(x)/x - 1 without cancellation.
double sinc_minus_one(double x) noexcept {
  if (std::abs(x) > 1.0) return std::sin(x) / x - 1.0;
  const double y = x * x;
  double term = 1.0;
  double sum = 0.0;
  for (int k = 1; k <= 9; ++k) {
    term *= -y / ((2.0 * k) * (2.0 * k + 1.0));
    sum += term;
  }
  return sum;
}

}  // namespace

PolygonPupil::PolygonPupil(int blades, double rotation, double circumradius)
    : circumradius_(circumradius) {
  if (blades < 3 || blades > 10000 || !(circumradius > 0.0) || !std::isfinite(circumradius) ||
      !std::isfinite(rotation)) {
    throw Error(ErrorCode::outside_domain,
                "a polygon pupil needs 3 to 10000 blades, a finite rotation and circumradius > 0");
  }
  const double half = std::numbers::pi / blades;
  const double apothem = circumradius * std::cos(half);
  edge_length_ = 2.0 * circumradius * std::sin(half);
  area_ = 0.5 * blades * apothem * edge_length_;
  for (int i = 0; i < blades; ++i) {
    const double angle = rotation + (2 * i + 1) * half;
    const Vec2 normal{std::cos(angle), std::sin(angle)};
    edges_.push_back({normal * apothem, {-normal.y, normal.x}, normal});
  }
}

PolygonPupil::PolygonPupil(const Aperture& aperture)
    : PolygonPupil(aperture.blades, aperture.rotation,
                   aperture.blades == 0 ? 1.0 : aperture_circumradius(aperture)) {}

// i/q^2 sum over edges of (q.n) L (exp(-i q.m) sinc(q.t L/2) - 1); the -1 adds up to nothing round
// the polygon and keeps every digit for small q.
std::complex<double> PolygonPupil::focused(Vec2 q) const noexcept {
  const double magnitude = std::hypot(q.x, q.y);
  if (magnitude < 1e-100) return 1.0;
  const Vec2 direction{q.x / magnitude, q.y / magnitude};
  double real = 0.0;
  double imaginary = 0.0;
  for (const Edge& edge : edges_) {
    const double across = dot(direction, edge.normal);
    const double phase = dot(q, edge.middle);
    const double half_turn = 0.5 * dot(q, edge.along) * edge_length_;
    const double envelope = sinc(half_turn);
    const double sine = std::sin(0.5 * phase);
    real += across * (sinc_minus_one(half_turn) - 2.0 * sine * sine * envelope);
    imaginary -= across * std::sin(phase) * envelope;
  }
  const double scale = edge_length_ / (magnitude * area_);
  return {-imaginary * scale, real * scale};
}

int PolygonPupil::panels(const Edge& edge, Vec2 q, double defocus) const noexcept {
  const double steepest = std::abs(dot(q, edge.along)) + std::abs(defocus) * 0.5 * edge_length_;
  return 3 + static_cast<int>(std::min(steepest * edge_length_ / 6.0, kMostPanels));
}

int PolygonPupil::node_count(Vec2 q, double defocus) const noexcept {
  int count = 0;
  if (std::abs(defocus) < kInFocus) return count;
  for (const Edge& edge : edges_) count += 16 * panels(edge, q, defocus);
  return count;
}

std::complex<double> PolygonPupil::field(Vec2 q, double defocus) const noexcept {
  if (std::abs(defocus) < kInFocus) return focused(q);
  const double square = dot(q, q);
  const double reach = 2.0 * circumradius_ * std::abs(defocus);
  const bool stationary_near = square <= reach * reach;
  const double at_rest = stationary_near ? -square / (2.0 * defocus) : 0.0;
  std::complex<double> sum = 0.0;
  for (const Edge& edge : edges_) {
    // Along the edge g.n is constant and g.t linear.
    const double across = defocus * dot(edge.middle, edge.normal) - dot(q, edge.normal);
    const double start = -dot(q, edge.along);
    const double rest_phase = 0.5 * defocus * dot(edge.middle, edge.middle) - dot(q, edge.middle);
    const auto integrand = [&](double l) -> std::complex<double> {
      const double slope = start + defocus * l;
      const double g2 = across * across + slope * slope;
      const double half = stationary_near ? g2 / (4.0 * defocus)
                                          : 0.5 * (rest_phase + l * (start + 0.5 * defocus * l));
      const double sine = std::sin(half);
      const double factor = stationary_near
                                ? (std::abs(half) < 1e-8 ? 1.0 : sine / half) / (2.0 * defocus)
                                : 2.0 * sine / g2;
      return {factor * std::cos(at_rest + half), factor * std::sin(at_rest + half)};
    };
    const int count = panels(edge, q, defocus);
    const double width = edge_length_ / count;
    std::complex<double> along = 0.0;
    for (int i = 0; i < count; ++i) {
      const double from = i * width - 0.5 * edge_length_;
      along += gauss16(from, from + width, integrand);
    }
    sum += across * along;
  }
  return sum / area_;
}

double PolygonPupil::intensity(Vec2 q, double defocus) const noexcept {
  return std::norm(field(q, defocus));
}

double PolygonPupil::energy_scale() const noexcept {
  return area_ / (4.0 * std::numbers::pi * std::numbers::pi);
}

}  // namespace fstop
