#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace fstop {

/// Samples travel in packets of this many lanes, one per Embree ray of a packet.
inline constexpr int kLanes = 16;
inline constexpr std::uint32_t kAllLanes = (1U << kLanes) - 1U;  // by bits

/// What a dimension of the sampling space decides. Lens and pixel take the first four
/// dimensions of the Sobol sequence, whose projections are the best stratified.
enum class Dimension { lens_u, lens_v, pixel_x, pixel_y, light_u, light_v, time };
inline constexpr int kDimensions = 7;

/// Which sample each lane is: index `index[i]` of pixel number `pixel[i]`.
struct SampleKeys {
  alignas(64) std::array<std::uint32_t, kLanes> pixel = {};
  alignas(64) std::array<std::uint32_t, kLanes> index = {};
};

/// One coordinate of every lane, in [0, 1).
using LaneValues = std::array<double, kLanes>;
/// The same in single precision: multiples of 2^-24, so that none rounds up to 1.
using LaneFloats = std::array<float, kLanes>;
using LaneWords = std::array<std::uint32_t, kLanes>;

class PatternTables;

/// Points of the Sobol sequence, nested-uniformly scrambled (Owen) by a hash of
/// (seed, pixel, dimension): a sample is a pure function of its key, so an image never depends
/// on the order or the threads it was computed in. Any 2^k consecutive aligned indices of a
/// pixel are a digital net of their own. Dimensions that `patterns` has come from there instead.
/// Source: Sobol 1967 with the direction numbers of Joe & Kuo 2008; Owen 1995; the hashed
///         scramble of Laine & Karras 2011 as improved by Burley 2020, constants by Vegdahl 2021.
class SampleSequence {
 public:
  /// `patterns`: null, or tables that outlive the sequence.
  explicit SampleSequence(std::uint32_t seed, const PatternTables* patterns = nullptr) noexcept
      : seed_(seed), patterns_(patterns) {}

  /// Fills `values` with coordinate `dimension` of the samples `keys`.
  void fill(const SampleKeys& keys, Dimension dimension, LaneValues& values) const noexcept;

  /// A number in [0, 1) for one decision of sample `index` of a stream: any 2^k consecutive aligned
  /// indices have one in each interval of 2^-k.
  float decision(std::uint32_t stream, std::uint32_t index) const noexcept;

 private:
  friend class LaneSequence;
  std::uint32_t seed_;
  const PatternTables* patterns_;
};

/// One dimension of kLanes pixels' sequences, each pixel's scramble prepared once for many samples.
class LaneSequence {
 public:
  LaneSequence(const SampleSequence& sequence, Dimension dimension,
               const LaneWords& pixels) noexcept;

  /// Coordinates of sample `index` of every pixel: SampleSequence::fill's upper 24 bits.
  void fill(std::uint32_t index, LaneFloats& values) const noexcept;

 private:
  alignas(64) LaneWords keys_ = {};
  std::size_t dimension_;
  // Where the dimension has a pattern: keys_ are the pixels.
  const PatternTables* patterns_ = nullptr;
};

/// A 32-bit word that looks random and depends on every bit of both arguments.
std::uint32_t hash_of(std::uint32_t a, std::uint32_t b) noexcept;

}  // namespace fstop
