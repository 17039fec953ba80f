#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace fstop {

/// Pixels are sampled in square blocks of this side: a packet holds one sample of each.
inline constexpr int kBlockSide = 4;
inline constexpr int kBlockPixels = kBlockSide * kBlockSide;

/// Pixels along the side of a tile, 4 x 4 blocks: what one thread traces at a time.
inline constexpr int kTile = 4 * kBlockSide;

/// The blocks of a picture, row by row; those at the right and the bottom may stick out of it.
///
/// A block is a square of 4 x 4 pixels, or in an interleaved tile every fourth pixel of every
/// fourth row. Blocks share pupil points: squares suit neighbours that need different counts,
/// interleaved ones neighbours that are averaged, which then have seen different points of the
/// pupil. Source: interleaved sampling, Keller & Heidrich 2001.
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
  /// Which tiles are interleaved, row by row; empty: none. Tiles that stick out never are.
  std::vector<std::uint8_t> interleaved = {};

  int tile_columns() const noexcept { return (width + kTile - 1) / kTile; }
  int tile_rows() const noexcept { return (height + kTile - 1) / kTile; }

  std::size_t count() const noexcept {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  std::size_t index(int column, int row) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  int column(std::size_t block) const noexcept {
    return static_cast<int>(block % static_cast<std::size_t>(columns));
  }
  int row(std::size_t block) const noexcept {
    return static_cast<int>(block / static_cast<std::size_t>(columns));
  }
  bool is_interleaved(std::size_t block) const noexcept {
    if (interleaved.empty()) return false;
    const int tile_column = column(block) / (kTile / kBlockSide);
    const int tile_row = row(block) / (kTile / kBlockSide);
    return interleaved[static_cast<std::size_t>(tile_row) *
                           static_cast<std::size_t>(tile_columns()) +
                       static_cast<std::size_t>(tile_column)] != 0 &&
           (tile_column + 1) * kTile <= width && (tile_row + 1) * kTile <= height;
  }
  /// The block's first pixel, and from one pixel to the next.
  int left(std::size_t block) const noexcept {
    if (!is_interleaved(block)) return column(block) * kBlockSide;
    return column(block) / kBlockSide * kTile + column(block) % kBlockSide;
  }
  int top(std::size_t block) const noexcept {
    if (!is_interleaved(block)) return row(block) * kBlockSide;
    return row(block) / kBlockSide * kTile + row(block) % kBlockSide;
  }
  int stride(std::size_t block) const noexcept { return is_interleaved(block) ? kBlockSide : 1; }
  /// Pixels of the block that lie in the picture.
  int pixels(std::size_t block) const noexcept {
    if (is_interleaved(block)) return kBlockPixels;
    return std::min(kBlockSide, width - left(block)) * std::min(kBlockSide, height - top(block));
  }
  /// Calls visit(lane, x, y) for each of them; lane = 4 j + i for the i-th of the j-th row.
  template <typename Visit>
  void for_each_pixel(std::size_t block, const Visit& visit) const {
    const int step = stride(block);
    const int across = left(block);
    const int down = top(block);
    for (int j = 0; j < kBlockSide && down + step * j < height; ++j) {
      for (int i = 0; i < kBlockSide && across + step * i < width; ++i) {
        visit(static_cast<std::size_t>(kBlockSide * j + i), across + step * i, down + step * j);
      }
    }
  }
};
static_assert(kTile == kBlockSide * kBlockSide);

/// Sums of samples of a block's pixels, per channel and lane, and how sharp anything in it is.
struct alignas(64) BlockSums {
  using Lanes = std::array<double, kBlockPixels>;
  std::array<Lanes, 3> value = {};
  /// Smallest distance in vergence, 1/metre, of what a sample met from the focus; 0 for mirrors.
  float least_defocus = std::numeric_limits<float>::infinity();
};

}  // namespace fstop
