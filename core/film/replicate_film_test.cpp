#include "core/film/replicate_film.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/references/oracle.h"

namespace fstop {
namespace {

// Means of known values carry roundings of 2^-24: of the sum, the scale and the product.
constexpr double kRounding = 4 * 0x1p-24;

// Sums of `count` samples worth value(x, y, channel) each; lanes outside the picture hold rubbish.
using Value = std::function<double(int x, int y, int c)>;
BlockSums sums_of(const BlockGrid& grid, std::size_t block, std::uint32_t count,
                  const Value& value) {
  BlockSums sums;
  for (auto& channel : sums.value) channel.fill(std::numeric_limits<double>::quiet_NaN());
  grid.for_each_pixel(block, [&](std::size_t lane, int x, int y) {
    for (int c = 0; c < 3; ++c)
      sums.value[static_cast<std::size_t>(c)][lane] = count * value(x, y, c);
  });
  return sums;
}

void expose(ReplicateFilm& film, int replicate, std::uint32_t count, const Value& value) {
  for (std::size_t block = 0; block < film.grid().count(); ++block) {
    film.add(replicate, block, sums_of(film.grid(), block, count, value), count);
  }
}

double ramp(int x, int y, int c) { return 0.01 * x + 0.1 * y + 0.3 * c; }

TEST(ReplicateFilm, MeansOfPicturesThatAreNoMultipleOfABlock) {
  for (const auto& [width, height] : {std::pair{1, 1}, {5, 3}, {4, 4}, {13, 6}}) {
    ReplicateFilm film(width, height);
    expose(film, 0, 2, ramp);
    expose(film, 1, 6, [](int x, int y, int c) { return ramp(x, y, c) + 1.0; });
    const Image mean = film.mean();
    const Image second = film.replicate(1);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(mean.at(x, y)[c], ramp(x, y, c) + 0.5, kRounding * 2.0);
          EXPECT_NEAR(second.at(x, y)[c], ramp(x, y, c) + 1.0, kRounding * 2.0);
        }
      }
    }
  }
}

// A quarter of the squared difference, whatever of a block lies in the picture.
TEST(ReplicateFilm, NoiseIsPerPixelInPicturesThatAreNoMultipleOfABlock) {
  for (const auto& [width, height] : {std::pair{1, 1}, {5, 3}, {4, 4}, {13, 6}}) {
    ReplicateFilm film(width, height);
    expose(film, 0, 3, [](int, int, int) { return 0.2; });
    expose(film, 1, 5, [](int, int, int) { return 1.6; });
    // The mean is 0.9; 0.2 lies 0.7 below, 1.6 is clipped to 1.
    EXPECT_NEAR(film.noise().mse, 0.5 * (0.49 + 0.01), 1e-6);
    EXPECT_GE(film.noise().mse_upper_95, film.noise().mse);
    EXPECT_GE(film.noise().unclipped_mse_upper_95, 0.49 * (1 - 1e-6));
  }
}

// Every pixel belongs to one block, whichever tiles are interleaved; those that stick out never
// are.
TEST(BlockGrid, InterleavedTilesHoldEveryPixelOnce) {
  BlockGrid grid(53, 34);
  ASSERT_EQ(grid.tile_columns(), 4);
  ASSERT_EQ(grid.tile_rows(), 3);
  grid.interleaved = {1, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
  std::vector<int> seen(53 * 34);
  int interleaved = 0;
  for (std::size_t block = 0; block < grid.count(); ++block) {
    int pixels = 0;
    grid.for_each_pixel(block, [&](std::size_t lane, int x, int y) {
      ++seen[static_cast<std::size_t>(y * 53 + x)];
      ++pixels;
      EXPECT_EQ(x, grid.left(block) + grid.stride(block) * static_cast<int>(lane % 4));
      EXPECT_EQ(y, grid.top(block) + grid.stride(block) * static_cast<int>(lane / 4));
    });
    EXPECT_EQ(pixels, grid.pixels(block));
    interleaved += grid.is_interleaved(block) ? 1 : 0;
  }
  EXPECT_EQ(interleaved, 3 * 16);  // (0,0), (2,0), (1,1): others are square or stick out
  for (const int count : seen) EXPECT_EQ(count, 1);
}

TEST(ReplicateFilm, InterleavedBlocksLieWhereTheirPixelsAre) {
  BlockGrid grid(40, 20);
  grid.interleaved = {1, 0, 0, 0, 0, 0};
  ReplicateFilm film(grid);
  expose(film, 0, 2, ramp);
  expose(film, 1, 2, ramp);
  const Image mean = film.mean();
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 40; ++x) EXPECT_NEAR(mean.at(x, y)[1], ramp(x, y, 1), kRounding * 4.0);
  }
}

