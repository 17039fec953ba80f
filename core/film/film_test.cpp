#include "core/film/film.h"

#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr int kWidth = 32;
constexpr int kHeight = 24;
constexpr int kPixelCount = kWidth * kHeight;

// What one sample of a pixel is worth, all channels alike unless said.
using Source = std::function<std::array<float, 3>(int x, int y)>;

// One pass of `samples` a pixel.
NoiseEstimate expose(Film& film, int samples, const Source& source) {
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      PixelSums sums;
      for (int i = 0; i < samples; ++i) {
        const auto [r, g, b] = source(x, y);
        sums.add(r, g, b);
      }
      film.add(x, y, sums);
    }
  }
  return film.end_pass(samples);
}

// Independent samples around `mean`, normal with deviation `sigma`.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : random_(seed) {}
  std::array<float, 3> sample(double mean, double sigma) {
    const auto one = [&] { return static_cast<float>(mean + sigma * normal_(random_)); };
    const float r = one();
    const float g = one();
    return {r, g, one()};
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

TEST(Film, MeanAndVarianceOfKnownSamples) {
  Film film(2, 1);
  PixelSums first;
  for (const float value : {1.0F, 2.0F, 3.0F, 6.0F}) first.add(value, 2 * value, 0.5F);
  film.add(0, 0, first);
  PixelSums second;
  for (int i = 0; i < 4; ++i) second.add(0.25F, 0.0F, -1.0F);
  film.add(1, 0, second);
  film.end_pass(4);
  const Image mean = film.mean();
  // Mean 3, sum of squares 50: scatter 50 - 36 = 14, variance of the mean 14/(4*3).
  const Image variance = film.variance();
  EXPECT_EQ(film.samples(), 4);
  EXPECT_EQ(mean.at(0, 0)[0], 3.0F);
  EXPECT_EQ(mean.at(0, 0)[1], 6.0F);
  EXPECT_EQ(mean.at(0, 0)[2], 0.5F);
  EXPECT_EQ(mean.at(1, 0)[0], 0.25F);
  EXPECT_EQ(mean.at(1, 0)[1], 0.0F);
  EXPECT_EQ(mean.at(1, 0)[2], -1.0F);
  EXPECT_FLOAT_EQ(variance.at(0, 0)[0], 14.0F / 12.0F);
  EXPECT_FLOAT_EQ(variance.at(0, 0)[1], 4.0F * 14.0F / 12.0F);
  EXPECT_EQ(variance.at(0, 0)[2], 0.0F);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(variance.at(1, 0)[c], 0.0F);
}

TEST(Film, PassesAddUp) {
  Film film(kWidth, kHeight);
  int count = 0;
  const Source counting = [&count](int, int) {
    const auto value = static_cast<float>(count++ % 7);
    return std::array<float, 3>{value, 0.0F, 1.0F};
  };
  for (const int samples : {1, 1, 2, 4, 8}) expose(film, samples, counting);
  EXPECT_EQ(film.samples(), 16);
  double sum = 0.0;
  for (int i = 0; i < count; ++i) sum += i % 7;
  double total = 0.0;
  const Image mean = film.mean();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) total += mean.at(x, y)[0];
  }
  // 768 single-precision roundings of values below 7.
  EXPECT_NEAR(total * 16, sum, 768 * 16 * 7 * 6e-8);
  EXPECT_EQ(mean.at(5, 5)[2], 1.0F);
}

TEST(Film, PixelsKeepTheirPlace) {
  Film film(5, 4);
  expose(film, 1, [](int x, int y) {
    return std::array<float, 3>{static_cast<float>(x), static_cast<float>(y), 0.0F};
  });
  const Image mean = film.mean();
  EXPECT_EQ(mean.width(), 5);
  EXPECT_EQ(mean.height(), 4);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 5; ++x) {
      EXPECT_EQ(mean.at(x, y)[0], static_cast<float>(x));
      EXPECT_EQ(mean.at(x, y)[1], static_cast<float>(y));
    }
  }
}

