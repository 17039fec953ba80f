#include "core/measure/edge_line.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/measure/spline_fit.h"

namespace fstop {
namespace {

constexpr int kSmallestSide = 16;

void require(bool holds, const char* message) {
  if (!holds) throw Error(ErrorCode::outside_domain, message);
}

EdgePixels transposed(const EdgePixels& pixels) {
  EdgePixels turned{
      .across = pixels.along, .along = pixels.across, .transposed = !pixels.transposed};
  turned.values.reserve(pixels.values.size());
  for (int j = 0; j < turned.along; ++j) {
    for (int i = 0; i < turned.across; ++i) turned.values.push_back(pixels.at(j, i));
  }
  return turned;
}

// The step of one row: between pixels, with the squares that it explains.
struct RowStep {
  double crossing = 0.0;
  double explained = 0.0;
  double rise = 0.0;  // right minus left mean
};

RowStep step_of(const EdgePixels& pixels, int row) {
  double total = 0.0;
  for (int i = 0; i < pixels.across; ++i) total += pixels.at(i, row);
  const double mean = total / pixels.across;
  RowStep best;
  double left = 0.0;
  for (int i = 1; i < pixels.across; ++i) {
    left += pixels.at(i - 1, row) - mean;
    const double rise = -left / (pixels.across - i) - left / i;
    const double explained = std::abs(left * rise);
    if (explained > best.explained) best = {static_cast<double>(i), explained, rise};
  }
  return best;
}

struct LineGuess {
  EdgeLine line = {};
  double explained = 0.0;
};

// Weighted least squares through the rows' steps.
LineGuess guessed_line(const EdgePixels& pixels) {
  double weight = 0.0, mean_along = 0.0, mean_across = 0.0, rises = 0.0;
  std::vector<RowStep> steps;
  for (int j = 0; j < pixels.along; ++j) {
    const RowStep step = step_of(pixels, j);
    steps.push_back(step);
    weight += step.explained;
    mean_along += step.explained * (j + 0.5);
    mean_across += step.explained * step.crossing;
    rises += step.explained * (step.rise > 0.0 ? 1.0 : -1.0);
  }
  if (weight <= 0.0) return {};
  mean_along /= weight;
  mean_across /= weight;
  double square = 0.0, product = 0.0;
  for (int j = 0; j < pixels.along; ++j) {
    const RowStep& step = steps[static_cast<std::size_t>(j)];
    const double along = j + 0.5 - mean_along;
    square += step.explained * along * along;
    product += step.explained * along * (step.crossing - mean_across);
  }
  LineGuess guess{.explained = weight};
  guess.line.along_centre = 0.5 * pixels.along;
  guess.line.slope = square > 0.0 ? product / square : 0.0;
  guess.line.crossing = mean_across + guess.line.slope * (guess.line.along_centre - mean_along);
  guess.line.sign = rises > 0.0 ? 1.0 : -1.0;
  return guess;
}

double sum_of_squares(const std::vector<double>& values) {
  double mean = 0.0, sum = 0.0;
  for (const double value : values) mean += value;
  mean /= static_cast<double>(values.size());
  for (const double value : values) sum += (value - mean) * (value - mean);
  return sum;
}

// One step of Gauss-Newton for the slope: the residual of the profile, divided by what turning the
// line would change once the profile has followed as well as it can.
double slope_step(const EdgePixels& pixels, const EdgeLine& line, const SplineFit& fit,
                  const std::vector<double>& distances) {
  const CubicSpline profile = fit.fitted(pixels.values);
  const double cosine = 1.0 / std::sqrt(1.0 + line.slope * line.slope);
  std::vector<double> turning(distances.size());
  for (std::size_t k = 0; k < distances.size(); ++k) {
    const double along = static_cast<double>(k / static_cast<std::size_t>(pixels.across)) + 0.5;
    turning[k] = -profile.slope(distances[k]) * (along - line.along_centre) * cosine * line.sign;
  }
  const CubicSpline followed = fit.fitted(turning);
  double product = 0.0, square = 0.0;
  for (std::size_t k = 0; k < distances.size(); ++k) {
    if (!fit.covers(distances[k])) continue;
    const double change = turning[k] - followed.value(distances[k]);
    product += change * (pixels.values[k] - profile.value(distances[k]));
    square += change * change;
  }
  return square > 0.0 ? product / square : 0.0;
}

}  // namespace

double EdgeLine::distance(double across, double along) const noexcept {
  return sign * (across - crossing - slope * (along - along_centre)) /
         std::sqrt(1.0 + slope * slope);
}

EdgePixels edge_pixels(ImageView<const float> image, const SlantedEdgeSpec& spec) {
  const PixelRegion& region = spec.region;
  require(spec.channel >= 0 && spec.channel < image.channels, "the image has no such channel");
  require(region.width >= kSmallestSide && region.height >= kSmallestSide,
          "the region must be at least 16 px wide and high");
  require(region.x >= 0 && region.y >= 0 && region.width <= image.width - region.x &&
              region.height <= image.height - region.y,
          "the region must lie inside the image");
  EdgePixels pixels{.across = region.width, .along = region.height};
  for (int y = 0; y < region.height; ++y) {
    for (int x = 0; x < region.width; ++x) {
      const float value = image.at(region.x + x, region.y + y)[spec.channel];
      require(std::isfinite(value), "the region has values that are not finite");
      pixels.values.push_back(value);
    }
  }
  return pixels;
}

std::vector<double> edge_distances(const EdgePixels& pixels, const EdgeLine& line) {
  std::vector<double> distances;
  distances.reserve(pixels.values.size());
  for (int j = 0; j < pixels.along; ++j) {
    for (int i = 0; i < pixels.across; ++i) distances.push_back(line.distance(i + 0.5, j + 0.5));
  }
  return distances;
}

double edge_reach(const EdgePixels& pixels, const EdgeLine& line) noexcept {
  const double middle = line.crossing + line.slope * (0.5 * pixels.along - line.along_centre);
  return std::min(middle, pixels.across - middle) / std::sqrt(1.0 + line.slope * line.slope);
}

EdgeLine first_edge_line(EdgePixels& pixels) {
  const EdgePixels turned = transposed(pixels);
  LineGuess guess = guessed_line(pixels);
  if (const LineGuess other = guessed_line(turned); other.explained > guess.explained) {
    guess = other;
    pixels = turned;
  }
  require(guess.explained > 0.5 * sum_of_squares(pixels.values) && guess.explained > 0.0,
          "there is no edge in the region: steps explain less than half of its variance");
  return guess.line;
}

EdgeLine refined_edge_line(const EdgePixels& pixels, EdgeLine line, double knot_spacing) {
  // In px at the region's ends. Without noise the steps shrink squared; with it by a factor, or
  // they swing about a pixel that enters and leaves the profile: 0.003 px then blurs nothing.
  constexpr double kSettled = 1e-6;
  constexpr double kSettledInNoise = 3e-3;
  constexpr double kMostAtOnce = 1.0;  // the profile follows before the next step
  constexpr int kQuickSteps = 10;
  constexpr int kMostSteps = 30;
  const double ends = 0.5 * pixels.along;
  for (int i = 0; i < kMostSteps; ++i) {
    const double reach = edge_reach(pixels, line);
    require(reach > 4.0 && std::abs(line.slope) < 2.0,
            "the edge must pass at least 4 px inside the region");
    const std::vector<double> distances = edge_distances(pixels, line);
    const SplineFit fit(-reach, reach, knot_spacing, distances);
    const double step = ends * slope_step(pixels, line, fit, distances);
    line.slope += std::clamp(step, -kMostAtOnce, kMostAtOnce) / ends;
    if (std::abs(step) < (i < kQuickSteps ? kSettled : kSettledInNoise)) return line;
  }
  throw Error(ErrorCode::outside_domain, "there is no straight edge: its line does not settle");
}

}  // namespace fstop
