#include "core/sampling/sequence.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr Dimension kEveryDimension[] = {Dimension::lens_u,  Dimension::lens_v,  Dimension::pixel_x,
                                         Dimension::pixel_y, Dimension::light_u, Dimension::light_v,
                                         Dimension::time};

struct Stream {
  std::uint32_t seed = 0;
  std::uint32_t pixel = 0;
  Dimension dimension = Dimension::lens_u;
};

// The coordinates of `count` consecutive samples.
std::vector<double> coordinates(const Stream& stream, std::uint32_t first, std::uint32_t count) {
  const SampleSequence sequence(stream.seed);
  std::vector<double> result;
  SampleKeys keys;
  keys.pixel.fill(stream.pixel);
  LaneValues values = {};
  for (std::uint32_t done = 0; done < count; done += kLanes) {
    for (std::uint32_t i = 0; i < kLanes; ++i) keys.index[i] = first + done + i;
    sequence.fill(keys, stream.dimension, values);
    const auto wanted = std::min<std::uint32_t>(kLanes, count - done);
    result.insert(result.end(), values.begin(), values.begin() + wanted);
  }
  return result;
}

// One coordinate of one sample index, for pixels 0, 1, 2, ...: independent of each other.
std::vector<double> across_pixels(std::uint32_t seed, Dimension dimension, std::uint32_t index,
                                  std::uint32_t count) {
  const SampleSequence sequence(seed);
  std::vector<double> result;
  SampleKeys keys;
  keys.index.fill(index);
  LaneValues values = {};
  for (std::uint32_t start = 0; start < count; start += kLanes) {
    for (std::uint32_t i = 0; i < kLanes; ++i) keys.pixel[i] = start + i;
    sequence.fill(keys, dimension, values);
    result.insert(result.end(), values.begin(), values.end());
  }
  return result;
}

// Published quantiles: chi-square of 10 and 99 degrees exceeds these with 1 % and 5 %.
TEST(ChiSquareTail, AgreesWithPublishedQuantiles) {
  EXPECT_NEAR(oracle::chi_square_tail(23.209, 10), 0.01, 1e-5);
  EXPECT_NEAR(oracle::chi_square_tail(123.225, 99), 0.05, 1e-5);
  EXPECT_NEAR(oracle::normal_bound(0.05), 1.959964, 1e-6);
  EXPECT_NEAR(oracle::sidak_significance(1), 0.01, 1e-15);
}

TEST(SampleSequence, CoordinatesLieInTheUnitInterval) {
  for (const Dimension dimension : kEveryDimension) {
    for (const std::uint32_t first : {0U, 1U << 20, 0xffffff00U}) {
      for (const double x : coordinates({1, 7, dimension}, first, 255)) {
        ASSERT_GE(x, 0.0);
        ASSERT_LT(x, 1.0);
      }
    }
  }
}

TEST(SampleSequence, IsAPureFunctionOfItsKey) {
  const auto in_order = coordinates({3, 5, Dimension::lens_v}, 0, 64);
  const SampleSequence sequence(3);
  SampleKeys keys;
  LaneValues values = {};
  std::mt19937 random(1);
  for (int repeat = 0; repeat < 50; ++repeat) {
    // Lanes of our pixel in any order among lanes of others.
    for (std::size_t i = 0; i < kLanes; ++i) {
      keys.pixel[i] = i % 3 == 0 ? 5U : static_cast<std::uint32_t>(random());
      keys.index[i] = static_cast<std::uint32_t>(random() % 64);
    }
    sequence.fill(keys, Dimension::lens_v, values);
    for (std::size_t i = 0; i < kLanes; i += 3) ASSERT_EQ(values[i], in_order[keys.index[i]]);
  }
}

TEST(SampleSequence, EveryDimensionOfEveryAlignedBlockIsStratified) {
  for (const Dimension dimension : kEveryDimension) {
    for (std::uint32_t k = 0; k <= 10; ++k) {
      const std::uint32_t n = 1U << k;
      for (const std::uint32_t block : {0U, 1U, 5U, 1000U}) {
        std::vector<int> hits(n, 0);
        for (const double x : coordinates({11, 42, dimension}, block * n, n)) {
          ++hits[static_cast<std::size_t>(x * n)];
        }
        ASSERT_EQ(std::ranges::count(hits, 1), n)
            << "dimension " << static_cast<int>(dimension) << ", block " << block << " of " << n;
      }
    }
  }
}

