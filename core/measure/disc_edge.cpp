#include "core/measure/disc_edge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <opencv2/core.hpp>

#include "core/error.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSmallestRadius = 0.02;  // px: changes no pixel by more than 1e-4
constexpr double kSmallestSlantSine = 1e-4;
constexpr int kParameters = 5;  // radius^2, offset, turn, dark, bright - dark

// The integral of disc_edge from -infinity.
double first_integral(double t) noexcept {
  if (t <= -1.0) return 0.0;
  if (t >= 1.0) return t;
  const double root = std::sqrt(1.0 - t * t);
  return 0.5 * t + (t * std::asin(t) + root - root * root * root / 3.0) / kPi;
}

// The integral of first_integral from -1.
double second_integral(double t) noexcept {
  if (t <= -1.0) return 0.0;
  if (t >= 1.0) return 0.5 * t * t + 0.125;
  const double root = std::sqrt(1.0 - t * t);
  return 0.25 * t * t + 0.0625 +
         (std::asin(t) * (0.125 + 0.5 * t * t) + t * root * (13.0 / 24.0 + t * t / 12.0)) / kPi;
}

using Parameters = std::array<double, kParameters>;

// Pixel centres and values of a region, seen from a first line.
struct FittedPixels {
  std::vector<Vec2> places = {};  // from the line's point: x along the normal, y along the edge
  std::vector<double> values = {};
  double slant = 0.0;
};

FittedPixels pixels_near(ImageView<const float> image, const SlantedEdgeSpec& spec,
                         const SlantedEdge& edge) {
  FittedPixels pixels{.slant = edge.slant};
  for (int y = spec.region.y; y < spec.region.y + spec.region.height; ++y) {
    for (int x = spec.region.x; x < spec.region.x + spec.region.width; ++x) {
      const Vec2 from = Vec2{x + 0.5, y + 0.5} - edge.point;
      const Vec2 place{from.x * edge.normal.x + from.y * edge.normal.y,
                       from.y * edge.normal.x - from.x * edge.normal.y};
      if (std::abs(place.x) > edge.reach) continue;
      pixels.places.push_back(place);
      pixels.values.push_back(image.at(x, y)[spec.channel]);
    }
  }
  return pixels;
}

double shape_of(const FittedPixels& pixels, std::size_t k, const Parameters& p) noexcept {
  const double distance = pixels.places[k].x - p[1] - p[2] * pixels.places[k].y;
  return disc_pixel_edge(distance, std::sqrt(p[0]), pixels.slant);
}

// Residuals of all pixels and what each parameter changes.
double linearise(const FittedPixels& pixels, const Parameters& p, cv::Mat& jacobian,
                 cv::Mat& residuals) {
  const double radius_step = 1e-4 * std::max(p[0], 0.01);
  constexpr double kOffsetStep = 1e-4;  // px
  const auto changed = [&](std::size_t k, std::size_t which, double step) {
    Parameters q = p;
    q[which] += step;
    return shape_of(pixels, k, q);
  };
  double squares = 0.0;
  for (std::size_t k = 0; k < pixels.values.size(); ++k) {
    const int row = static_cast<int>(k);
    const double shape = shape_of(pixels, k, p);
    auto* slopes = jacobian.ptr<double>(row);
    slopes[0] = p[4] * (changed(k, 0, radius_step) - shape) / radius_step;
    slopes[1] =
        p[4] * (changed(k, 1, kOffsetStep) - changed(k, 1, -kOffsetStep)) / (2.0 * kOffsetStep);
    slopes[2] = slopes[1] * pixels.places[k].y;
    slopes[3] = 1.0;
    slopes[4] = shape;
    residuals.at<double>(row) = pixels.values[k] - p[3] - p[4] * shape;
    squares += residuals.at<double>(row) * residuals.at<double>(row);
  }
  return squares;
}

Parameters fitted_parameters(const FittedPixels& pixels, Parameters p, double& squares) {
  const int count = static_cast<int>(pixels.values.size());
  cv::Mat jacobian(count, kParameters, CV_64F), residuals(count, 1, CV_64F), step;
  constexpr double kSmallestSquare = kSmallestRadius * kSmallestRadius;
  for (int i = 0; i < 60; ++i) {
    squares = linearise(pixels, p, jacobian, residuals);
    cv::solve(jacobian, residuals, step, cv::DECOMP_NORMAL | cv::DECOMP_CHOLESKY);
    // A radius at most doubles or halves in one step; its square may not leave the domain.
    const double square =
        std::clamp(p[0] + step.at<double>(0), std::max(kSmallestSquare, p[0] / 4.0),
                   std::max(4.0 * p[0], 0.01));
    const double change = std::abs(square - p[0]);
    p[0] = square;
    for (std::size_t k = 1; k < p.size(); ++k) p[k] += step.at<double>(static_cast<int>(k));
    if (change <= 1e-7 * p[0] + 1e-12 && std::abs(step.at<double>(1)) < 1e-7) return p;
  }
  throw Error(ErrorCode::outside_domain, "no disc fits the edge: its radius does not settle");
}

}  // namespace

double disc_edge(double t) noexcept {
  if (t <= -1.0) return 0.0;
  if (t >= 1.0) return 1.0;
  return 0.5 + (t * std::sqrt(1.0 - t * t) + std::asin(t)) / kPi;
}

double disc_pixel_edge(double distance, double radius, double slant) noexcept {
  const double t = distance / radius;
  const double wide = 0.5 * std::cos(slant) / radius;
  const double narrow = 0.5 * std::sin(slant) / radius;
  // Far outside both ends: exact, and no difference of large numbers.
  if (t <= -1.0 - wide - narrow) return 0.0;
  if (t >= 1.0 + wide + narrow) return 1.0;
  if (std::sin(slant) < kSmallestSlantSine) {
    return (first_integral(t + wide) - first_integral(t - wide)) / (2.0 * wide);
  }
  return (second_integral(t + wide + narrow) - second_integral(t + wide - narrow) -
          second_integral(t - wide + narrow) + second_integral(t - wide - narrow)) /
         (4.0 * wide * narrow);
}

DiscEdge fit_disc_radius(ImageView<const float> image, const SlantedEdgeSpec& spec) {
  SlantedEdgeSpec free = spec;
  free.levels.reset();
  const SlantedEdge edge = measured_slanted_edge(image, free);
  const FittedPixels pixels = pixels_near(image, spec, edge);
  // A disc's rise is 1.3741 radii, the pixel's box adds about 0.8 px in squares.
  const double disc_rise = std::sqrt(std::max(edge.rise_10_90 * edge.rise_10_90 - 0.64, 0.01));
  const double first_radius = disc_rise / 1.3741;
  double squares = 0.0;
  const Parameters p = fitted_parameters(pixels,
                                         {first_radius * first_radius, 0.0, 0.0, edge.levels.dark,
                                          edge.levels.bright - edge.levels.dark},
                                         squares);
  const double turn = std::atan(p[2]);
  const Vec2 normal =
      edge.normal * std::cos(turn) - Vec2{-edge.normal.y, edge.normal.x} * std::sin(turn);
  return {.radius = std::sqrt(p[0]),
          .levels = {p[3], p[3] + p[4]},
          .point = edge.point + edge.normal * p[1],
          .normal = normal,
          .residual = std::sqrt(squares / static_cast<double>(pixels.values.size()))};
}

}  // namespace fstop
