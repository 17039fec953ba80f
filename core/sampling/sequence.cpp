#include "core/sampling/sequence.h"

#include "core/sampling/patterns.h"
#include "core/sampling/scramble.h"
#include "core/simd.h"

namespace fstop {
namespace {

struct Polynomial {
  int degree = 0;
  std::uint32_t coefficients = 0;
  std::array<std::uint32_t, 4> initial = {};
};

// Primitive polynomials and initial direction numbers of dimensions 2 to 7 (dimension 1 is the
// van der Corput sequence). Joe & Kuo, SIAM J. Sci. Comput. 30, 2635 (2008), file new-joe-kuo-6.
constexpr std::array<Polynomial, kDimensions - 1> kPolynomials = {{{1, 0, {1}},
                                                                   {2, 1, {1, 3}},
                                                                   {3, 1, {1, 3, 1}},
                                                                   {3, 2, {1, 1, 1}},
                                                                   {4, 1, {1, 1, 3, 3}},
                                                                   {4, 4, {1, 3, 5, 13}}}};

using Directions = std::array<std::uint32_t, 32>;

constexpr Directions directions_of(int dimension) {
  Directions v = {};
  if (dimension == 0) {
    for (int i = 0; i < 32; ++i) v[static_cast<std::size_t>(i)] = 1U << (31 - i);
    return v;
  }
  const Polynomial& p = kPolynomials[static_cast<std::size_t>(dimension - 1)];
  for (int i = 0; i < 32; ++i) {
    std::uint32_t direction = 0;
    if (i < p.degree) {
      direction = p.initial[static_cast<std::size_t>(i)] << (31 - i);
    } else {
      const std::uint32_t oldest = v[static_cast<std::size_t>(i - p.degree)];
      direction = oldest ^ (oldest >> p.degree);
      for (int k = 1; k < p.degree; ++k) {
        const std::uint32_t bit = (p.coefficients >> (p.degree - 1 - k)) & 1U;
        direction ^= bit * v[static_cast<std::size_t>(i - k)];
      }
    }
    v[static_cast<std::size_t>(i)] = direction;
  }
  return v;
}

// Unscrambled Sobol coordinates with their bits reversed, as the scramble wants them, for each
// byte of the index: the coordinate of an index is the XOR of its four bytes' entries.
using ByteTable = std::array<std::array<std::uint32_t, 256>, 4>;

constexpr ByteTable byte_table_of(int dimension) {
  const Directions directions = directions_of(dimension);
  ByteTable table = {};
  for (std::size_t byte = 0; byte < 4; ++byte) {
    for (std::size_t value = 0; value < 256; ++value) {
      std::uint32_t point = 0;
      for (std::size_t bit = 0; bit < 8; ++bit) {
        if ((value >> bit) & 1U) point ^= directions[8 * byte + bit];
      }
      table[byte][value] = reversed(point);
    }
  }
  return table;
}

constexpr std::array<ByteTable, kDimensions> kTables = {
    byte_table_of(0), byte_table_of(1), byte_table_of(2), byte_table_of(3),
    byte_table_of(4), byte_table_of(5), byte_table_of(6)};

std::uint32_t sobol_bits(std::size_t dimension, std::uint32_t index) {
  const ByteTable& table = kTables[dimension];
  return table[0][index & 255U] ^ table[1][(index >> 8) & 255U] ^ table[2][(index >> 16) & 255U] ^
         table[3][index >> 24];
}

constexpr std::uint32_t stream_key(std::uint32_t stream, std::uint32_t pixel) {
  return mixed(stream + pixel * 0x85157af5U);
}

FSTOP_KERNEL void scramble_one(std::uint32_t bits, const LaneWords& keys, LaneFloats& values) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const std::uint32_t word = reversed(scrambled(bits, keys[i])) >> 8;
    values[i] = static_cast<float>(static_cast<std::int32_t>(word)) * 0x1p-24F;
  }
}
FSTOP_AVX512 void scramble_one_wide(std::uint32_t bits, const LaneWords& keys, LaneFloats& values) {
  scramble_one(bits, keys, values);
}

