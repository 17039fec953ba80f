#include "core/sampling/patterns.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/sampling/sequence.h"

namespace fstop {
namespace {

using enum SamplePattern;
using Points = std::vector<std::array<double, 2>>;

constexpr std::array<SamplePattern, 4> kAll = {regular, jittered, poisson, poisson_disc};

TEST(Patterns, PointsAreAsManyAsAskedForAndInTheSquare) {
  for (const SamplePattern pattern : kAll) {
    for (const int count : {1, 2, 7, 16, 100, 256}) {
      const Points points = pattern_points(pattern, count, 5);
      ASSERT_EQ(points.size(), static_cast<std::size_t>(count));
      for (const auto& [x, y] : points) EXPECT_TRUE(x >= 0.0 && x < 1.0 && y >= 0.0 && y < 1.0);
    }
  }
}

TEST(Patterns, RegularIsTheGridsCentres) {
  const Points points = pattern_points(regular, 12, 1);  // 3 rows of 4
  for (int i = 0; i < 12; ++i) {
    EXPECT_DOUBLE_EQ(points[static_cast<std::size_t>(i)][0], (i % 4 + 0.5) / 4);
    EXPECT_DOUBLE_EQ(points[static_cast<std::size_t>(i)][1], (i / 4 + 0.5) / 3);
  }
}

TEST(Patterns, JitteredHasOnePointInEachCellAnywhereInIt) {
  // Over 400 patterns of 16: 400 points a cell, in 4 x 4 parts of it. Chi-square of 16 * 16 - 1
  // degrees of freedom: mean 255, standard deviation 22.6, so that 330 is passed once in 2000.
  std::array<int, 256> counts = {};
  for (std::uint32_t seed = 0; seed < 400; ++seed) {
    std::set<int> cells;
    for (const auto& [x, y] : pattern_points(jittered, 16, seed)) {
      cells.insert(static_cast<int>(4 * x) + 4 * static_cast<int>(4 * y));
      ++counts[static_cast<std::size_t>(static_cast<int>(16 * x) + 16 * static_cast<int>(16 * y))];
    }
    EXPECT_EQ(cells.size(), 16U);
  }
  double chi_square = 0.0;
  for (const int count : counts) chi_square += std::pow(count - 25.0, 2) / 25.0;
  EXPECT_LT(chi_square, 330.0);
}

// Random points leave gaps and clumps; darts that keep a distance reach 0.65 to 0.85 of the densest
// packing's (Lagae & Dutre 2008, section 4.1: what a Poisson-disc distribution should have).
TEST(Patterns, PoissonDiscsKeepTheirDistance) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    for (const int count : {16, 64, 256}) {
      EXPECT_GT(relative_radius(pattern_points(poisson_disc, count, seed)), 0.65) << count;
      EXPECT_LT(relative_radius(pattern_points(poisson, count, seed)), 0.5) << count;
    }
  }
  // By hand: 4 points of a grid are 1/2 apart, the densest sqrt(2/(4 sqrt 3)) = 0.5373.
  EXPECT_NEAR(relative_radius(pattern_points(regular, 4, 1)), 0.5 / 0.537285, 1e-5);
}

// Mean power at frequencies of a ring, a point's own power being 1.
double power(SamplePattern pattern, int count, double low, double high) {
  double sum = 0.0;
  int waves = 0;
  constexpr std::uint32_t kSets = 8;
  for (std::uint32_t seed = 0; seed < kSets; ++seed) {
    const Points points = pattern_points(pattern, count, seed + 77);
    for (int fx = -32; fx <= 32; ++fx) {
      for (int fy = 0; fy <= 32; ++fy) {
        const double frequency = std::hypot(fx, fy);
        if (frequency < low || frequency >= high) continue;
        std::complex<double> wave = 0.0;
        for (const auto& [x, y] : points) {
          wave += std::polar(1.0, -2.0 * std::numbers::pi * (fx * x + fy * y));
        }
        sum += std::norm(wave) / count;
        ++waves;
      }
    }
  }
  return sum / waves;
}

// Spectra by theory, 256 points: independent points are white, power 1 (800 waves and more with
// an exponential law each: standard error at most 0.036). A jittered grid's is
// 1 - sinc^2(fx/16) sinc^2(fy/16) off its own waves (Leneman 1966). A Poisson disc has hardly any
// below half of the frequency of its distance, a ring there, and is nearly white far beyond.
TEST(Patterns, SpectraAreThoseOfTheory) {
  EXPECT_NEAR(power(poisson, 256, 1.0, 8.0), 1.0, 0.1);
  EXPECT_NEAR(power(poisson, 256, 20.0, 30.0), 1.0, 0.1);
  EXPECT_LT(power(poisson_disc, 256, 1.0, 6.0), 0.15);
  EXPECT_GT(power(poisson_disc, 256, 17.0, 20.0), 1.2) << "the ring of its distance";
  EXPECT_NEAR(power(poisson_disc, 256, 26.0, 32.0), 1.0, 0.35) << "after that a damped wave";
  const auto sinc = [](double x) {
    return x == 0.0 ? 1.0 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
  };
  double theory = 0.0;
  int waves = 0;
  for (int fx = -32; fx <= 32; ++fx) {
    for (int fy = 0; fy <= 32; ++fy) {
      if (std::hypot(fx, fy) < 4.0 || std::hypot(fx, fy) >= 12.0) continue;
      theory += 1.0 - std::pow(sinc(fx / 16.0) * sinc(fy / 16.0), 2);
      ++waves;
    }
  }
  EXPECT_NEAR(power(jittered, 256, 4.0, 12.0), theory / waves, 0.08);
  EXPECT_NEAR(power(regular, 256, 1.0, 15.9), 0.0, 1e-20) << "only waves of the grid";
  EXPECT_NEAR(power(regular, 256, 16.0, 16.01), 256.0, 1e-6);
}