TEST(ReplicateFilm, OneReplicateAloneIsTheMean) {
  ReplicateFilm film(6, 5);
  expose(film, 0, 1, ramp);
  const Image mean = film.mean();
  EXPECT_NEAR(mean.at(5, 4)[2], ramp(5, 4, 2), kRounding * 2.0);
}

TEST(ReplicateFilm, PassesOfABlockAddUp) {
  ReplicateFilm film(8, 4);
  expose(film, 0, 1, [](int, int, int) { return 0.2; });
  expose(film, 0, 3, [](int, int, int) { return 0.6; });
  expose(film, 1, 1, [](int, int, int) { return 0.1; });
  EXPECT_EQ(film.samples(0, 1), 4U);
  EXPECT_EQ(film.samples(1, 1), 1U);
  EXPECT_NEAR(film.replicate(0).at(7, 3)[0], 0.5, kRounding);  // (0.2 + 3 * 0.6)/4
  EXPECT_NEAR(film.mean().at(7, 3)[0], 0.3, kRounding);
  EXPECT_EQ(film.samples_mean(), 5.0);
  EXPECT_EQ(film.samples_max(), 5);
}

TEST(ReplicateFilm, ExtraLightIsAddedToItsReplicate) {
  ReplicateFilm film(5, 5);
  expose(film, 0, 2, ramp);
  expose(film, 1, 2, ramp);
  Image light(5, 5, 3);
  light.at(4, 4)[1] = 3.0F;
  film.set_extra(0, light);
  EXPECT_NEAR(film.mean().at(4, 4)[1], ramp(4, 4, 1) + 1.5, kRounding * 4.0);
  EXPECT_NEAR(film.mean().at(3, 4)[1], ramp(3, 4, 1), kRounding * 2.0);
  // One value of 75 is off by 3, in one block: (3^2/4)/75 in the mean, 1.5 of the energy.
  double energy = 1.5;
  for (int i = 0; i < 75; ++i) energy += ramp(i / 3 % 5, i / 15, i % 3);
  EXPECT_NEAR(film.noise().energy, 1.5 / energy, 1e-5);
  film.set_extra(0, Image(5, 5, 3));
  EXPECT_NEAR(film.mean().at(4, 4)[1], ramp(4, 4, 1), kRounding * 2.0);
}

// One sample a pixel of variance 0.01; where the second replicate has one too, half of it is left.
TEST(ReplicateFilm, AFewBlocksOfTheSecondReplicateTellTheErrorOfTheFirst) {
  ReplicateFilm film(64, 64);
  std::mt19937 generator(7);
  std::normal_distribution<double> light(0.5, 0.1);
  const auto noisy = [&](int, int, int) { return light(generator); };
  expose(film, 0, 1, noisy);
  EXPECT_FALSE(film.is_paired());
  EXPECT_EQ(film.noise().mse_upper_95, 1.0);
  int paired = 0;
  for (std::size_t block = 3; block < film.grid().count(); block += 8, ++paired) {
    film.add(1, block, sums_of(film.grid(), block, 1, noisy), 1);
  }
  const double share = paired / 256.0;
  const double expected = 0.01 * (1.0 - share) + 0.005 * share;
  // Told by 48 values of each pair: chi^2, four standard deviations.
  const double scatter = 4.0 * std::sqrt(2.0 / (48.0 * paired));
  EXPECT_NEAR(film.noise().mse, expected, scatter * expected);
  EXPECT_GT(film.noise().mse_upper_95, film.noise().mse);
  // A tile of 16 blocks holds two pairs.
  const Image tiles = film.tile_variance();
  EXPECT_NEAR(tiles.at(40, 40)[1], 0.01 * 14.0 / 16.0 + 0.005 * 2.0 / 16.0, 0.01 * 0.71);
  double off = 0.0;
  const Image mean = film.mean();
  for (const float value : mean.pixels()) off += std::pow(static_cast<double>(value) - 0.5, 2);
  EXPECT_NEAR(off / (64.0 * 64.0 * 3.0), expected, 4.0 * std::sqrt(2.0 / 12288.0) * expected);
}

