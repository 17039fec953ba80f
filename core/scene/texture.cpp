#include "core/scene/texture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/fast_math.h"
#include "core/sampling/sequence.h"

namespace fstop {
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

namespace {

// Where one axis of a lookup starts, 0 to size - 1, and how much of the next texel it takes. `x`
// in [-1/2, size - 1/2) where the texture repeats.
FSTOP_KERNEL std::int32_t first_texel(float x, std::int32_t size, bool repeats, float& share) {
  const float last = static_cast<float>(size - 1);
  const float clamped = x > 0.0F ? (x < last ? x : last) : 0.0F;
  const float inside = repeats ? x : clamped;
  const float whole = std::floor(inside);
  share = inside - whole;
  const auto i = static_cast<std::int32_t>(whole);
  return i < 0 ? i + size : i;
}

// A texel; with its right neighbour.
using One [[gnu::vector_size(16)]] = float;
using Two [[gnu::vector_size(32)]] = float;

// A level of the pyramid: its first texel and its size.
struct Plane {
  const One* texels = nullptr;
  std::int32_t width = 0;
  std::int32_t height = 0;
  std::int32_t stride = 0;  // texels from row to row
};

// A packet's lookups in one level: the texel at the upper left of each, and how the four mix.
struct alignas(64) Taps {
  // Not initialised: find_taps fills all.
  std::array<std::int32_t, kLanes> offset;
  std::array<float, kLanes> across, down;
};

FSTOP_KERNEL void find_taps(const Plane& plane, bool repeats, const std::array<float, kLanes>& u,
                            const std::array<float, kLanes>& v, Taps& taps) {
  const std::int32_t width = plane.width;
  const std::int32_t height = plane.height;
  const std::int32_t stride = plane.stride;
  const auto w = static_cast<float>(width);
  const auto h = static_cast<float>(height);
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float x = u[k] * w - 0.5F;
    const float y = (1.0F - v[k]) * h - 0.5F;
    const std::int32_t column = first_texel(x, width, repeats, taps.across[k]);
    const std::int32_t row = first_texel(y, height, repeats, taps.down[k]);
    taps.offset[k] = row * stride + column;
  }
}

// within_period for every lane, and the level of detail, at most `coarsest`.
struct alignas(64) LaneLookups {
  // Not initialised: prepare fills all.
  std::array<float, kLanes> u, v, lod;
  float finest = 0.0F;  // of the valid lanes
  float softest = 0.0F;
};

FSTOP_KERNEL float in_period(float x, bool repeats) {
  const float turned = std::abs(x) <= 1e6F ? x - std::floor(x) : 0.0F;
  const float clamped = x > -1.0F ? (x < 2.0F ? x : 2.0F) : -1.0F;
  return x == x ? (repeats ? turned : clamped) : 0.0F;
}

FSTOP_KERNEL void prepare(const LaneMask& valid, const std::array<float, kLanes>& u,
                          const std::array<float, kLanes>& v,
                          const std::array<float, kLanes>& footprint, bool repeats, float coarsest,
                          LaneLookups& lookups) {
  std::int32_t any_larger = 0;
  for (std::size_t k = 0; k < kLanes; ++k) {
    lookups.u[k] = in_period(u[k], repeats);
    lookups.v[k] = in_period(v[k], repeats);
    // In a loop of its own, as gcc would branch around the logarithm of 1.
    lookups.lod[k] = footprint[k] > 1.0F ? footprint[k] : 1.0F;
    any_larger |= footprint[k] > 1.0F ? valid[k] : 0;
  }
  if (any_larger == 0) return;  // most packets: the full image
  // Numbers that are not negative are ordered as their bits; whole numbers' extremes vectorise.
  auto finest = std::bit_cast<std::int32_t>(coarsest);
  std::int32_t softest = 0;
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float exact = fast_log2(lookups.lod[k]);
    lookups.lod[k] = exact < coarsest ? exact : coarsest;
  }
  for (std::size_t k = 0; k < kLanes; ++k) {
    const auto bits = std::bit_cast<std::int32_t>(lookups.lod[k]);
    finest = std::min(finest, valid[k] != 0 ? bits : 0x7f800000);
    softest = std::max(softest, valid[k] != 0 ? bits : 0);
  }
  lookups.finest = std::bit_cast<float>(finest);
  lookups.softest = std::bit_cast<float>(softest);
}