// The smallest t with which these 2^k points are a (t,k,2)-net: every elementary interval of
// area 2^(t-k) holds exactly 2^t of them.
std::uint32_t quality_of_net(const std::vector<double>& x, const std::vector<double>& y) {
  const auto k = static_cast<std::uint32_t>(std::countr_zero(x.size()));
  for (std::uint32_t t = 0; t <= k; ++t) {
    bool even = true;
    for (std::uint32_t a = 0; a + t <= k && even; ++a) {
      const std::uint32_t columns = 1U << a;
      const std::uint32_t rows = 1U << (k - t - a);
      std::vector<std::uint32_t> hits(std::size_t{columns} * rows, 0);
      for (std::size_t i = 0; i < x.size(); ++i) {
        ++hits[static_cast<std::size_t>(x[i] * columns) * rows +
               static_cast<std::size_t>(y[i] * rows)];
      }
      even = std::ranges::count(hits, 1U << t) == static_cast<std::ptrdiff_t>(hits.size());
    }
    if (even) return t;
  }
  return k;
}

std::uint32_t worst_quality(Dimension first, Dimension second) {
  std::uint32_t worst = 0;
  for (std::uint32_t k = 0; k <= 8; ++k) {
    const std::uint32_t n = 1U << k;
    for (const std::uint32_t pixel : {0U, 1U, 77777U}) {
      for (const std::uint32_t block : {0U, 1U, 2U, 3U, 17U}) {
        const auto x = coordinates({9, pixel, first}, block * n, n);
        const auto y = coordinates({9, pixel, second}, block * n, n);
        worst = std::max(worst, quality_of_net(x, y));
      }
    }
  }
  return worst;
}

TEST(SampleSequence, LensCoordinatesAreNetsOfQualityZero) {
  EXPECT_EQ(worst_quality(Dimension::lens_u, Dimension::lens_v), 0U);
}

// Sobol's third and fourth dimension have primitive polynomials of degree 2 and 3, so that their
// plane has t <= (2 - 1) + (3 - 1) = 3 (Niederreiter 1992, 4.5), which scrambling keeps; up to 256
// points t is 2.
TEST(SampleSequence, PixelCoordinatesAreNetsOfQualityTwo) {
  EXPECT_LE(worst_quality(Dimension::pixel_x, Dimension::pixel_y), 2U);
}

// A nested scramble keeps what two points share: the coordinates of two indices agree in as many
// leading bits as the unscrambled ones do. The first two Sobol dimensions have generating
// matrices from another source: the identity and Pascal's triangle modulo 2.
std::uint32_t unscrambled(Dimension dimension, std::uint32_t index) {
  std::uint32_t point = 0;  // leading bit first
  for (std::uint32_t row = 0; row < 32; ++row) {
    std::uint32_t bit = 0;
    for (std::uint32_t column = row; column < 32; ++column) {
      // binomial(column, row) is odd where row's bits are among column's (Lucas).
      const bool odd = dimension == Dimension::lens_u ? column == row : (row & ~column) == 0;
      if (odd) bit ^= (index >> column) & 1U;
    }
    point |= bit << (31U - row);
  }
  return point;
}

TEST(SampleSequence, ScramblingKeepsCommonPrefixes) {
  std::mt19937 random(2);
  for (const Dimension dimension : {Dimension::lens_u, Dimension::lens_v}) {
    for (int i = 0; i < 2000; ++i) {
      const auto a = static_cast<std::uint32_t>(random());
      const auto b =
          i % 2 == 0 ? a ^ (1U << (random() % 32)) : static_cast<std::uint32_t>(random());
      const auto scrambled = [&](std::uint32_t index) {
        return static_cast<std::uint32_t>(coordinates({4, 6, dimension}, index, 1)[0] * 0x1p32);
      };
      ASSERT_EQ(std::countl_zero(scrambled(a) ^ scrambled(b)),
                std::countl_zero(unscrambled(dimension, a) ^ unscrambled(dimension, b)))
          << "dimension " << static_cast<int>(dimension) << ", indices " << a << ", " << b;
    }
  }
}