// The extra light of both stands for the same light.
TEST(ReplicateFilm, OneReplicateAloneHasItsOwnExtraLightOnly) {
  ReplicateFilm film(4, 4);
  expose(film, 0, 1, ramp);
  Image light(4, 4, 3);
  light.at(2, 1)[0] = 3.0F;
  film.set_extra(0, light);
  film.set_extra(1, light);
  EXPECT_NEAR(film.mean().at(2, 1)[0], ramp(2, 1, 0) + 3.0, kRounding * 4.0);
  expose(film, 1, 1, ramp);
  EXPECT_NEAR(film.mean().at(2, 1)[0], ramp(2, 1, 0) + 3.0, kRounding * 4.0);
}

TEST(ReplicateFilm, NothingIsKnownWithoutSamplesInBothReplicates) {
  ReplicateFilm film(8, 8);
  const auto expect_unknown = [&] {
    const NoiseEstimate noise = film.noise();
    EXPECT_EQ(noise.mse_upper_95, 1.0);
    EXPECT_EQ(noise.unclipped_mse_upper_95, 1.0);
    EXPECT_EQ(noise.energy, 1.0);
  };
  expect_unknown();
  for (std::size_t block = 0; block < 3; ++block) {
    for (int r : {0, 1}) film.add(r, block, sums_of(film.grid(), block, 4, ramp), 4);
  }
  expect_unknown();  // a block that neither has seen
  ReplicateFilm one(8, 8);
  expose(one, 0, 4, ramp);
  EXPECT_EQ(one.noise().mse_upper_95, 1.0);
  film.add(0, 3, sums_of(film.grid(), 3, 4, ramp), 4);
  film.add(1, 3, sums_of(film.grid(), 3, 4, ramp), 4);
  EXPECT_LT(film.noise().mse_upper_95, 1e-12);
}

TEST(ReplicateFilm, TilesTellTheirOwnVariance) {
  ReplicateFilm film(20, 18);  // tiles of 16 x 16, 4 x 16, 16 x 2, 4 x 2
  const Value first = [](int x, int y, int c) {
    return (x < 16 ? 0.2 : 0.4) * (y < 16 ? 1 : 2) + c;
  };
  expose(film, 0, 1, first);
  expose(film, 1, 1, [](int, int, int c) { return double(c); });
  const Image variance = film.tile_variance();
  for (const auto& [x, y, off] : {std::tuple{0, 0, 0.2},
                                  {15, 15, 0.2},
                                  {16, 15, 0.4},
                                  {19, 0, 0.4},
                                  {3, 16, 0.4},
                                  {19, 17, 0.8}}) {
    // Values up to 3 are rounded: off is known to 3 * 2^-24, its square to twice that.
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(variance.at(x, y)[c], off * off / 4, 1e-6) << x << y;
  }
  // Half of a tile's pixels: half the mean.
  ReplicateFilm half(16, 16);
  expose(half, 0, 1, [](int x, int, int) { return x < 8 ? 1.0 : 0.0; });
  expose(half, 1, 1, [](int, int, int) { return 0.0; });
  EXPECT_NEAR(half.tile_variance().at(15, 15)[0], 0.125, 1e-7);
}