FSTOP_KERNEL One mix(const One* upper_left, std::size_t stride, float across, float down) {
  Two upper, lower;
  std::memcpy(&upper, upper_left, sizeof upper);
  std::memcpy(&lower, upper_left + stride, sizeof lower);
  const Two rows = upper + down * (lower - upper);
  const One left = __builtin_shufflevector(rows, rows, 0, 1, 2, 3);
  const One right = __builtin_shufflevector(rows, rows, 4, 5, 6, 7);
  return left + across * (right - left);
}

}  // namespace

Texture::Texel Texture::bilinear(const Level& level, float u, float v) const noexcept {
  const bool repeats = wrap_ == TextureWrap::repeat;
  float across = 0.0F;
  float down = 0.0F;
  const int x =
      first_texel(u * static_cast<float>(level.width) - 0.5F, level.width, repeats, across);
  const int y = first_texel((1.0F - v) * static_cast<float>(level.height) - 0.5F, level.height,
                            repeats, down);
  return mix(
      &texels_[level.first + static_cast<std::size_t>(y) * static_cast<std::size_t>(level.stride) +
               static_cast<std::size_t>(x)],
      static_cast<std::size_t>(level.stride), across, down);
}

Texture::Texel Texture::nearest(float u, float v) const noexcept {
  const Level& level = levels_.front();
  const int x =
      wrapped(static_cast<int>(std::floor(u * static_cast<float>(level.width))), level.width);
  const int y = wrapped(static_cast<int>(std::floor((1.0F - v) * static_cast<float>(level.height))),
                        level.height);
  return texels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(level.stride) +
                 static_cast<std::size_t>(x)];
}

Texture::Texel Texture::mean_of_square(float u, float v, float side) const noexcept {
  const Level& full = levels_.front();
  // Where the image goes on as it ends, the square may lie far outside; beyond this, all is edge.
  const auto bounded = [](float uv) { return std::clamp(double{uv}, -1e9, 1e9); };
  const double x = bounded(u) * full.width;
  const double y = (1.0 - bounded(v)) * full.height;
  const Rgb mean = sums_->mean(x, y, double{side}, double{side});
  return Texel{mean[0], mean[1], mean[2], 0.0F};
}

Texture::Texel Texture::any_of_square(float u, float v, float side) const noexcept {
  const Level& full = levels_.front();
  const std::uint32_t hash =
      hash_of(std::bit_cast<std::uint32_t>(u), std::bit_cast<std::uint32_t>(v));
  const float across = static_cast<float>(hash >> 16) * 0x1p-16F - 0.5F;
  const float down = static_cast<float>(hash & 0xffffU) * 0x1p-16F - 0.5F;
  return nearest(within_period(u + across * side / static_cast<float>(full.width), wrap_),
                 within_period(v + down * side / static_cast<float>(full.height), wrap_));
}

