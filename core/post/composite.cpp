#include "core/post/composite.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace fstop {
namespace {

constexpr int kLayerChannels = 4;

void require_shape(const Image& image, int width, int height, int channels) {
  if (image.width() == width && image.height() == height && image.channels() == channels) return;
  throw Error(ErrorCode::outside_domain,
              "layers have one size, here " + std::to_string(width) + " x " +
                  std::to_string(height) + " pixels of " + std::to_string(channels) +
                  " channels; one has " + std::to_string(image.width()) + " x " +
                  std::to_string(image.height()) + " of " + std::to_string(image.channels()));
}

void require_layers(const Image& a, const Image& b) {
  require_shape(a, a.width(), a.height(), kLayerChannels);
  require_shape(b, a.width(), a.height(), kLayerChannels);
}

float clipped_share(double share) {
  return share > 0.0 ? static_cast<float>(std::min(share, 1.0)) : 0.0F;
}

// `pixel(x, y, to)` for every pixel of a new picture.
template <typename Pixel>
Image image_by(int width, int height, int channels, const Pixel& pixel) {
  Image result(width, height, channels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) pixel(x, y, result.at(x, y));
  }
  return result;
}

}  // namespace

Image layer_of(const Image& color, const Image& alpha, bool is_premultiplied) {
  require_shape(color, color.width(), color.height(), 3);
  require_shape(alpha, color.width(), color.height(), 1);
  return image_by(color.width(), color.height(), kLayerChannels, [&](int x, int y, float* to) {
    const float share = clipped_share(double{*alpha.at(x, y)});
    for (int c = 0; c < 3; ++c) to[c] = color.at(x, y)[c] * (is_premultiplied ? 1.0F : share);
    to[3] = share;
  });
}

Image opaque_layer(const Image& color) {
  require_shape(color, color.width(), color.height(), 3);
  return image_by(color.width(), color.height(), kLayerChannels, [&](int x, int y, float* to) {
    std::copy_n(color.at(x, y), 3, to);
    to[3] = 1.0F;
  });
}

Image over(const Image& top, const Image& bottom) {
  require_layers(top, bottom);
  return image_by(top.width(), top.height(), kLayerChannels, [&](int x, int y, float* to) {
    const float* front = top.at(x, y);
    const float passed = 1.0F - front[3];
    for (int c = 0; c < kLayerChannels; ++c) to[c] = front[c] + passed * bottom.at(x, y)[c];
  });
}

Image overlay_where_not_zero(const Image& top, const Image& bottom) {
  require_layers(top, bottom);
  return image_by(top.width(), top.height(), kLayerChannels, [&](int x, int y, float* to) {
    const float* front = top.at(x, y);
    const bool is_there = front[0] != 0.0F || front[1] != 0.0F || front[2] != 0.0F;
    std::copy_n(is_there ? front : bottom.at(x, y), kLayerChannels, to);
  });
}

double chroma_distance(const float* a, const float* b) noexcept {
  const double r = double{a[0]} - double{b[0]};
  const double g = double{a[1]} - double{b[1]};
  const double blue = double{a[2]} - double{b[2]};
  const double luma = 0.2126 * r + 0.7152 * g + 0.0722 * blue;
  return std::hypot((blue - luma) / 1.8556, (r - luma) / 1.5748);
}

Image keyed(const Image& color, const ChromaKey& key) {
  require_shape(color, color.width(), color.height(), 3);
  return image_by(color.width(), color.height(), kLayerChannels, [&](int x, int y, float* to) {
    const float* pixel = color.at(x, y);
    const double beyond = chroma_distance(pixel, key.color.data()) - key.tolerance;
    const double hard = beyond > 0.0 ? 1.0 : 0.0;
    const float share = clipped_share(key.softness > 0.0 ? beyond / key.softness : hard);
    for (std::size_t c = 0; c < 3; ++c) {
      to[c] = std::max(0.0F, pixel[c] - (1.0F - share) * key.color[c]);
    }
    to[3] = share;
  });
}

Image color_of(const Image& layer) {
  require_shape(layer, layer.width(), layer.height(), kLayerChannels);
  return image_by(layer.width(), layer.height(), 3,
                  [&](int x, int y, float* to) { std::copy_n(layer.at(x, y), 3, to); });
}

Image alpha_of(const Image& layer) {
  require_shape(layer, layer.width(), layer.height(), kLayerChannels);
  return image_by(layer.width(), layer.height(), 1,
                  [&](int x, int y, float* to) { *to = layer.at(x, y)[3]; });
}

}  // namespace fstop
