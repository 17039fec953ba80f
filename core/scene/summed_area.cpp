#include "core/scene/summed_area.h"

#include <algorithm>
#include <cmath>

#include "core/build_stop.h"

namespace fstop {

SummedArea::SummedArea(const Image& image, bool repeats)
    : width_(image.width()), height_(image.height()), repeats_(repeats) {
  const auto stride = static_cast<std::size_t>(width_ + 1);
  sums_.reserve(stride * static_cast<std::size_t>(height_ + 1));
  sums_.resize(stride);
  for (int y = 0; y < height_; ++y) {
    BuildStop::throw_if_requested();
    sums_.resize(sums_.size() + stride);
    Sum row = {};
    for (int x = 0; x < width_; ++x) {
      const std::size_t above =
          static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x) + 1;
      for (std::size_t c = 0; c < 3; ++c) {
        row[c] += double{image.at(x, y)[c]};
        sums_[above + stride][c] = sums_[above][c] + row[c];
      }
    }
  }
}

// Linear between the texels' corners, as the sum over a constant texel is; the last texel's slope
// goes on beyond the edge, where the image goes on as it ends.
SummedArea::Sum SummedArea::within(double x, double y) const noexcept {
  const int column = std::clamp(static_cast<int>(std::floor(x)), 0, width_ - 1);
  const int row = std::clamp(static_cast<int>(std::floor(y)), 0, height_ - 1);
  const double across = x - column;
  const double down = y - row;
  Sum sum = {};
  for (std::size_t c = 0; c < 3; ++c) {
    const double upper =
        at(column, row)[c] + across * (at(column + 1, row)[c] - at(column, row)[c]);
    const double lower =
        at(column, row + 1)[c] + across * (at(column + 1, row + 1)[c] - at(column, row + 1)[c]);
    sum[c] = upper + down * (lower - upper);
  }
  return sum;
}

SummedArea::Sum SummedArea::sum_to(double x, double y) const noexcept {
  if (!repeats_) return within(x, y);
  const double columns = std::floor(x / width_);
  const double rows = std::floor(y / height_);
  const double left = x - columns * width_;
  const double top = y - rows * height_;
  const Sum whole = within(width_, height_);
  const Sum full_columns = within(width_, top);
  const Sum full_rows = within(left, height_);
  Sum sum = within(left, top);
  for (std::size_t c = 0; c < 3; ++c) {
    sum[c] += columns * rows * whole[c] + columns * full_columns[c] + rows * full_rows[c];
  }
  return sum;
}

std::array<float, 3> SummedArea::mean(double x, double y, double width,
                                      double height) const noexcept {
  const double w = repeats_ ? std::min(width, double(width_)) : width;
  const double h = repeats_ ? std::min(height, double(height_)) : height;
  const Sum lower_right = sum_to(x + 0.5 * w, y + 0.5 * h);
  const Sum lower_left = sum_to(x - 0.5 * w, y + 0.5 * h);
  const Sum upper_right = sum_to(x + 0.5 * w, y - 0.5 * h);
  const Sum upper_left = sum_to(x - 0.5 * w, y - 0.5 * h);
  std::array<float, 3> mean = {};
  for (std::size_t c = 0; c < 3; ++c) {
    mean[c] = static_cast<float>((lower_right[c] - lower_left[c] - upper_right[c] + upper_left[c]) /
                                 (w * h));
  }
  return mean;
}

}  // namespace fstop