TEST(Film, EmptyFilmIsBlack) {
  const Film film(3, 2);
  EXPECT_EQ(film.samples(), 0);
  EXPECT_EQ(film.mean(), Image(3, 2, 3));
  EXPECT_EQ(film.variance(), Image(3, 2, 3));
}

TEST(Film, OneSampleHasNoVariance) {
  Film film(1, 1);
  expose(film, 1, [](int, int) { return std::array<float, 3>{5.0F, 6.0F, 7.0F}; });
  EXPECT_EQ(film.variance(), Image(1, 1, 3));
}

TEST(Film, FirstPassTellsNoNoise) {
  Film film(kWidth, kHeight);
  Noise noise(1);
  const NoiseEstimate estimate = expose(film, 4, [&](int, int) { return noise.sample(0.5, 0.1); });
  EXPECT_EQ(estimate.mse, 0.0);
  EXPECT_EQ(estimate.mse_upper_95, 0.0);
  EXPECT_EQ(estimate.energy, 0.0);
}

TEST(Film, EqualHalvesHaveNoNoise) {
  Film film(kWidth, kHeight);
  const Source constant = [](int x, int) { return std::array<float, 3>{0.1F * float(x), 1, 0}; };
  expose(film, 4, constant);
  const NoiseEstimate estimate = expose(film, 4, constant);
  EXPECT_EQ(estimate.mse, 0.0);
  EXPECT_EQ(estimate.mse_upper_95, 0.0);
  EXPECT_EQ(estimate.energy, 0.0);
}

// One pixel, halves A = 0.2 and B = 0.6 in one channel of three: (A - B)^2/4/3.
TEST(Film, NoiseOfOnePixelByHand) {
  Film film(1, 1);
  expose(film, 2, [](int, int) { return std::array<float, 3>{0.25F, 0.5F, 0.5F}; });
  const NoiseEstimate estimate = expose(film, 2, [](int, int) {
    return std::array<float, 3>{0.75F, 0.5F, 0.5F};
  });
  EXPECT_DOUBLE_EQ(estimate.mse, 0.25 / 12);
  // One unit tells nothing of its own scatter: the 95 % quantile of F(1, 1).
  EXPECT_DOUBLE_EQ(estimate.mse_upper_95, 161.4 * 0.25 / 12);
  // Energy 0.5 + 0.5 + 0.5, its standard error half the difference.
  EXPECT_DOUBLE_EQ(estimate.energy, 0.25 / 1.5);
}

// Means above 1 or below 0 are shown as 1 and 0: there is no noise to see there, but energy.
TEST(Film, NoiseBeyondTheVisibleRangeDoesNotCount) {
  Film film(1, 1);
  expose(film, 2, [](int, int) { return std::array<float, 3>{3.0F, -1.0F, 0.5F}; });
  const NoiseEstimate estimate = expose(film, 2, [](int, int) {
    return std::array<float, 3>{5.0F, -2.0F, 0.5F};
  });
  EXPECT_EQ(estimate.mse, 0.0);
  // Total 4 - 1.5 + 0.5, differences 2 and 1.
  EXPECT_DOUBLE_EQ(estimate.energy, std::sqrt((4.0 + 1.0) / 4.0) / 3.0);
}

TEST(Film, NoiseAcrossTheLimitCountsAsFarAsItIsVisible) {
  Film film(1, 1);
  expose(film, 1, [](int, int) { return std::array<float, 3>{0.5F, 0.0F, 0.0F}; });
  const NoiseEstimate estimate = expose(film, 1, [](int, int) {
    return std::array<float, 3>{9.0F, 0.0F, 0.0F};
  });
  EXPECT_DOUBLE_EQ(estimate.mse, 0.25 / 12);  // 0.5 to 1
}

TEST(Film, BlackImageHasNoRelativeEnergyError) {
  Film film(2, 2);
  const Source black = [](int, int) { return std::array<float, 3>{0, 0, 0}; };
  expose(film, 1, black);
  EXPECT_EQ(expose(film, 1, black).energy, 0.0);
}

// Statistics of many films with 2 x 8 independent normal samples a pixel around the pixel's mean,
// deviation sigma: the mean's error has the variance sigma^2/16 = kTrueMse.
constexpr int kHalf = 8;
constexpr double kSigma = 0.08;
constexpr double kTrueMse = kSigma * kSigma / (2 * kHalf);
constexpr int kFilms = 400;

