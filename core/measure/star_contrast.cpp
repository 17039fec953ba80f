#include "core/measure/star_contrast.h"

#include <cmath>
#include <numbers>

#include <opencv2/core.hpp>

#include "core/error.h"

namespace fstop {
namespace {

void require(bool holds, const char* message) {
  if (!holds) throw Error(ErrorCode::outside_domain, message);
}

}  // namespace

StarContrast star_contrast(ImageView<const float> image, int channel, const SinusoidalStar& star,
                           double radius) {
  require(star.cycles >= 2 && star.amplitude != 0.0 && star.mean != 0.0,
          "a star needs at least 2 cycles, an amplitude and a mean");
  require(channel >= 0 && channel < image.channels, "the image has no such channel");
  const double frequency = star.cycles / (2.0 * std::numbers::pi * radius);
  require(radius > 0.0 && frequency <= 0.5,
          "the star's ring must be so wide that its frequency is at most 0.5 cycles/px");
  const double outer = radius + 1.0;
  require(star.centre.x - outer >= 0.0 && star.centre.x + outer <= image.width &&
              star.centre.y - outer >= 0.0 && star.centre.y + outer <= image.height,
          "the star's ring must lie inside the image");
  cv::Matx33d normal = cv::Matx33d::zeros();
  cv::Vec3d product(0.0, 0.0, 0.0);
  for (int y = static_cast<int>(star.centre.y - outer); y < star.centre.y + outer; ++y) {
    for (int x = static_cast<int>(star.centre.x - outer); x < star.centre.x + outer; ++x) {
      if (x >= image.width || y >= image.height) continue;
      const double right = x + 0.5 - star.centre.x;
      const double up = star.centre.y - (y + 0.5);
      const double weight = 1.0 - std::abs(std::hypot(right, up) - radius);
      if (weight <= 0.0) continue;
      const double angle = star.cycles * std::atan2(up, right) - star.phase;
      const double value = image.at(x, y)[channel];
      require(std::isfinite(value), "the star has values that are not finite");
      const cv::Vec3d basis(1.0, std::cos(angle), std::sin(angle));
      normal += weight * (basis * basis.t());
      product += weight * value * basis;
    }
  }
  const cv::Vec3d fitted = normal.solve(product, cv::DECOMP_CHOLESKY);
  return {.frequency = frequency,
          .modulation = fitted[1] / star.amplitude,
          .quadrature = fitted[2] / star.amplitude,
          .mean = fitted[0] / star.mean};
}

}  // namespace fstop
