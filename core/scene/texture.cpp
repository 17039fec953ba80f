#include "core/scene/texture.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace fstop {
namespace {

// How much of each finer texel falls into a coarser one, along one axis: exact for any size, so
// the mean of every level is the mean of the image.
struct Overlap {
  int first = 0;
  std::array<float, 3> weight = {};
};

Overlap overlap_of(int coarse, int coarse_size, int fine_size) {
  const double scale = static_cast<double>(fine_size) / coarse_size;
  const double begin = coarse * scale;
  const double end = begin + scale;
  Overlap overlap{.first = static_cast<int>(begin)};
  for (int k = 0; k < 3; ++k) {
    const double low = std::max(begin, static_cast<double>(overlap.first + k));
    const double high = std::min(end, static_cast<double>(overlap.first + k + 1));
    overlap.weight[static_cast<std::size_t>(k)] =
        static_cast<float>(std::max(0.0, high - low) / scale);
  }
  return overlap;
}

}  // namespace

Texture::Texture(const TextureSource& source) : filter_(source.filter), wrap_(source.wrap) {
  if (filter_ == TextureFilter::summed_area || filter_ == TextureFilter::stochastic) {
    throw Error(ErrorCode::unsupported,
                "texture " + source.name +
                    ": filters are nearest, bilinear, mipmap and brute-force in this version");
  }
  const Image& image = source.image;
  if (image.empty() || image.channels() != 3) {
    throw Error(ErrorCode::bad_image, "texture " + source.name + " has no RGB pixels");
  }
  levels_.push_back({image.width(), image.height(), 0});
  texels_.reserve(static_cast<std::size_t>(image.width()) *
                      static_cast<std::size_t>(image.height()) * 4 / 3 +
                  16);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const float* p = image.at(x, y);
      texels_.push_back({p[0], p[1], p[2], 0.0F});
    }
  }
  texels_per_uv_ =
      std::sqrt(static_cast<float>(image.width()) * static_cast<float>(image.height()));
  if (filter_ != TextureFilter::mipmap) return;
  while (levels_.back().width > 1 || levels_.back().height > 1) add_level(levels_.back());
}

void Texture::add_level(const Level& finer_level) {
  const Level finer = finer_level;
  const Level coarser{std::max(1, finer.width / 2), std::max(1, finer.height / 2), texels_.size()};
  for (int y = 0; y < coarser.height; ++y) {
    const Overlap rows = overlap_of(y, coarser.height, finer.height);
    for (int x = 0; x < coarser.width; ++x) {
      const Overlap columns = overlap_of(x, coarser.width, finer.width);
      Texel sum = {};
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) {
          const float weight = rows.weight[static_cast<std::size_t>(j)] *
                               columns.weight[static_cast<std::size_t>(i)];
          if (weight == 0.0F) continue;
          const std::size_t row = static_cast<std::size_t>(rows.first + j);
          const std::size_t column = static_cast<std::size_t>(columns.first + i);
          const Texel& texel =
              texels_[finer.first + row * static_cast<std::size_t>(finer.width) + column];
          for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * texel[c];
        }
      }
      texels_.push_back(sum);
    }
  }
  levels_.push_back(coarser);
}

int Texture::wrapped(int i, int size) const noexcept {
  if (wrap_ == TextureWrap::clamp) return std::clamp(i, 0, size - 1);
  if (i >= 0 && i < size) return i;
  const int rest = i % size;
  return rest < 0 ? rest + size : rest;
}

namespace {

// uv within a period of the image, so that huge coordinates neither overflow an int nor lose
// the texel.
float within_period(float x, TextureWrap wrap) {
  if (std::isnan(x)) return 0.0F;
  if (wrap == TextureWrap::clamp) return std::clamp(x, -1.0F, 2.0F);
  // Beyond 1e6 single precision has lost the texel anyway.
  return std::abs(x) <= 1e6F ? x - std::floor(x) : 0.0F;
}

}  // namespace

Texture::Texel Texture::bilinear(const Level& level, float u, float v) const noexcept {
  const float x = u * static_cast<float>(level.width) - 0.5F;
  const float y = (1.0F - v) * static_cast<float>(level.height) - 0.5F;
  const float fx = std::floor(x);
  const float fy = std::floor(y);
  const float ax = x - fx;
  const float ay = y - fy;
  const int x0 = wrapped(static_cast<int>(fx), level.width);
  const int x1 = wrapped(static_cast<int>(fx) + 1, level.width);
  const int y0 = wrapped(static_cast<int>(fy), level.height);
  const int y1 = wrapped(static_cast<int>(fy) + 1, level.height);
  const Texel* upper =
      &texels_[level.first + static_cast<std::size_t>(y0) * static_cast<std::size_t>(level.width)];
  const Texel* lower =
      &texels_[level.first + static_cast<std::size_t>(y1) * static_cast<std::size_t>(level.width)];
  Texel result = {};
  for (std::size_t c = 0; c < 4; ++c) {
    const float top = upper[x0][c] + ax * (upper[x1][c] - upper[x0][c]);
    const float bottom = lower[x0][c] + ax * (lower[x1][c] - lower[x0][c]);
    result[c] = top + ay * (bottom - top);
  }
  return result;
}

Texture::Texel Texture::nearest(float u, float v) const noexcept {
  const Level& level = levels_.front();
  const int x =
      wrapped(static_cast<int>(std::floor(u * static_cast<float>(level.width))), level.width);
  const int y = wrapped(static_cast<int>(std::floor((1.0F - v) * static_cast<float>(level.height))),
                        level.height);
  return texels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(level.width) +
                 static_cast<std::size_t>(x)];
}

Rgb Texture::sample(float u, float v, float footprint) const noexcept {
  u = within_period(u, wrap_);
  v = within_period(v, wrap_);
  Texel texel = {};
  if (filter_ == TextureFilter::nearest) {
    texel = nearest(u, v);
  } else if (filter_ != TextureFilter::mipmap || !(footprint > 1.0F)) {
    texel = bilinear(levels_.front(), u, v);
  } else {
    const float lod = std::min(std::log2(footprint), static_cast<float>(levels_.size() - 1));
    const auto finer = static_cast<std::size_t>(lod);
    const float blend = lod - static_cast<float>(finer);
    texel = bilinear(levels_[finer], u, v);
    if (blend > 0.0F) {
      const Texel coarse = bilinear(levels_[finer + 1], u, v);
      for (std::size_t c = 0; c < 4; ++c) texel[c] += blend * (coarse[c] - texel[c]);
    }
  }
  return {texel[0], texel[1], texel[2]};
}

}  // namespace fstop
