#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace fstop {

/// How a pixel's samples are spread over one pair of dimensions.
enum class SamplePattern {
  low_discrepancy,  ///< the Owen-scrambled Sobol sequence, over all dimensions at once
  regular,          ///< the centres of a grid, moved as a whole by one offset for the picture
  jittered,         ///< one point anywhere in each cell of that grid
  poisson,          ///< independent points
  poisson_disc,     ///< random points that keep a distance
};

/// One pattern for each of what a sample chooses. Light is always sampled by the sequence.
struct PatternChoice {
  SamplePattern pixel = SamplePattern::low_discrepancy;
  SamplePattern lens = SamplePattern::low_discrepancy;
  SamplePattern time = SamplePattern::low_discrepancy;

  bool any() const noexcept {
    return pixel != SamplePattern::low_discrepancy || lens != SamplePattern::low_discrepancy ||
           time != SamplePattern::low_discrepancy;
  }
};

/// Samples of a pixel that a pattern can have.
inline constexpr int kMostPatternSamples = 1024;

/// `count` points of the unit square, as on a torus. The grid of regular and jittered has as many
/// rows as the largest divisor of `count` up to its root: squares of numbers give square cells.
/// Poisson-disc: darts are thrown at a distance that shrinks until all have found a place, so that
/// no two points are nearer than some 0.7 of what the densest packing allows.
/// Throws: Error{outside_domain} for low_discrepancy, which is no set of points, and unless
///         1 <= count <= kMostPatternSamples.
/// Source: Cook 1986 (jitter, Poisson disc); McCool & Fiume 1992 (shrinking distance); Lagae &
///         Dutre 2008 (the measure of distance).
std::vector<std::array<double, 2>> pattern_points(SamplePattern pattern, int count,
                                                  std::uint32_t seed);
/// The same in one dimension, on a circle.
std::vector<double> pattern_times(SamplePattern pattern, int count, std::uint32_t seed);

/// The distance of the nearest two of `points` on the torus over that of the densest packing of as
/// many, sqrt(2/(sqrt(3) n)): 0 to 1.
double relative_radius(const std::vector<std::array<double, 2>>& points);

/// A permutation of 0 to count - 1, one for each key. Source: Kensler 2013.
std::uint32_t permuted(std::uint32_t index, std::uint32_t count, std::uint32_t key) noexcept;

/// The points that all pixels of a picture draw from. Every pixel takes them in an order of its own
/// for each pair of dimensions, so that a pattern in one does not line up with that in another, and
/// moved around the torus by an offset of its own; a regular grid has one offset for the picture.
class PatternTables {
 public:
  /// `count`: samples of every pixel. Throws: as pattern_points.
  PatternTables(const PatternChoice& choice, int count, std::uint32_t seed);

  enum class Pair { pixel, lens, time };
  bool has(Pair pair) const noexcept { return !table(pair).empty(); }
  /// Coordinate `axis` (0, 1; time has only 0) of sample `index` < count of `pixel`, in [0, 1).
  double value(Pair pair, int axis, std::uint32_t pixel, std::uint32_t index) const noexcept;

 private:
  const std::vector<std::array<double, 2>>& table(Pair pair) const noexcept {
    return tables_[static_cast<std::size_t>(pair)];
  }

  std::array<std::vector<std::array<double, 2>>, 3> tables_ = {};
  std::array<bool, 3> is_regular_ = {};
  std::uint32_t seed_;
};

}  // namespace fstop