// Chi-square of pairs (x, y) against the uniform square, 16 x 16 cells; its tail probability.
double uniformity(const std::vector<double>& x, const std::vector<double>& y) {
  constexpr std::size_t kCells = 16;
  std::vector<double> hits(kCells * kCells, 0.0);
  for (std::size_t i = 0; i < x.size(); ++i) {
    hits[static_cast<std::size_t>(x[i] * kCells) * kCells +
         static_cast<std::size_t>(y[i] * kCells)] += 1.0;
  }
  const double expected = static_cast<double>(x.size()) / static_cast<double>(hits.size());
  EXPECT_GE(expected, 5.0);
  double chi_square = 0.0;
  for (const double h : hits) chi_square += (h - expected) * (h - expected) / expected;
  return oracle::chi_square_tail(chi_square, static_cast<int>(hits.size()) - 1);
}

constexpr std::uint32_t kPixels = 1U << 14;  // 64 expected counts a cell

TEST(SampleSequence, PixelsTogetherAreUniform) {
  constexpr std::uint32_t kIndices[] = {0, 1, 255, 4096};
  const double significance = oracle::sidak_significance(4 * 3);
  for (const std::uint32_t index : kIndices) {
    const auto sample = [&](Dimension d) { return across_pixels(1, d, index, kPixels); };
    EXPECT_GT(uniformity(sample(Dimension::lens_u), sample(Dimension::lens_v)), significance);
    EXPECT_GT(uniformity(sample(Dimension::pixel_x), sample(Dimension::pixel_y)), significance);
    EXPECT_GT(uniformity(sample(Dimension::light_u), sample(Dimension::time)), significance);
  }
}

TEST(SampleSequence, UniformityTestFailsForAWrongDensity) {
  auto x = across_pixels(1, Dimension::lens_u, 0, kPixels);
  const auto y = across_pixels(1, Dimension::lens_v, 0, kPixels);
  for (double& value : x) value = std::pow(value, 1.1);
  EXPECT_LT(uniformity(x, y), oracle::sidak_significance(4 * 3));
}

// The correlation of n independent uniform pairs is asymptotically normal with standard deviation
// 1/sqrt(n).
double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  double sum = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - 0.5) * (y[i] - 0.5);
  return 12.0 * sum / static_cast<double>(x.size());
}

TEST(SampleSequence, PixelsSeedsAndDimensionsAreIndependent) {
  struct Pair {
    std::vector<double> x = {};
    std::vector<double> y = {};
  };
  std::vector<Pair> pairs;
  // Dimensions of one sample.
  for (int i = 0; i < kDimensions; ++i) {
    for (int k = 0; k < i; ++k) {
      pairs.push_back({across_pixels(1, kEveryDimension[i], 3, kPixels),
                       across_pixels(1, kEveryDimension[k], 3, kPixels)});
    }
  }
  // Seeds, next to each other and not.
  const auto one = across_pixels(1, Dimension::lens_u, 3, kPixels);
  for (const std::uint32_t seed : {0U, 2U, 3U, 1000U, 0x80000001U}) {
    pairs.push_back({one, across_pixels(seed, Dimension::lens_u, 3, kPixels)});
  }
  // Neighbouring pixels: each pixel with the one after it, and with the one a row of 960 below.
  for (const std::uint32_t step : {1U, 2U, 960U}) {
    auto shifted = across_pixels(1, Dimension::lens_u, 3, kPixels + 960);
    shifted.erase(shifted.begin(), shifted.begin() + step);
    shifted.resize(kPixels);
    pairs.push_back({one, shifted});
  }
  const int tests = static_cast<int>(pairs.size());
  const double bound = oracle::normal_bound(oracle::sidak_significance(2 * tests)) /
                       std::sqrt(static_cast<double>(kPixels));
  for (const Pair& pair : pairs) {
    EXPECT_LT(std::abs(correlation(pair.x, pair.y)), bound);
    EXPECT_GT(uniformity(pair.x, pair.y), oracle::sidak_significance(2 * tests));
  }
}

// Order of convergence of the error in the lens plane: the slope of log(RMSE) over log(n), by least
// squares, RMSE over the scrambles of 400 pixels for n = 16 ... 1024.
using Integrand = std::function<double(double, double)>;

double convergence_order(const Integrand& f, double exact, Dimension first, Dimension second) {
  double sum_x = 0.0;
  double sum_y = 0.0;
  double sum_xx = 0.0;
  double sum_xy = 0.0;
  int points = 0;
  for (std::uint32_t n = 16; n <= 1024; n *= 2) {
    double square = 0.0;
    for (std::uint32_t pixel = 0; pixel < 400; ++pixel) {
      const auto x = coordinates({21, pixel, first}, 0, n);
      const auto y = coordinates({21, pixel, second}, 0, n);
      double mean = 0.0;
      for (std::size_t i = 0; i < n; ++i) mean += f(x[i], y[i]);
      square += std::pow(mean / n - exact, 2);
    }
    const double log_n = std::log(n);
    const double log_rmse = 0.5 * std::log(square / 400);
    sum_x += log_n;
    sum_y += log_rmse;
    sum_xx += log_n * log_n;
    sum_xy += log_n * log_rmse;
    ++points;
  }
  return (points * sum_xy - sum_x * sum_y) / (points * sum_xx - sum_x * sum_x);
}

