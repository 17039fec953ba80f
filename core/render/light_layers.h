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

  /// Adds `factor` times a layer's channel to `plane`, one element a cell, the picture's corner at
  /// the plane's. Lines outside what light fell on are left alone.
  void add_to(ImageView<float> plane, int layer, int channel, float factor) const;
  /// Whether any light fell on the layer.
  bool has(int layer) const;

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
