#include "core/post/layer_stack.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace fstop {
namespace {

constexpr int kChannels = 4;
constexpr double kChromaGain = 0.7299;

bool has_light(const float* pixel) {
  return pixel[0] != 0.0F || pixel[1] != 0.0F || pixel[2] != 0.0F;
}

bool is_beyond_white(const float* pixel) { return std::max({pixel[0], pixel[1], pixel[2]}) > 1.0F; }

double pixels_of(const Image& image) {
  return static_cast<double>(image.width()) * static_cast<double>(image.height());
}

// Whether the pixel and one of its eight neighbours differ in having light.
bool is_fringe(const Image& layer, int x, int y) {
  const bool here = has_light(layer.at(x, y));
  for (int j = std::max(y - 1, 0); j <= std::min(y + 1, layer.height() - 1); ++j) {
    for (int i = std::max(x - 1, 0); i <= std::min(x + 1, layer.width() - 1); ++i) {
      if (has_light(layer.at(i, j)) != here) return true;
    }
  }
  return false;
}

template <typename Holds>
double share_of_pixels(const Image& image, const Holds& holds) {
  std::int64_t count = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) count += holds(x, y) ? 1 : 0;
  }
  return static_cast<double>(count) / pixels_of(image);
}

}  // namespace

Image placed_layer(const Image& layer, int width, int height, const LayerPlace& place) {
  Image placed(width, height, kChannels);
  const auto opacity = static_cast<float>(place.opacity);
  // In 64 bits: an offset may be as large as it likes.
  const std::int64_t left = place.left;
  const std::int64_t top = place.top;
  const std::int64_t right = std::min<std::int64_t>(width, left + layer.width());
  const std::int64_t bottom = std::min<std::int64_t>(height, top + layer.height());
  for (std::int64_t y = std::max<std::int64_t>(top, 0); y < bottom; ++y) {
    for (std::int64_t x = std::max<std::int64_t>(left, 0); x < right; ++x) {
      const float* from = layer.at(static_cast<int>(x - left), static_cast<int>(y - top));
      float* to = placed.at(static_cast<int>(x), static_cast<int>(y));
      for (int c = 0; c < kChannels; ++c) to[c] = opacity * from[c];
    }
  }
  return placed;
}

LayerStack::LayerStack(int width, int height) {
  if (width < 1 || height < 1) {
    throw Error(ErrorCode::outside_domain, "a canvas needs at least 1 x 1 pixels");
  }
  canvas_ = Image(width, height, kChannels);
}

void LayerStack::add(const Image& layer, const LayerError& error, const LayerPlace& place) {
  if (layer.channels() != kChannels) {
    throw Error(ErrorCode::outside_domain, "layers have 4 channels");
  }
  if (!(place.opacity >= 0.0 && place.opacity <= 1.0)) {
    throw Error(ErrorCode::outside_domain, "an opacity lies in 0 to 1");
  }
  const Image placed = placed_layer(layer, canvas_.width(), canvas_.height(), place);
  // The squares of all its errors, whatever is cut off, over the canvas.
  const double spread = place.opacity * std::sqrt(pixels_of(layer) / pixels_of(canvas_));
  const LayerError own{.color = spread * error.color, .alpha = spread * error.alpha};
  if (place.opacity < 1.0 && own.color > 0.0) {
    unsure_ +=
        share_of_pixels(layer, [&](int x, int y) { return is_beyond_white(layer.at(x, y)); }) *
        std::min(1.0, pixels_of(layer) / pixels_of(canvas_));
  }
  if (place.operation == LayerOperation::overlay) {
    overlay(placed, own);
  } else {
    lay_over(placed, own);
  }
}

void LayerStack::lay_over(const Image& placed, const LayerError& error) {
  double brightest = 0.0;
  double most_passed = 0.0;
  const bool is_exact_beneath = error_.color == 0.0;
  const double unsure = share_of_pixels(canvas_, [&](int x, int y) {
    const float* beneath = canvas_.at(x, y);
    const float alpha = placed.at(x, y)[3];
    most_passed = std::max(most_passed, 1.0 - double{alpha});
    if (!is_beyond_white(beneath)) {
      brightest = std::max(brightest, double{std::max({beneath[0], beneath[1], beneath[2]})});
      return false;
    }
    const bool is_partial = alpha > 0.0F && alpha < 1.0F;
    return error.alpha > 0.0 || (!is_exact_beneath && is_partial);
  });
  canvas_ = over(placed, canvas_);
  if (!is_exact_beneath) brightest = 1.0;  // the true one may be brighter than what was found
  error_.color = error.color + error.alpha * brightest + most_passed * error_.color;
  error_.alpha = error.alpha + most_passed * error_.alpha;
  unsure_ += unsure;
}

void LayerStack::overlay(const Image& placed, const LayerError& error) {
  if (error.color > 0.0) {
    unsure_ += share_of_pixels(placed, [&](int x, int y) { return is_fringe(placed, x, y); });
  }
  canvas_ = overlay_where_not_zero(placed, canvas_);
  error_.color = std::hypot(error.color, error_.color);
  error_.alpha = std::hypot(error.alpha, error_.alpha);
}

LayerError LayerStack::error() const noexcept {
  const double unsure = std::sqrt(std::min(unsure_, 1.0));
  return {.color = std::min(1.0, error_.color + unsure),
          .alpha = std::min(1.0, error_.alpha + unsure)};
}

LayerError keyed_error(const ChromaKey& key, const Image& layer, double color) {
  if (!(color > 0.0)) return {};
  // Over the pixels: their colours' vectors of three channels have sqrt(3) of the RMSE's length.
  const double chroma = kChromaGain * std::sqrt(3.0) * color;
  const double alpha = key.softness > 0.0 ? std::min(1.0, chroma / key.softness) : 1.0;
  const double brightest = std::max({key.color[0], key.color[1], key.color[2]});
  const double unsure = std::sqrt(
      share_of_pixels(layer, [&](int x, int y) { return is_beyond_white(layer.at(x, y)); }));
  return {.color = std::min(1.0, color + brightest * alpha + unsure),
          .alpha = std::min(1.0, alpha + unsure)};
}

}  // namespace fstop
