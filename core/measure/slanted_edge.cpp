#include "core/measure/slanted_edge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/measure/edge_line.h"
#include "core/measure/spline_fit.h"

namespace fstop {
namespace {

constexpr double kKnotSpacing = 0.25;                              // px
constexpr double kWidestGap = 0.46;                                // px
constexpr double kSmallestSlant = 2.0 * std::numbers::pi / 180.0;  // radians
constexpr double kLargestSlant = 43.0 * std::numbers::pi / 180.0;  // radians
constexpr double kSlantMargin = 0.02 * std::numbers::pi / 180.0;   // what measuring it costs
constexpr double kSmallestContrastToNoise = 5.0;
constexpr double kLineStep = 1.0 / 32.0;  // px; the profile holds nothing above 2 cycles/px

void require(bool holds, const char* message) {
  if (!holds) throw Error(ErrorCode::outside_domain, message);
}

// Pixels' distances near the edge leave no gap that the profile would have to be guessed in.
void require_even_cover(std::vector<double> distances) {
  std::erase_if(distances, [](double d) { return std::abs(d) > 2.0; });
  std::ranges::sort(distances);
  double widest = distances.empty() ? 4.0 : 0.0;
  for (std::size_t i = 1; i < distances.size(); ++i) {
    widest = std::max(widest, distances[i] - distances[i - 1]);
  }
  require(widest <= kWidestGap,
          "too little of the edge lies in the region: its pixels leave gaps of over 0.46 px");
}

// The profile's mean over the outer tenth of its reach.
double end_level(const CubicSpline& profile, double reach, double sign) {
  constexpr int kPoints = 33;
  double sum = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    sum += profile.value(sign * reach * (0.9 + 0.1 * i / (kPoints - 1)));
  }
  return sum / kPoints;
}

// Where the profile, followed from `from` in steps of `step`, first passes `level`.
double crossing_from(const CubicSpline& profile, double from, double step, double level) {
  const double side = profile.value(from) < level ? 1.0 : -1.0;
  double x = from;
  while (x + step >= profile.first() && x + step <= profile.last()) {
    if (side * (profile.value(x + step) - level) >= 0.0) {
      double inside = x;
      double outside = x + step;
      for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (inside + outside);
        (side * (profile.value(middle) - level) >= 0.0 ? outside : inside) = middle;
      }
      return 0.5 * (inside + outside);
    }
    x += step;
  }
  throw Error(ErrorCode::outside_domain,
              "the region is too small: the edge's rise does not end inside it");
}

// The line, sought with knots of 1 px and then as fine as the profile's rise demands.
EdgeLine edge_line(EdgePixels& pixels) {
  EdgeLine line = refined_edge_line(pixels, first_edge_line(pixels), 1.0);
  const double reach = edge_reach(pixels, line);
  const CubicSpline profile =
      SplineFit(-reach, reach, 1.0, edge_distances(pixels, line)).fitted(pixels.values);
  double steepest = 0.0;
  for (double x = -reach; x <= reach; x += 0.25) steepest = std::max(steepest, profile.slope(x));
  const double rise =
      std::abs(end_level(profile, reach, 1.0) - end_level(profile, reach, -1.0)) / steepest;
  return refined_edge_line(pixels, line, std::clamp(0.2 * rise, kKnotSpacing, 2.0));
}

// Full weight within 2 rises + 4 px, then a cosine to zero at twice that or at the end.
LineSpread line_spread_of(const CubicSpline& profile, double centre, double contrast, double rise,
                          double reach) {
  const double end = std::min(reach, 2.0 * (2.0 * rise + 4.0));
  const double full = std::min(0.8 * reach, 2.0 * rise + 4.0);
  const int half = static_cast<int>(std::floor(end / kLineStep));
  LineSpread line{.first = -half * kLineStep, .step = kLineStep};
  for (int k = -half; k <= half; ++k) {
    const double x = k * kLineStep;
    const double outside = std::max(0.0, (std::abs(x) - full) / (end - full));
    const double taper = 0.5 + 0.5 * std::cos(std::numbers::pi * std::min(1.0, outside));
    line.density.push_back(taper * profile.slope(centre + x) / contrast);
  }
  return line;
}

double noise_of(const EdgePixels& pixels, const SplineFit& fit, const CubicSpline& profile,
                const std::vector<double>& distances) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t k = 0; k < distances.size(); ++k) {
    if (!fit.covers(distances[k])) continue;
    const double residual = pixels.values[k] - profile.value(distances[k]);
    sum += residual * residual;
    ++count;
  }
  return std::sqrt(sum / count);
}