TEST(Patterns, TimesAreSpreadLikewise) {
  const std::vector<double> centres = pattern_times(regular, 4, 1);
  EXPECT_EQ(centres, (std::vector<double>{0.125, 0.375, 0.625, 0.875}));
  std::vector<double> spread = pattern_times(poisson_disc, 64, 3);
  std::ranges::sort(spread);
  double nearest = 1.0 - spread.back() + spread.front();
  for (std::size_t i = 1; i < spread.size(); ++i) {
    nearest = std::min(nearest, spread[i] - spread[i - 1]);
  }
  // Random darts of one length fill 0.7476 of a line when no more fit (Renyi 1958).
  EXPECT_GT(nearest * 64, 0.6);
  std::vector<double> cells = pattern_times(jittered, 32, 9);
  for (int i = 0; i < 32; ++i) {
    EXPECT_EQ(static_cast<int>(32 * cells[static_cast<std::size_t>(i)]), i);
  }
}

TEST(Patterns, PermutationsAreOneToOneAndDifferByKey) {
  for (const std::uint32_t count : {1U, 2U, 5U, 16U, 100U, 1024U}) {
    std::set<std::uint32_t> seen;
    for (std::uint32_t i = 0; i < count; ++i) seen.insert(permuted(i, count, 12345));
    EXPECT_EQ(seen.size(), count);
    EXPECT_LT(*seen.rbegin(), count);
  }
  int equal = 0;
  for (std::uint32_t i = 0; i < 1024; ++i) equal += permuted(i, 1024, 1) == permuted(i, 1024, 2);
  EXPECT_LT(equal, 10) << "one on average";
}

// The sequence hands out every point of the pattern once, to each pixel in an order of its own.
TEST(Patterns, SequencesDrawFromThem) {
  const PatternChoice choice{.pixel = jittered, .lens = poisson_disc, .time = regular};
  const PatternTables tables(choice, 16, 42);
  const SampleSequence sequence(42, &tables);
  std::array<std::set<int>, 2> cells;
  std::array<std::vector<double>, 2> orders;
  for (std::uint32_t pixel = 0; pixel < 2; ++pixel) {
    SampleKeys keys;
    keys.pixel.fill(pixel);
    for (std::uint32_t i = 0; i < kLanes; ++i) keys.index[i] = i;
    LaneValues x, y, time, u, v;
    sequence.fill(keys, Dimension::pixel_x, x);
    sequence.fill(keys, Dimension::pixel_y, y);
    sequence.fill(keys, Dimension::time, time);
    sequence.fill(keys, Dimension::lens_u, u);
    sequence.fill(keys, Dimension::lens_v, v);
    Points lens;
    std::set<int> times;
    const double offset = time[0] - std::floor(time[0] * 16.0) / 16.0;
    for (std::size_t i = 0; i < kLanes; ++i) {
      lens.push_back({u[i], v[i]});
      times.insert(static_cast<int>(std::floor(time[i] * 16.0)));
      EXPECT_NEAR(time[i] * 16.0 - std::floor(time[i] * 16.0), offset * 16.0, 1e-9);
    }
    EXPECT_EQ(times.size(), 16U) << "one in each sixteenth of the shutter";
    EXPECT_GT(relative_radius(lens), 0.65) << "moving a pattern around keeps its distances";
    orders[pixel].assign(x.begin(), x.end());
  }
  EXPECT_NE(orders[0], orders[1]);
}

TEST(Patterns, LanesGetWhatPacketsGet) {
  const PatternTables tables({.pixel = poisson_disc, .time = jittered}, 24, 7);
  const SampleSequence sequence(7, &tables);
  LaneWords pixels;
  for (std::uint32_t i = 0; i < kLanes; ++i) pixels[i] = 100 + i;
  for (const Dimension dimension :
       {Dimension::pixel_x, Dimension::pixel_y, Dimension::time, Dimension::lens_u}) {
    const LaneSequence lanes(sequence, dimension, pixels);
    for (std::uint32_t index = 0; index < 24; ++index) {
      SampleKeys keys;
      keys.pixel = pixels;
      keys.index.fill(index);
      LaneValues wanted;
      LaneFloats values;
      sequence.fill(keys, dimension, wanted);
      lanes.fill(index, values);
      for (std::size_t i = 0; i < kLanes; ++i) {
        EXPECT_NEAR(double{values[i]}, wanted[i], 0x1p-24);
        EXPECT_LT(values[i], 1.0F);
      }
    }
  }
}

TEST(Patterns, WhatCannotBeIsRefused) {
  EXPECT_THROW(pattern_points(low_discrepancy, 4, 1), Error);
  EXPECT_THROW(pattern_points(regular, 0, 1), Error);
  EXPECT_THROW(pattern_points(regular, kMostPatternSamples + 1, 1), Error);
  EXPECT_THROW(pattern_times(low_discrepancy, 4, 1), Error);
}

}  // namespace
}  // namespace fstop
