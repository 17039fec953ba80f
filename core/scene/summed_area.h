#pragma once

#include <array>
#include <vector>

#include "core/film/image.h"

namespace fstop {

/// Sums of an image over all rectangles from its upper left corner, so that the mean over any
/// rectangle takes four lookups whatever its size. In double precision: a sum of 10^8 values keeps
/// nine digits of the mean of a few.
/// Source: Crow 1984.
class SummedArea {
 public:
  /// `image`: 3 channels, not empty. Beyond its edges it repeats, or goes on as it ends.
  SummedArea(const Image& image, bool repeats);

  /// Mean over the rectangle of `width` x `height` texels around (x, y), in texels from the upper
  /// left; of an image that is constant over each texel, so that texels count by the share of them
  /// that lies inside. Over one texel's width that is bilinear interpolation. At most the image's
  /// own size where it repeats.
  std::array<float, 3> mean(double x, double y, double width, double height) const noexcept;

  std::size_t memory_bytes() const noexcept { return sums_.size() * sizeof(Sum); }

 private:
  using Sum = std::array<double, 3>;
  const Sum& at(int x, int y) const noexcept {
    return sums_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1) +
                 static_cast<std::size_t>(x)];
  }
  Sum within(double x, double y) const noexcept;
  Sum sum_to(double x, double y) const noexcept;

  int width_;
  int height_;
  bool repeats_;
  std::vector<Sum> sums_;
};

}  // namespace fstop