Rgb Texture::sample(float u, float v, float footprint) const noexcept {
  // Where an image goes on as it ends, a square's place beyond the edge matters.
  const bool far = wrap_ == TextureWrap::clamp &&
                   (filter_ == TextureFilter::summed_area || filter_ == TextureFilter::stochastic);
  u = far && u == u ? u : within_period(u, wrap_);
  v = far && v == v ? v : within_period(v, wrap_);
  Texel texel = {};
  if (filter_ == TextureFilter::nearest) {
    texel = nearest(u, v);
  } else if (filter_ == TextureFilter::summed_area) {
    texel = mean_of_square(u, v, footprint > 1.0F ? footprint : 1.0F);
  } else if (filter_ == TextureFilter::stochastic) {
    texel = any_of_square(u, v, footprint > 1.0F ? footprint : 1.0F);
  } else if (!has_pyramid() || !(footprint > 1.0F)) {
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

namespace {

// One or two levels that all lanes read. Where a packet's footprints differ by more than a level,
// lanes read too sharp rather than too soft.
struct Planes {
  Plane fine = {};
  Plane coarse = {};
  float base = 0.0F;  // the level of detail of `fine`
  bool blends = false;
};

FSTOP_KERNEL float share_of_coarse(float lod, float base) {
  const float share = lod - base;
  return share > 0.0F ? (share < 1.0F ? share : 1.0F) : 0.0F;
}

// Four lanes' texels to four lanes of each channel.
FSTOP_KERNEL void store_four(const One (&t)[4], float* r, float* g, float* b) {
  const One rg01 = __builtin_shufflevector(t[0], t[1], 0, 4, 1, 5);
  const One rg23 = __builtin_shufflevector(t[2], t[3], 0, 4, 1, 5);
  const One b01 = __builtin_shufflevector(t[0], t[1], 2, 6, 3, 7);
  const One b23 = __builtin_shufflevector(t[2], t[3], 2, 6, 3, 7);
  const One red = __builtin_shufflevector(rg01, rg23, 0, 1, 4, 5);
  const One green = __builtin_shufflevector(rg01, rg23, 2, 3, 6, 7);
  const One blue = __builtin_shufflevector(b01, b23, 0, 1, 4, 5);
  std::memcpy(r, &red, sizeof red);
  std::memcpy(g, &green, sizeof green);
  std::memcpy(b, &blue, sizeof blue);
}

void look_up(const Planes& planes, bool repeats, const LaneLookups& lookups, LaneColors& colors) {
  Taps fine;
  Taps coarse;
  const auto stride = static_cast<std::size_t>(planes.fine.stride);
  const auto coarse_stride = static_cast<std::size_t>(planes.coarse.stride);
  find_taps(planes.fine, repeats, lookups.u, lookups.v, fine);
  if (planes.blends) {
    find_taps(planes.coarse, repeats, lookups.u, lookups.v, coarse);
  }
  for (std::size_t first = 0; first < kLanes; first += 4) {
    One texels[4];
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t k = first + i;
      texels[i] = mix(planes.fine.texels + fine.offset[k], stride, fine.across[k], fine.down[k]);
      if (!planes.blends) continue;
      const One softer = mix(planes.coarse.texels + coarse.offset[k], coarse_stride,
                             coarse.across[k], coarse.down[k]);
      texels[i] += share_of_coarse(lookups.lod[k], planes.base) * (softer - texels[i]);
    }
    store_four(texels, &colors.r[first], &colors.g[first], &colors.b[first]);
  }
}

// Four lanes in one register: the same operations on every number as look_up.
using Four [[gnu::vector_size(64)]] = float;

template <typename Vector>
FSTOP_AVX512 inline Vector load(const void* from) {
  Vector vector;
  std::memcpy(&vector, from, sizeof vector);
  return vector;
}

// The numbers of four lanes, first to first + 3, each for a lane's four channels; and those of two.
using Order [[gnu::vector_size(64)]] = std::int32_t;
FSTOP_AVX512 inline Four of_four(Four lanes, std::int32_t first) {
  constexpr Order kEach = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
  return __builtin_shuffle(lanes, kEach + first);
}
FSTOP_AVX512 inline Four of_two(Four lanes, std::int32_t first) {
  constexpr Order kEach = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};
  return __builtin_shuffle(lanes, kEach + first);
}

FSTOP_AVX512 inline Four two_rows(const One* texels, std::int32_t i, std::int32_t j) {
  return __builtin_shufflevector(load<Two>(texels + i), load<Two>(texels + j), 0, 1, 2, 3, 4, 5, 6,
                                 7, 8, 9, 10, 11, 12, 13, 14, 15);
}

// Lanes first to first + 3.
FSTOP_AVX512 inline Four mix_four(const One* texels, std::size_t stride, const Taps& taps,
                                  std::int32_t first) {
  const std::int32_t* at = &taps.offset[static_cast<std::size_t>(first)];
  const Four down = load<Four>(taps.down.data());
  const Four across = load<Four>(taps.across.data());
  const Four upper01 = two_rows(texels, at[0], at[1]);
  const Four lower01 = two_rows(texels + stride, at[0], at[1]);
  const Four upper23 = two_rows(texels, at[2], at[3]);
  const Four lower23 = two_rows(texels + stride, at[2], at[3]);
  const Four rows01 = upper01 + of_two(down, first) * (lower01 - upper01);
  const Four rows23 = upper23 + of_two(down, first + 2) * (lower23 - upper23);
  const Four left = __builtin_shufflevector(rows01, rows23, 0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18,
                                            19, 24, 25, 26, 27);
  const Four right = __builtin_shufflevector(rows01, rows23, 4, 5, 6, 7, 12, 13, 14, 15, 20, 21, 22,
                                             23, 28, 29, 30, 31);
  return left + of_four(across, first) * (right - left);
}

// Sixteen lanes' texels, four a register, to the three channels.
FSTOP_AVX512 inline void store_all(const Four (&t)[4], LaneColors& colors) {
  const Four rg01 =
      __builtin_shufflevector(t[0], t[1], 0, 4, 8, 12, 16, 20, 24, 28, 1, 5, 9, 13, 17, 21, 25, 29);
  const Four rg23 =
      __builtin_shufflevector(t[2], t[3], 0, 4, 8, 12, 16, 20, 24, 28, 1, 5, 9, 13, 17, 21, 25, 29);
  const Four b01 = __builtin_shufflevector(t[0], t[1], 2, 6, 10, 14, 18, 22, 26, 30, 2, 6, 10, 14,
                                           18, 22, 26, 30);
  const Four b23 = __builtin_shufflevector(t[2], t[3], 2, 6, 10, 14, 18, 22, 26, 30, 2, 6, 10, 14,
                                           18, 22, 26, 30);
  const Four red =
      __builtin_shufflevector(rg01, rg23, 0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23);
  const Four green = __builtin_shufflevector(rg01, rg23, 8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26,
                                             27, 28, 29, 30, 31);
  const Four blue =
      __builtin_shufflevector(b01, b23, 0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23);
  std::memcpy(colors.r.data(), &red, sizeof red);
  std::memcpy(colors.g.data(), &green, sizeof green);
  std::memcpy(colors.b.data(), &blue, sizeof blue);
}

FSTOP_AVX512 void look_up_wide(const Planes& planes, bool repeats, const LaneLookups& lookups,
                               LaneColors& colors) {
  const auto stride = static_cast<std::size_t>(planes.fine.stride);
  Taps taps;
  Four texels[4];
  find_taps(planes.fine, repeats, lookups.u, lookups.v, taps);
  for (std::int32_t i = 0; i < 4; ++i) {
    texels[i] = mix_four(planes.fine.texels, stride, taps, 4 * i);
  }
  if (planes.blends) {
    const auto coarse_stride = static_cast<std::size_t>(planes.coarse.stride);
    alignas(64) std::array<float, kLanes> share;
    for (std::size_t k = 0; k < kLanes; ++k) {
      share[k] = share_of_coarse(lookups.lod[k], planes.base);
    }
    find_taps(planes.coarse, repeats, lookups.u, lookups.v, taps);
    for (std::int32_t i = 0; i < 4; ++i) {
      const Four softer = mix_four(planes.coarse.texels, coarse_stride, taps, 4 * i);
      texels[i] += of_four(load<Four>(share.data()), 4 * i) * (softer - texels[i]);
    }
  }
  store_all(texels, colors);
}

}  // namespace