FSTOP_KERNEL void scramble_all(const LaneWords& bits, const LaneWords& pixels, std::uint32_t stream,
                               LaneValues& values) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const std::uint32_t word = reversed(scrambled(bits[i], stream_key(stream, pixels[i])));
    values[i] = static_cast<double>(word) * 0x1p-32;
  }
}
FSTOP_AVX512 void scramble_all_wide(const LaneWords& bits, const LaneWords& pixels,
                                    std::uint32_t stream, LaneValues& values) {
  scramble_all(bits, pixels, stream, values);
}

// Which coordinate of a pattern a dimension is.
struct PatternAxis {
  PatternTables::Pair pair = PatternTables::Pair::pixel;
  int axis = 0;
};

// Null where the dimension has no pattern.
const PatternTables* tables_for(const PatternTables* patterns, std::size_t dimension,
                                PatternAxis& place) {
  using Pair = PatternTables::Pair;
  if (patterns == nullptr) return nullptr;
  switch (static_cast<Dimension>(dimension)) {
    case Dimension::lens_u:
    case Dimension::lens_v:
      place = {Pair::lens, static_cast<Dimension>(dimension) == Dimension::lens_v ? 1 : 0};
      break;
    case Dimension::pixel_x:
    case Dimension::pixel_y:
      place = {Pair::pixel, static_cast<Dimension>(dimension) == Dimension::pixel_y ? 1 : 0};
      break;
    case Dimension::time:
      place = {Pair::time, 0};
      break;
    case Dimension::light_u:
    case Dimension::light_v:
      return nullptr;
  }
  return patterns->has(place.pair) ? patterns : nullptr;
}

}  // namespace

std::uint32_t hash_of(std::uint32_t a, std::uint32_t b) noexcept { return hashed(a, b); }

void SampleSequence::fill(const SampleKeys& keys, Dimension dimension,
                          LaneValues& values) const noexcept {
  const auto d = static_cast<std::size_t>(dimension);
  PatternAxis place;
  if (const PatternTables* tables = tables_for(patterns_, d, place)) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      values[i] = tables->value(place.pair, place.axis, keys.pixel[i], keys.index[i]);
    }
    return;
  }
  const std::uint32_t stream = hash_of(seed_, static_cast<std::uint32_t>(d));
  alignas(64) LaneWords bits;
  for (std::size_t i = 0; i < kLanes; ++i) bits[i] = sobol_bits(d, keys.index[i]);
  if (has_avx512()) return scramble_all_wide(bits, keys.pixel, stream, values);
  scramble_all(bits, keys.pixel, stream, values);
}

float SampleSequence::decision(std::uint32_t stream, std::uint32_t index) const noexcept {
  const std::uint32_t key = stream_key(hash_of(seed_, kDimensions), stream);
  // The van der Corput sequence, its bits reversed, is the index.
  return static_cast<float>(reversed(scrambled(index, key)) >> 8U) * 0x1p-24F;
}

LaneSequence::LaneSequence(const SampleSequence& sequence, Dimension dimension,
                           const LaneWords& pixels) noexcept
    : dimension_(static_cast<std::size_t>(dimension)) {
  PatternAxis place;
  patterns_ = tables_for(sequence.patterns_, dimension_, place);
  if (patterns_ != nullptr) {
    keys_ = pixels;
    return;
  }
  const std::uint32_t stream = hash_of(sequence.seed_, static_cast<std::uint32_t>(dimension));
  for (std::size_t i = 0; i < kLanes; ++i) keys_[i] = stream_key(stream, pixels[i]);
}

void LaneSequence::fill(std::uint32_t index, LaneFloats& values) const noexcept {
  if (patterns_ != nullptr) {
    PatternAxis place;
    tables_for(patterns_, dimension_, place);
    for (std::size_t i = 0; i < kLanes; ++i) {
      const double value = patterns_->value(place.pair, place.axis, keys_[i], index);
      values[i] = static_cast<float>(static_cast<std::int32_t>(value * 0x1p24)) * 0x1p-24F;
    }
    return;
  }
  const std::uint32_t bits = sobol_bits(dimension_, index);
  if (has_avx512()) return scramble_one_wide(bits, keys_, values);
  scramble_one(bits, keys_, values);
}

}  // namespace fstop
