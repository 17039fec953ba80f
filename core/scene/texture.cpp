#include "core/scene/texture.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/fast_math.h"

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
      texels_.push_back(Texel{p[0], p[1], p[2], 0.0F});
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
          sum += weight * texel;
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
  const Texel top = upper[x0] + ax * (upper[x1] - upper[x0]);
  const Texel bottom = lower[x0] + ax * (lower[x1] - lower[x0]);
  return top + ay * (bottom - top);
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

// Where a packet's lookups in one level find their four texels, and how they mix.
struct alignas(64) Texture::Taps {
  std::array<std::int32_t, kLanes> upper_left = {}, upper_right = {}, lower_left = {},
                                   lower_right = {};
  std::array<float, kLanes> across = {}, down = {};
};

namespace {

FSTOP_KERNEL std::int32_t inside(std::int32_t i, std::int32_t size, bool repeats) {
  const std::int32_t clamped = i < 0 ? 0 : (i >= size ? size - 1 : i);
  const std::int32_t turned = i < 0 ? i + size : (i >= size ? i - size : i);
  return repeats ? turned : clamped;
}

template <typename Taps>
FSTOP_KERNEL void find_taps(std::int32_t width, std::int32_t height, std::int32_t first,
                            bool repeats, const std::array<float, kLanes>& u,
                            const std::array<float, kLanes>& v, Taps& taps) {
  const auto w = static_cast<float>(width);
  const auto h = static_cast<float>(height);
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float x = u[k] * w - 0.5F;
    const float y = (1.0F - v[k]) * h - 0.5F;
    const float fx = std::floor(x);
    const float fy = std::floor(y);
    taps.across[k] = x - fx;
    taps.down[k] = y - fy;
    const auto ix = static_cast<std::int32_t>(fx);
    const auto iy = static_cast<std::int32_t>(fy);
    const std::int32_t left = inside(ix, width, repeats);
    const std::int32_t right = inside(ix + 1, width, repeats);
    const std::int32_t top = first + width * inside(iy, height, repeats);
    const std::int32_t bottom = first + width * inside(iy + 1, height, repeats);
    taps.upper_left[k] = top + left;
    taps.upper_right[k] = top + right;
    taps.lower_left[k] = bottom + left;
    taps.lower_right[k] = bottom + right;
  }
}

// within_period for every lane, and the level of detail, at most `coarsest`.
struct alignas(64) LaneLookups {
  std::array<float, kLanes> u = {}, v = {}, lod = {};
};

FSTOP_KERNEL float in_period(float x, bool repeats) {
  const float turned = std::abs(x) <= 1e6F ? x - std::floor(x) : 0.0F;
  const float clamped = x > -1.0F ? (x < 2.0F ? x : 2.0F) : -1.0F;
  return x == x ? (repeats ? turned : clamped) : 0.0F;
}

FSTOP_KERNEL void prepare(const std::array<float, kLanes>& u, const std::array<float, kLanes>& v,
                          const std::array<float, kLanes>& footprint, bool repeats, float coarsest,
                          LaneLookups& lookups) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    lookups.u[k] = in_period(u[k], repeats);
    lookups.v[k] = in_period(v[k], repeats);
    const float lod = fast_log2(footprint[k] > 1.0F ? footprint[k] : 1.0F);
    lookups.lod[k] = lod < coarsest ? lod : coarsest;
  }
}
FSTOP_AVX512 void prepare_wide(const std::array<float, kLanes>& u,
                               const std::array<float, kLanes>& v,
                               const std::array<float, kLanes>& footprint, bool repeats,
                               float coarsest, LaneLookups& lookups) {
  prepare(u, v, footprint, repeats, coarsest, lookups);
}

template <typename Taps>
FSTOP_AVX512 void find_taps_wide(std::int32_t width, std::int32_t height, std::int32_t first,
                                 bool repeats, const std::array<float, kLanes>& u,
                                 const std::array<float, kLanes>& v, Taps& taps) {
  find_taps(width, height, first, repeats, u, v, taps);
}

}  // namespace

Texture::Taps Texture::taps(const Level& level, const std::array<float, kLanes>& u,
                            const std::array<float, kLanes>& v) const noexcept {
  Taps result;
  const bool repeats = wrap_ == TextureWrap::repeat;
  const auto first = static_cast<std::int32_t>(level.first);
  if (has_avx512()) {
    find_taps_wide(level.width, level.height, first, repeats, u, v, result);
  } else {
    find_taps(level.width, level.height, first, repeats, u, v, result);
  }
  return result;
}

Texture::Texel Texture::blended(const Taps& taps, std::size_t k) const noexcept {
  const auto texel = [&](std::int32_t i) { return texels_[static_cast<std::size_t>(i)]; };
  const Texel upper = texel(taps.upper_left[k]);
  const Texel lower = texel(taps.lower_left[k]);
  const Texel top = upper + taps.across[k] * (texel(taps.upper_right[k]) - upper);
  const Texel bottom = lower + taps.across[k] * (texel(taps.lower_right[k]) - lower);
  return top + taps.down[k] * (bottom - top);
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
    const float lod = std::min(fast_log2(footprint), static_cast<float>(levels_.size() - 1));
    const auto finer = static_cast<std::size_t>(lod);
    const float blend = lod - static_cast<float>(finer);
    texel = bilinear(levels_[finer], u, v);
    if (blend > 0.0F) {
      texel += blend * (bilinear(levels_[finer + 1], u, v) - texel);
    }
  }
  return {texel[0], texel[1], texel[2]};
}

void Texture::sample(const LaneMask& valid, const std::array<float, kLanes>& u,
                     const std::array<float, kLanes>& v, const std::array<float, kLanes>& footprint,
                     LaneColors& colors) const noexcept {
  LaneLookups lookups;
  const bool repeats = wrap_ == TextureWrap::repeat;
  const auto coarsest = static_cast<float>(levels_.size() - 1);
  if (has_avx512()) {
    prepare_wide(u, v, footprint, repeats, coarsest, lookups);
  } else {
    prepare(u, v, footprint, repeats, coarsest, lookups);
  }
  // All lanes read one pair of levels, the finest that any needs: where a packet's footprints
  // differ by more than a level, lanes read too sharp rather than too soft.
  float finest = coarsest;
  float softest = 0.0F;
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float lod = lookups.lod[k];
    finest = valid[k] != 0 && lod < finest ? lod : finest;
    softest = valid[k] != 0 && lod > softest ? lod : softest;
  }
  if (filter_ == TextureFilter::nearest) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (valid[k] != 0) colors.set(static_cast<int>(k), sample(u[k], v[k], footprint[k]));
    }
    return;
  }
  const auto level = static_cast<std::size_t>(finest);
  const auto base = static_cast<float>(level);
  const Taps fine = taps(levels_[level], lookups.u, lookups.v);
  alignas(64) std::array<Texel, kLanes> texels;
  for (std::size_t k = 0; k < kLanes; ++k) texels[k] = blended(fine, k);
  if (softest > base) {
    const Taps coarse = taps(levels_[level + 1], lookups.u, lookups.v);
    for (std::size_t k = 0; k < kLanes; ++k) {
      const float blend = std::clamp(lookups.lod[k] - base, 0.0F, 1.0F);
      texels[k] += blend * (blended(coarse, k) - texels[k]);
    }
  }
  for (std::size_t k = 0; k < kLanes; ++k) {
    colors.r[k] = texels[k][0];
    colors.g[k] = texels[k][1];
    colors.b[k] = texels[k][2];
  }
}

}  // namespace fstop
