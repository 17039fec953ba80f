#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "core/film/image.h"
#include "core/film/noise_estimate.h"

namespace fstop {

/// Sums of one pixel's samples and of their squares, per channel.
struct PixelSums {
  std::array<double, 3> value = {};
  std::array<double, 3> square = {};

  void add(float r, float g, float b) noexcept {
    const std::array<double, 3> sample = {r, g, b};
    for (std::size_t c = 0; c < 3; ++c) {
      value[c] += sample[c];
      square[c] += sample[c] * sample[c];
    }
  }
};

/// Pixels' sums, all zero: memory comes when a pixel is first touched, on the thread that does so.
class SumPlane {
 public:
  /// Throws: std::bad_alloc.
  explicit SumPlane(std::size_t size);

  std::size_t size() const noexcept { return size_; }
  PixelSums& operator[](std::size_t i) noexcept { return sums_.get()[i]; }
  const PixelSums& operator[](std::size_t i) const noexcept { return sums_.get()[i]; }

 private:
  struct Free {
    void operator()(PixelSums* sums) const noexcept;
  };
  std::size_t size_;
  std::unique_ptr<PixelSums, Free> sums_;
};

/// Samples on their way to pixels. They arrive in passes of equally many samples a pixel, each
/// pass a part of every pixel's sequence; within a pass each pixel is written by one tile only.
class Film {
 public:
  Film(int width, int height);

  int width() const noexcept { return width_; }
  int height() const noexcept { return height_; }
  int samples() const noexcept { return samples_; }

  /// Adds to the pass under way.
  void add(int x, int y, const PixelSums& sums) noexcept {
    PixelSums& pixel = pass_[index(x, y)];
    for (std::size_t c = 0; c < 3; ++c) {
      pixel.value[c] += sums.value[c];
      pixel.square[c] += sums.square[c];
    }
  }

  /// Ends a pass of `samples` a pixel. The first pass only counts; each later one must have as
  /// many samples as all before it, and the two halves tell the noise of their mean:
  ///
  ///     mse = mean((A - B)^2)/4
  ///
  /// unbiased for independent samples; halves of one scrambled net repel each other, so that it
  /// overestimates there (by 1.1 to 2.8 in mse on two measured scenes). Blind to bias.
  /// Values are clipped to [0,1] first, for the unclipped bound they are not. The bound adds 1.645
  /// sqrt(2) standard errors of that mean over pixels: the estimate and the error that was made are
  /// independent and scatter alike.
  NoiseEstimate end_pass(int samples);

  /// Half the difference of the two halves at the end of the last pass that had them, 3 channels:
  /// the mean plus or minus it is either half's. Kept from keep_difference() on; else empty.
  const Image& half_difference() const noexcept { return half_difference_; }
  void keep_difference() { half_difference_ = Image(width_, height_, 3); }

  /// Mean of all samples, 3 channels.
  Image mean() const;
  /// Variance of that mean per pixel and channel, from the samples' own scatter: an upper bound
  /// for stratified samples, exact for independent ones.
  Image variance() const;

 private:
  std::size_t index(int x, int y) const noexcept {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  int width_;
  int height_;
  int samples_ = 0;
  SumPlane total_;
  SumPlane pass_;
  Image half_difference_ = {};
};

}  // namespace fstop