TEST(ReplicateFilm, SpreadIsTheChangeBetweenPasses) {
  ReplicateFilm film(7, 4);
  expose(film, 0, 2, [](int, int, int) { return 0.25; });
  EXPECT_LT(film.spread(0, 0), 0.0F);
  expose(film, 0, 6, [](int, int, int c) { return c == 0 ? 0.75 : 2.0; });
  // Changes of 0.5 in one channel, of 0.75 after clipping in two, in every pixel.
  const double square = (0.25 + 2 * 0.5625) / 3.0;
  const double expected = square / (std::pow(2.0, -1.25) + std::pow(6.0, -1.25));
  EXPECT_NEAR(film.spread(0, 0), expected, 1e-6);
  EXPECT_NEAR(film.spread(0, 1), expected, 1e-6);  // three of four columns in the picture
  EXPECT_LT(film.spread(1, 0), 0.0F);
}

TEST(ReplicateFilm, FiguresAreTheSameForAnyNumberOfThreads) {
  ReplicateFilm film(75, 61);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> value(0.0, 1.5);
  for (int r = 0; r < kReplicates; ++r) {
    expose(film, r, 2, [&](int, int, int) { return value(random); });
  }
  const NoiseEstimate alone = film.noise();
  for (const int threads : {1, 2, 3}) {
    WorkerPool workers(threads);
    const RunControl run{.workers = &workers};
    const NoiseEstimate noise = film.noise(run);
    EXPECT_EQ(noise.mse, alone.mse);
    EXPECT_EQ(noise.mse_upper_95, alone.mse_upper_95);
    EXPECT_EQ(noise.unclipped_mse_upper_95, alone.unclipped_mse_upper_95);
    EXPECT_EQ(noise.energy, alone.energy);
    EXPECT_EQ(film.mean(run), film.mean());
    EXPECT_EQ(film.tile_variance(run), film.tile_variance());
  }
}

// A sample's deviation from its mean.
using Noise = std::function<double(std::size_t block, std::mt19937_64& random)>;

struct Film {
  NoiseEstimate noise = {};
  double true_mse = 0.0;     // values clipped to [0,1]
  double true_square = 0.0;  // of values as they are
  double energy_off = 0.0;   // relative
};

// A picture of 384 blocks whose pixels are worth `mean`, from `counts` samples with noise that all
// pixels of a block share.
Film simulated(double mean, std::array<int, 2> counts, const Noise& noise, std::uint64_t seed) {
  constexpr int kWidth = 96;
  constexpr int kHeight = 64;
  std::mt19937_64 random(seed);
  ReplicateFilm film(kWidth, kHeight);
  for (int r = 0; r < kReplicates; ++r) {
    const int n = counts[static_cast<std::size_t>(r)];
    for (std::size_t block = 0; block < film.grid().count(); ++block) {
      double sum = 0.0;
      for (int i = 0; i < n; ++i) sum += noise(block, random);
      film.add(r, block,
               sums_of(film.grid(), block, static_cast<std::uint32_t>(n),
                       [&](int, int, int) { return mean + sum / n; }),
               static_cast<std::uint32_t>(n));
    }
  }
  Film result{.noise = film.noise()};
  double energy = 0.0;
  const Image picture = film.mean();
  for (const float value : picture.pixels()) {
    const double clipped = std::clamp(double(value), 0.0, 1.0);
    result.true_mse += std::pow(clipped - mean, 2) / double(picture.pixels().size());
    result.true_square += std::pow(double(value) - mean, 2) / double(picture.pixels().size());
    energy += double(value);
  }
  result.energy_off = energy / (mean * double(picture.pixels().size())) - 1.0;
  return result;
}

Noise even_noise(double sigma) {
  return [sigma](std::size_t, std::mt19937_64& random) {
    return std::normal_distribution<double>(0.0, sigma)(random);
  };
}
// Most of the picture calm, a tenth of it with ten times the deviation.
Noise uneven_noise(double sigma) {
  return [sigma](std::size_t block, std::mt19937_64& random) {
    return std::normal_distribution<double>(0.0, block % 10 == 0 ? 10 * sigma : sigma)(random);
  };
}
// Bright with probability 1/50, mean 0.
Noise skewed_noise(double bright) {
  return [bright](std::size_t, std::mt19937_64& random) {
    return (random() % 50 == 0 ? bright : 0.0) - bright / 50;
  };
}

