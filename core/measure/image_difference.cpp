#include "core/measure/image_difference.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace fstop {
namespace {

void require(bool holds, const char* message) {
  if (!holds) throw Error(ErrorCode::outside_domain, message);
}

struct Sums {
  double squares = 0.0;
  double clipped = 0.0;
  double relative = 0.0;
};

// One row's share: summed apart, so that small differences are not lost in a long sum.
Sums row_sums(ImageView<const float> image, ImageView<const float> reference, int y,
              ImageDifference& result) {
  Sums sums;
  for (int i = 0; i < image.width * image.channels; ++i) {
    const double value = image.at(0, y)[i];
    const double wanted = reference.at(0, y)[i];
    require(std::isfinite(value) && std::isfinite(wanted),
            "pictures with values that are not finite have no difference");
    const double difference = value - wanted;
    const double clipped = std::clamp(value, 0.0, 1.0) - std::clamp(wanted, 0.0, 1.0);
    sums.squares += difference * difference;
    sums.clipped += clipped * clipped;
    sums.relative += difference * difference / (wanted * wanted + 0.01);
    if (std::abs(difference) > result.largest) {
      result.largest = std::abs(difference);
      result.largest_x = i / image.channels;
      result.largest_y = y;
    }
  }
  return sums;
}

}  // namespace

ImageDifference image_difference(ImageView<const float> image, ImageView<const float> reference) {
  require(image.width == reference.width && image.height == reference.height &&
              image.channels == reference.channels,
          "pictures must have the same width, height and channels");
  require(image.width > 0 && image.height > 0 && image.channels > 0,
          "pictures must have at least one value");
  ImageDifference result;
  Sums total;
  for (int y = 0; y < image.height; ++y) {
    const Sums row = row_sums(image, reference, y, result);
    total.squares += row.squares;
    total.clipped += row.clipped;
    total.relative += row.relative;
  }
  const double count = static_cast<double>(image.width) * image.height * image.channels;
  result.rmse = std::sqrt(total.squares / count);
  result.rmse_clipped = std::sqrt(total.clipped / count);
  result.rel_mse = total.relative / count;
  result.psnr = -20.0 * std::log10(result.rmse_clipped);
  return result;
}

}  // namespace fstop
