// The making of a texture's levels: the image, and of mip maps what lies above it.
#include <algorithm>
#include <array>
#include <cmath>

#include "core/build_stop.h"
#include "core/error.h"
#include "core/scene/texture.h"

namespace fstop {
namespace {

// How much of each finer texel falls into a coarser one, along one axis: exact for any size, so
// the mean of every level is the mean of the image.
struct Overlap {
  int first = 0;
  std::array<float, 3> weight = {};
};

// Texels from row to row: one more than the image has, and then as many as make the rows an odd
// number of cache lines of four texels, so that the rows of a lookup's neighbourhood do not
// compete for the same lines of the cache.
int stride_of(int width) {
  const int lines = (width + 1 + 3) / 4;
  return width < 64 ? width + 1 : 4 * (lines | 1);
}

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
  const Image& image = source.image;
  if (image.empty() || image.channels() != 3) {
    throw Error(ErrorCode::bad_image, "texture " + source.name + " has no RGB pixels");
  }
  lay_out_levels(image.width(), image.height());
  const Level& full = levels_.front();
  for (int y = 0; y < image.height(); ++y) {
    begin_row(full, y);
    for (int x = 0; x < image.width(); ++x) {
      const float* p = image.at(x, y);
      texel(full, static_cast<std::size_t>(x), static_cast<std::size_t>(y)) =
          Texel{p[0], p[1], p[2], 0.0F};
    }
  }
  add_border(full);
  texels_per_uv_ =
      std::sqrt(static_cast<float>(image.width()) * static_cast<float>(image.height()));
  if (filter_ == TextureFilter::summed_area) sums_.emplace(image, wrap_ == TextureWrap::repeat);
  for (std::size_t i = 1; i < levels_.size(); ++i) fill_level(levels_[i], levels_[i - 1]);
}

// Reserves what all levels take: moving the texels of a large image takes longer than a stop may.
void Texture::lay_out_levels(int width, int height) {
  std::size_t first = 0;
  for (;;) {
    levels_.push_back({width, height, stride_of(width), first});
    first +=
        static_cast<std::size_t>(levels_.back().stride) * (static_cast<std::size_t>(height) + 1);
    if (!has_pyramid() || (width == 1 && height == 1)) break;
    width = std::max(1, width / 2);
    height = std::max(1, height / 2);
  }
  texels_.reserve(first);
}

// Row by row, so that a stop is seen while the texels' memory is first touched.
void Texture::begin_row(const Level& level, int y) {
  BuildStop::throw_if_requested();
  texels_.resize(level.first +
                 static_cast<std::size_t>(level.stride) * (static_cast<std::size_t>(y) + 1));
}

void Texture::fill_level(const Level& coarser, const Level& finer) {
  for (int y = 0; y < coarser.height; ++y) {
    begin_row(coarser, y);
    const Overlap rows = overlap_of(y, coarser.height, finer.height);
    for (int x = 0; x < coarser.width; ++x) {
      const Overlap columns = overlap_of(x, coarser.width, finer.width);
      Texel sum = {};
      for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t i = 0; i < 3; ++i) {
          const float weight = rows.weight[j] * columns.weight[i];
          if (weight == 0.0F) continue;
          sum += weight * texel(finer, static_cast<std::size_t>(columns.first) + i,
                                static_cast<std::size_t>(rows.first) + j);
        }
      }
      texel(coarser, static_cast<std::size_t>(x), static_cast<std::size_t>(y)) = sum;
    }
  }
  add_border(coarser);
}

void Texture::add_border(const Level& level) {
  const auto width = static_cast<std::size_t>(level.width);
  const auto height = static_cast<std::size_t>(level.height);
  const bool repeats = wrap_ == TextureWrap::repeat;
  begin_row(level, level.height);
  for (std::size_t y = 0; y < height; ++y) {
    texel(level, width, y) = texel(level, repeats ? 0 : width - 1, y);
  }
  for (std::size_t x = 0; x <= width; ++x) {
    texel(level, x, height) = texel(level, x, repeats ? 0 : height - 1);
  }
}

}  // namespace fstop
