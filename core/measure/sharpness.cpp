#include "core/measure/sharpness.h"

#include <cmath>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace fstop {
namespace {

void require(bool holds, const char* message) {
  if (!holds) throw Error(ErrorCode::outside_domain, message);
}

cv::Mat channel_of(ImageView<const float> image, int channel, const PixelRegion& region) {
  require(channel >= 0 && channel < image.channels, "the image has no such channel");
  require(region.x >= 0 && region.y >= 0 && region.width >= 3 && region.height >= 3 &&
              region.width <= image.width - region.x && region.height <= image.height - region.y,
          "the region must lie inside the image and be at least 3 px wide and high");
  cv::Mat values(region.height, region.width, CV_64F);
  for (int y = 0; y < region.height; ++y) {
    for (int x = 0; x < region.width; ++x) {
      const float value = image.at(region.x + x, region.y + y)[channel];
      require(std::isfinite(value), "the region has values that are not finite");
      values.at<double>(y, x) = value;
    }
  }
  return values;
}

// Without the rim, where filters would have made up neighbours.
cv::Mat inside(const cv::Mat& filtered) {
  return filtered(cv::Rect(1, 1, filtered.cols - 2, filtered.rows - 2));
}

double mean_square(const cv::Mat& values) {
  return values.dot(values) / static_cast<double>(values.total());
}

double variance_of_laplacian(const cv::Mat& values) {
  cv::Mat laplacian;
  cv::Laplacian(values, laplacian, CV_64F, 1);
  const cv::Mat used = inside(laplacian);
  const double mean = cv::mean(used)[0];
  return std::max(0.0, mean_square(used) - mean * mean);
}

double tenengrad(const cv::Mat& values) {
  cv::Mat across, down;
  constexpr double kPerPixel = 1.0 / 8.0;  // the kernel's weights times their distances add up to 8
  cv::Sobel(values, across, CV_64F, 1, 0, 3, kPerPixel);
  cv::Sobel(values, down, CV_64F, 0, 1, 3, kPerPixel);
  return mean_square(inside(across)) + mean_square(inside(down));
}

double brenner(const cv::Mat& values) {
  const cv::Mat right = values(cv::Rect(2, 0, values.cols - 2, values.rows));
  const cv::Mat left = values(cv::Rect(0, 0, values.cols - 2, values.rows));
  const cv::Mat difference = right - left;
  return 0.25 * mean_square(difference);
}

}  // namespace

double sharpness(SharpnessScore score, ImageView<const float> image, int channel,
                 const PixelRegion& region) {
  const cv::Mat values = channel_of(image, channel, region);
  switch (score) {
    case SharpnessScore::variance_of_laplacian:
      return variance_of_laplacian(values);
    case SharpnessScore::tenengrad:
      return tenengrad(values);
    case SharpnessScore::brenner:
      return brenner(values);
  }
  throw Error(ErrorCode::internal, "an unknown sharpness score");
}

}  // namespace fstop