// Var (A + B)/2 = sigma^2/4 (1/n_A + 1/n_B). Its estimate over 384 blocks and 60 films has a
// relative standard error of sqrt(2/(384*60)) = 0.0093.
TEST(ReplicateFilm, NoiseIsUnbiasedForIndependentSamples) {
  constexpr int kFilms = 60;
  const double sigma = 0.05;
  double mse = 0.0;
  double true_mse = 0.0;
  double energy_variance = 0.0;
  double energy_square = 0.0;
  for (int i = 0; i < kFilms; ++i) {
    const Film film = simulated(0.5, {4, 6}, even_noise(sigma), 100 + static_cast<unsigned>(i));
    mse += film.noise.mse / kFilms;
    true_mse += film.true_mse / kFilms;
    energy_variance += std::pow(film.noise.energy, 2) / kFilms;
    energy_square += std::pow(film.energy_off, 2) / kFilms;
  }
  const double expected = sigma * sigma / 4 * (1.0 / 4 + 1.0 / 6);
  const double bound = 4 * std::sqrt(2.0 / (384 * kFilms));
  EXPECT_NEAR(mse / expected, 1.0, bound);
  EXPECT_NEAR(true_mse / expected, 1.0, bound);
  // The total of 384 equal blocks: the variance of one over 384, relative to 0.5 squared.
  const double energy = expected / 384 / 0.25;
  EXPECT_NEAR(energy_variance / energy, 1.0, bound);
  EXPECT_NEAR(energy_square / energy, 1.0, 4 * std::sqrt(2.0 / kFilms));
}

// At least 95 % of true errors lie under the bound, in pictures of 96 x 64 pixels. Of 400 films as
// many may fail as a binomial of 5 % gives with the significance of the tests together.
TEST(ReplicateFilm, BoundsHoldForEvenUnevenAndSkewedNoise) {
  constexpr int kFilms = 400;
  struct Case {
    const char* name;
    double mean;
    Noise noise;
  };
  const Case cases[] = {{"even", 0.5, even_noise(0.05)},
                        {"uneven", 0.5, uneven_noise(0.02)},
                        {"skewed", 0.2, skewed_noise(1.0)}};
  const double most = 0.05 + oracle::normal_bound(2 * oracle::sidak_significance(6)) *
                                 std::sqrt(0.05 * 0.95 / kFilms);
  for (const Case& c : cases) {
    int missed = 0;
    int missed_unclipped = 0;
    for (int i = 0; i < kFilms; ++i) {
      const Film film = simulated(c.mean, {4, 4}, c.noise, 7000 + static_cast<unsigned>(i));
      missed += film.true_mse > film.noise.mse_upper_95 ? 1 : 0;
      missed_unclipped += film.true_square > film.noise.unclipped_mse_upper_95 ? 1 : 0;
    }
    EXPECT_LE(missed, most * kFilms) << c.name;
    EXPECT_LE(missed_unclipped, most * kFilms) << c.name;
  }
}

// Where values are about to be clipped, errors are cut on one side, in A and B more than in their
// mean. A picture all of such pixels is the worst there is: the estimate stays within a tenth.
// 100 films of 384 blocks: a relative standard error of about sqrt(2/38400) = 0.7 %.
TEST(ReplicateFilm, NoiseNearClippingIsToldWithinATenth) {
  for (const double mean : {0.05, 0.5, 0.9, 0.97}) {
    double told = 0.0;
    double made = 0.0;
    for (int i = 0; i < 100; ++i) {
      const Film film = simulated(mean, {4, 4}, even_noise(0.3), 300 + static_cast<unsigned>(i));
      told += film.noise.mse;
      made += film.true_mse;
    }
    EXPECT_NEAR(told / made, 1.0, 0.1 + 0.03) << mean;
  }
}

}  // namespace
}  // namespace fstop
