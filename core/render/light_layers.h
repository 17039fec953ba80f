#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "core/film/image.h"

namespace fstop {

/// Sharp light of a picture by layer of depth, on a grid finer than its pixels. Kept by tiles of
/// kTile pixels: a tile has memory only for the layers that light fell on. One thread a tile.
class LightLayers {
 public:
  /// `cells`: grid cells along a pixel's side.
  LightLayers(int width, int height, int cells, int layers);

  int width() const noexcept { return width_; }  // pixels
  int height() const noexcept { return height_; }
  int cells() const noexcept { return cells_; }
  int layers() const noexcept { return layers_; }

  /// Adds light at a raster point inside the picture. (x, y) in pixels.
  void add(double x, double y, int layer, const std::array<float, 3>& light);

  /// A rectangle of cells.
  struct Area {
    int left = 0;
    int top = 0;
    int right = 0;   // past the last
    int bottom = 0;  // past the last
  };

  /// Adds `factor` times a layer's channel to `plane`, one element a cell; the plane's corner lies
  /// at cell (left, top), and what lies outside it is left out.
  void add_to(ImageView<float> plane, int left, int top, int layer, int channel,
              float factor) const;
  /// Where a layer has light, in whole tiles; empty if nowhere.
  Area area(int layer) const;

  /// Joins another's light, of the same shape, and leaves that one dark.
  void take(LightLayers& other);

 private:
  struct Block {
    int layer = 0;
    std::unique_ptr<float[]> light = {};  // [channel][row][column]
  };
  std::size_t side() const noexcept;
  Block& block(std::vector<Block>& tile, int layer) const;

  int width_;
  int height_;
  int cells_;
  int layers_;
  int columns_;  // of tiles
  std::vector<std::vector<Block>> tiles_;
};

}  // namespace fstop
