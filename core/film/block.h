#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

namespace fstop {

/// Pixels are sampled in square blocks of this side: a packet holds one sample of each.
inline constexpr int kBlockSide = 4;
inline constexpr int kBlockPixels = kBlockSide * kBlockSide;

/// The blocks of a picture, row by row; those at the right and the bottom may stick out of it.
struct BlockGrid {
  BlockGrid(int picture_width, int picture_height)
      : width(picture_width),
        height(picture_height),
        columns((picture_width + kBlockSide - 1) / kBlockSide),
        rows((picture_height + kBlockSide - 1) / kBlockSide) {}

  int width;  // of the picture, pixels
  int height;
  int columns;
  int rows;

  std::size_t count() const noexcept {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  std::size_t index(int column, int row) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  int left(std::size_t block) const noexcept {
    return static_cast<int>(block % static_cast<std::size_t>(columns)) * kBlockSide;
  }
  int top(std::size_t block) const noexcept {
    return static_cast<int>(block / static_cast<std::size_t>(columns)) * kBlockSide;
  }
  /// Pixels of the block that lie in the picture.
  int pixels(std::size_t block) const noexcept {
    return std::min(kBlockSide, width - left(block)) * std::min(kBlockSide, height - top(block));
  }
  /// Calls visit(lane, x, y) for each of them; lane = 4 (y - top) + (x - left).
  template <typename Visit>
  void for_each_pixel(std::size_t block, const Visit& visit) const {
    const int right = std::min(width, left(block) + kBlockSide);
    const int bottom = std::min(height, top(block) + kBlockSide);
    for (int y = top(block); y < bottom; ++y) {
      for (int x = left(block); x < right; ++x) {
        visit(static_cast<std::size_t>(kBlockSide * (y - top(block)) + x - left(block)), x, y);
      }
    }
  }
};

/// Sums of samples of a block's pixels, per channel and lane, and how sharp anything in it is.
struct alignas(64) BlockSums {
  using Lanes = std::array<double, kBlockPixels>;
  std::array<Lanes, 3> value = {};
  /// Smallest distance in vergence, 1/metre, of what a sample met from the focus; 0 for mirrors.
  float least_defocus = std::numeric_limits<float>::infinity();
};

}  // namespace fstop