// Point and normal of the line in the raster, `offset` px to its bright side.
void place(SlantedEdge& edge, const EdgePixels& pixels, const EdgeLine& line, double offset,
           const PixelRegion& region) {
  const double scale = line.sign / std::sqrt(1.0 + line.slope * line.slope);
  Vec2 normal{scale, -scale * line.slope};
  Vec2 point = Vec2{line.crossing, line.along_centre} + normal * offset;
  if (pixels.transposed) {
    std::swap(normal.x, normal.y);
    std::swap(point.x, point.y);
  }
  edge.normal = normal;
  edge.point = point + Vec2{static_cast<double>(region.x), static_cast<double>(region.y)};
  edge.slant = std::atan2(std::min(std::abs(normal.x), std::abs(normal.y)),
                          std::max(std::abs(normal.x), std::abs(normal.y)));
}

}  // namespace

std::complex<double> transfer(const LineSpread& line, double frequency) noexcept {
  std::complex<double> sum = 0.0;
  for (std::size_t k = 0; k < line.density.size(); ++k) {
    const double x = line.first + line.step * static_cast<double>(k);
    sum += line.density[k] * std::polar(1.0, -2.0 * std::numbers::pi * frequency * x);
  }
  return sum * line.step;
}

double frequency_of_contrast(const LineSpread& line, double contrast) {
  require(contrast > 0.0 && contrast < 1.0, "contrast must lie between 0 and 1");
  const auto above = [&](double nu) { return std::abs(transfer(line, nu)) > contrast; };
  constexpr double kStep = 1.0 / 512.0;  // finer than a region of 256 px resolves
  double low = 0.0;
  while (above(low + kStep)) {
    low += kStep;
    if (low >= 1.0) return std::numeric_limits<double>::infinity();
  }
  double high = low + kStep;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (above(middle) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

SlantedEdge measured_slanted_edge(ImageView<const float> image, const SlantedEdgeSpec& spec) {
  EdgePixels pixels = edge_pixels(image, spec);
  const EdgeLine line = edge_line(pixels);
  SlantedEdge edge;
  place(edge, pixels, line, 0.0, spec.region);
  require(edge.slant >= kSmallestSlant - kSlantMargin && edge.slant <= kLargestSlant + kSlantMargin,
          "the edge's slant must lie between 2 and 43 degrees from the pixels' axes");
  const std::vector<double> distances = edge_distances(pixels, line);
  require(std::abs(line.slope) * pixels.along >= 1.0,
          "the edge is too short for its slant: it must cross a whole pixel");
  require_even_cover(distances);

  const double reach = edge_reach(pixels, line);
  const SplineFit fit(-reach, reach, kKnotSpacing, distances);
  const CubicSpline profile = fit.fitted(pixels.values);
  edge.noise = noise_of(pixels, fit, profile, distances);
  const EdgeLevels ends{end_level(profile, reach, -1.0), end_level(profile, reach, 1.0)};
  edge.levels = spec.levels.value_or(ends);
  const double contrast = edge.levels.bright - edge.levels.dark;
  require(contrast > 0.0, "there is no edge: both its sides are alike");
  require(ends.bright - ends.dark > kSmallestContrastToNoise * edge.noise,
          "the edge's contrast is too low: under 5 times the noise of a pixel");

  const auto level = [&](double share) { return edge.levels.dark + share * contrast; };
  const double step = profile.value(0.0) < level(0.5) ? kLineStep : -kLineStep;
  const double centre = crossing_from(profile, 0.0, step, level(0.5));
  edge.rise_10_90 = crossing_from(profile, centre, kLineStep, level(0.9)) -
                    crossing_from(profile, centre, -kLineStep, level(0.1));
  edge.reach = reach - std::abs(centre);
  require(edge.rise_10_90 < edge.reach,
          "the region is too small: it must reach farther than the edge's rise to both sides");
  place(edge, pixels, line, centre, spec.region);
  edge.line_spread = line_spread_of(profile, centre, contrast, edge.rise_10_90, edge.reach);
  for (int k = 0; k <= 100; ++k) edge.mtf.push_back(std::abs(transfer(edge.line_spread, 0.01 * k)));
  edge.mtf50 = frequency_of_contrast(edge.line_spread, 0.5);
  return edge;
}

}  // namespace fstop