template <bool kWide>
FSTOP_KERNEL void Texture::sample_lanes(const LaneMask& valid, const std::array<float, kLanes>& u,
                                        const std::array<float, kLanes>& v,
                                        const std::array<float, kLanes>& footprint,
                                        LaneColors& colors) const noexcept {
  LaneLookups lookups;
  const bool repeats = wrap_ == TextureWrap::repeat;
  prepare(valid, u, v, footprint, repeats, static_cast<float>(levels_.size() - 1), lookups);
  const auto finest = static_cast<std::size_t>(lookups.finest);
  const auto plane = [&](std::size_t i) {
    const Level& level = levels_[i];
    return Plane{&texels_[level.first], level.width, level.height, level.stride};
  };
  Planes planes{.fine = plane(finest), .base = static_cast<float>(finest)};
  planes.blends = lookups.softest > planes.base;
  if (planes.blends) planes.coarse = plane(finest + 1);
  if constexpr (kWide) {
    look_up_wide(planes, repeats, lookups, colors);
  } else {
    look_up(planes, repeats, lookups, colors);
  }
}

FSTOP_AVX512 void Texture::sample_wide(const LaneMask& valid, const std::array<float, kLanes>& u,
                                       const std::array<float, kLanes>& v,
                                       const std::array<float, kLanes>& footprint,
                                       LaneColors& colors) const noexcept {
  sample_lanes<true>(valid, u, v, footprint, colors);
}

void Texture::sample(const LaneMask& valid, const std::array<float, kLanes>& u,
                     const std::array<float, kLanes>& v, const std::array<float, kLanes>& footprint,
                     LaneColors& colors) const noexcept {
  const bool one_by_one = filter_ == TextureFilter::nearest ||
                          filter_ == TextureFilter::summed_area ||
                          filter_ == TextureFilter::stochastic;
  if (one_by_one) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (valid[k] != 0) colors.set(static_cast<int>(k), sample(u[k], v[k], footprint[k]));
    }
    return;
  }
  if (has_avx512()) return sample_wide(valid, u, v, footprint, colors);
  sample_lanes<false>(valid, u, v, footprint, colors);
}

}  // namespace fstop
