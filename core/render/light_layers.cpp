#include "core/render/light_layers.h"

#include <algorithm>

#include "core/render/sample_loop.h"

namespace fstop {

LightLayers::LightLayers(int width, int height, int cells, int layers)
    : width_(width),
      height_(height),
      cells_(cells),
      layers_(layers),
      columns_((width + kTile - 1) / kTile),
      tiles_(static_cast<std::size_t>(columns_) *
             static_cast<std::size_t>((height + kTile - 1) / kTile)) {}

std::size_t LightLayers::side() const noexcept { return static_cast<std::size_t>(kTile * cells_); }

LightLayers::Block& LightLayers::block(std::vector<Block>& tile, int layer) const {
  for (Block& present : tile) {
    if (present.layer == layer) return present;
  }
  return tile.emplace_back(
      Block{.layer = layer, .light = std::make_unique<float[]>(3 * side() * side())});
}

void LightLayers::add(double x, double y, int layer, const std::array<float, 3>& light) {
  const int cell_x = std::clamp(static_cast<int>(x * cells_), 0, width_ * cells_ - 1);
  const int cell_y = std::clamp(static_cast<int>(y * cells_), 0, height_ * cells_ - 1);
  const auto span = static_cast<int>(side());
  const auto tile = static_cast<std::size_t>((cell_y / span) * columns_ + cell_x / span);
  float* const values = block(tiles_[tile], layer).light.get();
  const std::size_t cell =
      static_cast<std::size_t>(cell_y % span) * side() + static_cast<std::size_t>(cell_x % span);
  for (std::size_t c = 0; c < 3; ++c) values[c * side() * side() + cell] += light[c];
}

void LightLayers::add_to(ImageView<float> plane, int left, int top, int layer, int channel,
                         float factor) const {
  const auto span = static_cast<int>(side());
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    for (const Block& present : tiles_[t]) {
      if (present.layer != layer) continue;
      const int block_left = static_cast<int>(t) % columns_ * span - left;
      const int block_top = static_cast<int>(t) / columns_ * span - top;
      const int from = std::max(block_left, 0);
      const int to = std::min({block_left + span, plane.width, width_ * cells_ - left});
      const int last = std::min({block_top + span, plane.height, height_ * cells_ - top});
      for (int y = std::max(block_top, 0); y < last; ++y) {
        const float* in = present.light.get() + (static_cast<std::size_t>(channel) * side() +
                                                 static_cast<std::size_t>(y - block_top)) *
                                                    side();
        float* out = plane.at(0, y);
        for (int x = from; x < to; ++x) out[x] += factor * in[x - block_left];
      }
    }
  }
}

LightLayers::Area LightLayers::area(int layer) const {
  const auto span = static_cast<int>(side());
  Area area{.left = width_ * cells_, .top = height_ * cells_};
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    for (const Block& present : tiles_[t]) {
      if (present.layer != layer) continue;
      const int left = static_cast<int>(t) % columns_ * span;
      const int top = static_cast<int>(t) / columns_ * span;
      area.left = std::min(area.left, left);
      area.top = std::min(area.top, top);
      area.right = std::max(area.right, std::min(left + span, width_ * cells_));
      area.bottom = std::max(area.bottom, std::min(top + span, height_ * cells_));
    }
  }
  return area.right > area.left ? area : Area{};
}

void LightLayers::take(LightLayers& other) {
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    for (Block& from : other.tiles_[t]) {
      Block& to = block(tiles_[t], from.layer);
      for (std::size_t i = 0; i < 3 * side() * side(); ++i) to.light[i] += from.light[i];
    }
    other.tiles_[t].clear();
  }
}

}  // namespace fstop