double pixel_mean(int x, int y) { return 0.3 + 0.4 * x / kWidth + 0.1 * y / kHeight; }

struct Trial {
  NoiseEstimate estimate = {};
  double true_mse = 0.0;
  double energy_error = 0.0;  // relative
};

Trial trial(std::uint64_t seed) {
  Film film(kWidth, kHeight);
  Noise noise(seed);
  const Source source = [&](int x, int y) { return noise.sample(pixel_mean(x, y), kSigma); };
  expose(film, kHalf, source);
  Trial result{.estimate = expose(film, kHalf, source)};
  const Image mean = film.mean();
  double energy = 0.0;
  double total = 0.0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 3; ++c) {
        const double error = mean.at(x, y)[c] - pixel_mean(x, y);
        result.true_mse += error * error / (3 * kPixelCount);
        energy += error;
        total += pixel_mean(x, y);
      }
    }
  }
  result.energy_error = energy / total;
  return result;
}

const std::vector<Trial>& trials() {
  static const std::vector<Trial> all = [] {
    std::vector<Trial> made;
    for (std::uint64_t seed = 1; seed <= kFilms; ++seed) made.push_back(trial(seed));
    return made;
  }();
  return all;
}

// Four tests share the significance 0.01.
const double kBound = oracle::normal_bound(oracle::sidak_significance(4));

// Each estimate is the mean of 3 * 768 squares of normal variables: deviation sqrt(2/2304) of it.
TEST(Film, NoiseEstimateIsUnbiasedForIndependentSamples) {
  double sum = 0.0;
  for (const Trial& t : trials()) sum += t.estimate.mse;
  const double deviation = std::sqrt(2.0 / (3 * kPixelCount) / kFilms);
  EXPECT_NEAR(sum / kFilms / kTrueMse, 1.0, kBound * deviation);
}

// At least 95 % of the true errors of finished images lie under the bound. The count of those above
// is binomial with p = 0.05; the skewness of chi-square with three degrees a pixel (1.63) adds at
// most 1.63/(6 sqrt(768)) (2 1.645^2 + 1) 0.103 = 0.006 to p.
TEST(Film, UpperBoundCoversTheTrueErrors) {
  int above = 0;
  for (const Trial& t : trials()) above += t.true_mse > t.estimate.mse_upper_95 ? 1 : 0;
  const double expected = 0.056 * kFilms;
  EXPECT_LE(above, expected + kBound * std::sqrt(expected));
  // Nor is it wider than that needs.
  EXPECT_GE(above, expected - kBound * std::sqrt(expected));
}

// The relative energy error is a standard error: the squares of (error/estimate) average to 1.
TEST(Film, EnergyErrorIsAStandardError) {
  double sum = 0.0;
  for (const Trial& t : trials()) sum += std::pow(t.energy_error / t.estimate.energy, 2);
  // Chi-square with 400 degrees over 400, and 1/E of a variance known to sqrt(2/2304).
  EXPECT_NEAR(sum / kFilms, 1.0, kBound * std::sqrt(2.0 / kFilms) + 2.0 / 2304);
}

// The per-pixel variance is unbiased too: its mean over pixels and films is sigma^2/16.
TEST(Film, VarianceIsUnbiasedForIndependentSamples) {
  double sum = 0.0;
  constexpr int kRuns = 50;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    Film film(kWidth, kHeight);
    Noise noise(1000 + seed);
    const Source source = [&](int x, int y) { return noise.sample(pixel_mean(x, y), kSigma); };
    expose(film, kHalf, source);
    expose(film, kHalf, source);
    const Image variance = film.variance();
    for (const float v : variance.pixels()) sum += v;
  }
  const double values = double{kRuns} * 3 * kPixelCount;
  // Each is chi-square with 15 degrees: deviation sqrt(2/15) of it.
  EXPECT_NEAR(sum / values / kTrueMse, 1.0, kBound * std::sqrt(2.0 / 15 / values));
}

}  // namespace
}  // namespace fstop
