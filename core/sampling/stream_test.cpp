#include "core/sampling/stream.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "tests/references/oracle.h"

namespace fstop {
namespace {

struct Points {
  std::vector<double> u = {};
  std::vector<double> v = {};
  std::vector<double> chance = {};
};

// Samples 0 to `count` - 1 of one pixel.
Points points(std::uint32_t stream, std::uint32_t count) {
  const SampleSequence sequence(5);
  Points result;
  SampleKeys keys;
  keys.pixel.fill(77);
  for (std::uint32_t first = 0; first < count; first += kLanes) {
    for (std::uint32_t k = 0; k < kLanes; ++k) keys.index[k] = first + k;
    const SampleKeys own = stream_keys(keys, stream);
    LaneValues u, v;
    sequence.fill(own, Dimension::light_u, u);
    sequence.fill(own, Dimension::light_v, v);
    result.u.insert(result.u.end(), u.begin(), u.end());
    result.v.insert(result.v.end(), v.begin(), v.end());
    for (std::size_t k = 0; k < kLanes; ++k) {
      result.chance.push_back(double{sequence.decision(own.pixel[k], own.index[k])});
    }
  }
  return result;
}

// Chi-square's tail for pairs in 8 x 8 cells.
double uniformity(const std::vector<double>& x, const std::vector<double>& y) {
  constexpr std::size_t kCells = 8;
  std::vector<double> hits(kCells * kCells);
  for (std::size_t i = 0; i < x.size(); ++i) {
    hits[static_cast<std::size_t>(x[i] * kCells) * kCells +
         static_cast<std::size_t>(y[i] * kCells)] += 1.0;
  }
  const double expected = static_cast<double>(x.size()) / static_cast<double>(hits.size());
  double chi_square = 0.0;
  for (const double h : hits) chi_square += (h - expected) * (h - expected) / expected;
  return oracle::chi_square_tail(chi_square, static_cast<int>(hits.size()) - 1);
}

TEST(Stream, AlignedBlocksAreStratified) {
  constexpr std::uint32_t kCount = 256;
  constexpr std::uint32_t kBlock = 32;
  const Points all = points(3, kCount);
  for (const std::vector<double>* coordinate : {&all.u, &all.v, &all.chance}) {
    for (std::uint32_t first = 0; first < kCount; first += kBlock) {
      std::vector<int> hits(kBlock);
      for (std::uint32_t i = first; i < first + kBlock; ++i) {
        ++hits[static_cast<std::size_t>((*coordinate)[i] * kBlock)];
      }
      EXPECT_EQ(std::ranges::count(hits, 1), kBlock) << first;
    }
  }
}

// Of one pixel: a path's turns see all pairs of coordinates. Streams that only scramble the same
// points fill a curve.
TEST(Stream, StreamsOfOnePixelAreIndependent) {
  constexpr std::uint32_t kCount = 4096;  // 64 expected in a cell
  const double significance = oracle::sidak_significance(4);
  const Points a = points(0, kCount);
  const Points b = points(1, kCount);
  EXPECT_GT(uniformity(a.u, b.u), significance);
  EXPECT_GT(uniformity(a.v, b.v), significance);
  EXPECT_GT(uniformity(a.chance, b.chance), significance);
  EXPECT_GT(uniformity(a.u, b.v), significance);
}

TEST(Stream, ShufflesKeepAlignedBlocks) {
  for (std::uint32_t key = 1; key < 2000; key += 37) {
    for (const std::uint32_t size : {2U, 16U, 1024U}) {
      std::vector<std::uint32_t> seen;
      for (std::uint32_t i = 0; i < size; ++i) seen.push_back(shuffled(5 * size + i, key));
      std::ranges::sort(seen);
      EXPECT_EQ(seen.front() % size, 0U);
      for (std::uint32_t i = 0; i < size; ++i) ASSERT_EQ(seen[i], seen.front() + i);
    }
  }
}

}  // namespace
}  // namespace fstop
