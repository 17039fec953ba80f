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

void LightLayers::add_to(ImageView<float> plane, int layer, int channel, float factor) const {
  const auto span = static_cast<int>(side());
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    for (const Block& present : tiles_[t]) {
      if (present.layer != layer) continue;
      const int left = static_cast<int>(t) % columns_ * span;
      const int top = static_cast<int>(t) / columns_ * span;
      const int right = std::min(left + span, std::min(plane.width, width_ * cells_));
      const int bottom = std::min(top + span, std::min(plane.height, height_ * cells_));
      for (int y = top; y < bottom; ++y) {
        const float* in = present.light.get() + (static_cast<std::size_t>(channel) * side() +
                                                 static_cast<std::size_t>(y - top)) *
                                                    side();
        float* out = plane.at(left, y);
        for (int x = 0; x < right - left; ++x) out[x] += factor * in[x];
      }
    }
  }
}

bool LightLayers::has(int layer) const {
  return std::ranges::any_of(tiles_, [&](const std::vector<Block>& tile) {
    return std::ranges::any_of(tile, [&](const Block& b) { return b.layer == layer; });
  });
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
