#include "core/measure/spot.h"

#include <cmath>
#include <numbers>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace fstop {
namespace {

constexpr int kParts = 8;                   // of a pixel's side: how its light is spread
constexpr double kBinsPerPx = 64.0;         // of the distance from the centroid
constexpr double kPixelSquare = 1.0 / 6.0;  // mean square of a pixel's square from its centre

void require(bool holds, const char* message) {
  if (!holds) throw Error(ErrorCode::outside_domain, message);
}

cv::Mat1d region_of(ImageView<const float> image, const SpotSpec& spec) {
  const PixelRegion& region = spec.region;
  require(spec.channel >= 0 && spec.channel < image.channels, "the image has no such channel");
  require(region.x >= 0 && region.y >= 0 && region.width >= 3 && region.height >= 3 &&
              region.width <= image.width - region.x && region.height <= image.height - region.y,
          "the region must lie inside the image and be at least 3 px wide and high");
  cv::Mat1d values(region.height, region.width);
  for (int y = 0; y < region.height; ++y) {
    for (int x = 0; x < region.width; ++x) {
      values(y, x) = image.at(region.x + x, region.y + y)[spec.channel];
    }
  }
  require(cv::checkRange(values), "the region has values that are not finite");
  return values;
}

double border_mean(const cv::Mat1d& values) {
  const cv::Rect inner(1, 1, values.cols - 2, values.rows - 2);
  const double border = cv::sum(values)[0] - cv::sum(values(inner))[0];
  return border / (static_cast<double>(values.total()) - inner.area());
}

// Energy by distance from the centroid, which is in px of the region.
std::vector<double> energy_by_distance(const cv::Mat1d& values, Vec2 centroid) {
  const double farthest = std::hypot(values.cols, values.rows);
  std::vector<double> bins(static_cast<std::size_t>(farthest * kBinsPerPx) + 2);
  for (int y = 0; y < values.rows; ++y) {
    for (int x = 0; x < values.cols; ++x) {
      const double part = values(y, x) / (kParts * kParts);
      if (part == 0.0) continue;
      for (int i = 0; i < kParts * kParts; ++i) {
        const double right = x + (i % kParts + 0.5) / kParts - centroid.x;
        const double down = y + (i / kParts + 0.5) / kParts - centroid.y;
        const double distance = std::min(std::hypot(right, down), farthest);
        bins[static_cast<std::size_t>(distance * kBinsPerPx)] += part;
      }
    }
  }
  return bins;
}

double encircling_diameter(const std::vector<double>& bins, double energy) {
  double inside = 0.0;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (inside + bins[i] >= energy) {
      return 2.0 * (static_cast<double>(i) + (energy - inside) / bins[i]) / kBinsPerPx;
    }
    inside += bins[i];
  }
  return 2.0 * static_cast<double>(bins.size()) / kBinsPerPx;  // rounding of the last energies
}

double diameter_of(double mean_square, int blades) {
  if (blades == 0) return std::sqrt(8.0 * mean_square);
  const double sector = 2.0 * std::numbers::pi / blades;
  const double circumradius = std::sqrt(6.0 * mean_square / (2.0 + std::cos(sector)));
  return 2.0 * circumradius * std::sqrt(std::sin(sector) / sector);
}

}  // namespace

Spot measured_spot(ImageView<const float> image, const SpotSpec& spec) {
  require(spec.blades == 0 || spec.blades >= 3, "an iris has no blades or at least 3");
  require(spec.source_diameter >= 0.0, "a source has a diameter of at least 0 px");
  for (const double fraction : spec.fractions) {
    require(fraction > 0.0 && fraction < 1.0, "a fraction of the energy lies between 0 and 1");
  }
  cv::Mat1d values = region_of(image, spec);
  Spot spot;
  spot.background = spec.background ? *spec.background : border_mean(values);
  values -= spot.background;
  const cv::Moments moments = cv::moments(values);
  spot.energy = moments.m00;
  require(spot.energy > 0.0, "the region has no light above its background");
  const Vec2 centroid = {moments.m10 / spot.energy + 0.5, moments.m01 / spot.energy + 0.5};
  require(
      centroid.x > 0.0 && centroid.x < values.cols && centroid.y > 0.0 && centroid.y < values.rows,
      "the light's centroid lies outside the region: the background is wrong");
  spot.centroid = {spec.region.x + centroid.x, spec.region.y + centroid.y};
  const double source_square = spec.source_diameter * spec.source_diameter / 8.0;
  spot.mean_square = (moments.mu20 + moments.mu02) / spot.energy - source_square - kPixelSquare;
  require(spot.mean_square >= 0.0, "the spot is narrower than its source and a pixel");
  spot.disc_diameter = diameter_of(spot.mean_square, spec.blades);
  if (spec.fractions.empty()) return spot;
  const std::vector<double> bins = energy_by_distance(values, centroid);
  for (const double fraction : spec.fractions) {
    spot.encircled_diameters.push_back(encircling_diameter(bins, fraction * spot.energy));
  }
  return spot;
}

}  // namespace fstop