// Each RMSE is uncertain by 1/sqrt(2*400) = 3.5 %, the slope over six octaves by 0.035/3.7 = 0.01;
// independent samples have -0.5. Smooth integrands: n^-1.5 sqrt(log n), which is -1.39 over these n
// (Owen, Ann. Statist. 25, 1541, 1997), and a net of quality t begins at 2^t.
TEST(SampleSequence, SmoothIntegrandsConvergeWithOrderThreeHalves) {
  const Integrand smooth = [](double x, double y) { return std::exp(x) * y * y; };
  const double exact = (std::numbers::e - 1.0) / 3.0;
  EXPECT_LT(convergence_order(smooth, exact, Dimension::lens_u, Dimension::lens_v), -1.3);
  EXPECT_LT(convergence_order(smooth, exact, Dimension::pixel_x, Dimension::pixel_y), -1.2);
}

// A curve crosses about sqrt(n) of n cells that hold a point each; only those are in doubt, so that
// the variance is sqrt(n)/n^2: order 3/4.
TEST(SampleSequence, StepsConvergeWithOrderThreeQuarters) {
  const Integrand step = [](double x, double y) { return x * x + y * y < 1.0 ? 1.0 : 0.0; };
  const double exact = std::numbers::pi / 4.0;
  EXPECT_LT(convergence_order(step, exact, Dimension::lens_u, Dimension::lens_v), -0.7);
  EXPECT_LT(convergence_order(step, exact, Dimension::pixel_x, Dimension::pixel_y), -0.7);
}

// A control: both coordinates from one stream, each stratified, do not converge to the integral.
TEST(SampleSequence, OrderTestFailsForDependentCoordinates) {
  const Integrand step = [](double x, double y) { return x * x + y * y < 1.0 ? 1.0 : 0.0; };
  EXPECT_GT(convergence_order(step, std::numbers::pi / 4.0, Dimension::lens_u, Dimension::lens_u),
            -0.5);
}

TEST(HashOf, EveryBitOfBothArgumentsReachesTheResult) {
  // Flipping a bit flips each of 32 bits with probability 1/2: 16 +- 2.83 of them. Over 32*2*200
  // flips the mean has a standard deviation of 0.025.
  std::mt19937 random(3);
  double flipped = 0.0;
  int flips = 0;
  for (int i = 0; i < 200; ++i) {
    const auto a = static_cast<std::uint32_t>(random());
    const auto b = static_cast<std::uint32_t>(random());
    for (std::uint32_t bit = 0; bit < 32; ++bit) {
      const int by_a = std::popcount(hash_of(a, b) ^ hash_of(a ^ (1U << bit), b));
      const int by_b = std::popcount(hash_of(a, b) ^ hash_of(a, b ^ (1U << bit)));
      EXPECT_GT(by_a, 0);
      EXPECT_GT(by_b, 0);
      flipped += by_a + by_b;
      flips += 2;
    }
  }
  EXPECT_NEAR(flipped / flips, 16.0, oracle::normal_bound(0.01) * 0.025);
}

// Eight intervals, one number in each; other streams and seeds decide otherwise.
TEST(SampleSequence, DecisionsAreStratified) {
  const SampleSequence sequence(3);
  for (const std::uint32_t stream : {0U, 77U}) {
    for (std::uint32_t first = 0; first < 64; first += 8) {
      std::array<int, 8> seen = {};
      for (std::uint32_t i = 0; i < 8; ++i) {
        const float value = sequence.decision(stream, first + i);
        ASSERT_GE(value, 0.0F);
        ASSERT_LT(value, 1.0F);
        ++seen[static_cast<std::size_t>(8.0F * value)];
      }
      for (const int count : seen) EXPECT_EQ(count, 1) << stream << ' ' << first;
    }
  }
  EXPECT_NE(sequence.decision(1, 5), sequence.decision(2, 5));
  EXPECT_NE(sequence.decision(1, 5), SampleSequence(4).decision(1, 5));
}

}  // namespace
}  // namespace fstop
