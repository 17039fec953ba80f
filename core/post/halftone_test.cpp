#include "core/post/halftone.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

using Method = HalftoneMethod;

Image flat(int width, int height, float tone) {
  Image image(width, height, 1);
  for (float& value : image.pixels()) value = tone;
  return image;
}

double mean_of(const Image& image) {
  double sum = 0.0;
  for (const float value : image.pixels()) sum += double{value};
  return sum / static_cast<double>(image.pixels().size());
}

// One cell of `tone`, a '#' for a lit pixel.
std::string pattern(const HalftoneSpec& spec, double tone) {
  const int n = static_cast<int>(spec.cell);
  const Image cell = halftone(flat(n, n, static_cast<float>(tone)), spec);
  std::string text;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) text += *cell.at(x, y) > 0.5F ? '#' : '.';
    text += y + 1 < n ? "/" : "";
  }
  return text;
}

// The tone k/n^2 gives the k-th pattern.
void expect_patterns(const HalftoneSpec& spec, const std::vector<std::string>& wanted) {
  const double count = static_cast<double>(wanted.size()) - 1.0;
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    EXPECT_EQ(pattern(spec, static_cast<double>(k) / count), wanted[k]) << "level " << k;
  }
}

// Drawn by hand from the printed growth sequences, not from the orders in the code.
TEST(Halftone, PatternsOfTwoByTwoAreTheDefinition) {
  const std::vector<std::string> wanted = {"../..", "#./..", "#./.#", "##/.#", "##/##"};
  expect_patterns({.method = Method::clustered_dot, .cell = 2}, wanted);
  expect_patterns({.method = Method::dispersed_dot, .cell = 2}, wanted);
}

TEST(Halftone, PatternsOfThreeByThreeAreTheDefinition) {
  expect_patterns({.method = Method::clustered_dot, .cell = 3},
                  {".../.../...", ".../.#./...", ".../##./...", ".../##./.#.", ".../###/.#.",
                   "..#/###/.#.", "..#/###/##.", "#.#/###/##.", "#.#/###/###", "###/###/###"});
  expect_patterns({.method = Method::dispersed_dot, .cell = 3},
                  {".../.../...", ".../.#./...", ".../.##/...", ".#./.##/...", ".#./.##/#..",
                   ".#./###/#..", ".#./###/#.#", ".##/###/#.#", "###/###/#.#", "###/###/###"});
}

TEST(Halftone, PatternsOfFourByFourAreTheDefinition) {
  expect_patterns(
      {.method = Method::clustered_dot, .cell = 4},
      {"..../..../..../....", "..../.#../..../....", "..../.##./..../....", "..../.##./..#./....",
       "..../.##./.##./....", "..../###./.##./....", ".#../###./.##./....", ".##./###./.##./....",
       ".##./####/.##./....", ".##./####/.###/....", ".##./####/.###/..#.", ".##./####/.###/.##.",
       ".##./####/####/.##.", "###./####/####/.##.", "####/####/####/.##.", "####/####/####/.###",
       "####/####/####/####"});
  expect_patterns(
      {.method = Method::dispersed_dot, .cell = 4},
      {"..../..../..../....", "#.../..../..../....", "#.../..../..#./....", "#.#./..../..#./....",
       "#.#./..../#.#./....", "#.#./.#../#.#./....", "#.#./.#../#.#./...#", "#.#./.#.#/#.#./...#",
       "#.#./.#.#/#.#./.#.#", "###./.#.#/#.#./.#.#", "###./.#.#/#.##/.#.#", "####/.#.#/#.##/.#.#",
       "####/.#.#/####/.#.#", "####/##.#/####/.#.#", "####/##.#/####/.###", "####/####/####/.###",
       "####/####/####/####"});
}

TEST(Halftone, EveryCellHasOneLevelMoreThanPixels) {
  for (int n = 2; n <= kLargestCell; ++n) {
    for (const Method method : {Method::clustered_dot, Method::dispersed_dot}) {
      if (method == Method::dispersed_dot && !has_dispersed_order(n)) continue;
      std::set<double> levels;
      for (int k = 0; k <= 2 * n * n; ++k) {
        levels.insert(
            mean_of(halftone(flat(n, n, static_cast<float>(k) / static_cast<float>(2 * n * n)),
                             {.method = method, .cell = static_cast<double>(n)})));
      }
      EXPECT_EQ(levels.size(), static_cast<std::size_t>(n * n + 1)) << n;
    }
  }
}

// A mean over whole cells is k/n^2 for the nearest k: within half a step of 1/n^2.
TEST(Halftone, MeanToneIsWithinHalfAStepOfTheRamp) {
  for (const int levels : {2, 3, 5}) {
    for (const Method method : {Method::clustered_dot, Method::dispersed_dot}) {
      for (const int n : {2, 3, 4, 8}) {
        for (int i = 0; i <= 100; ++i) {
          const double tone = i / 100.0;
          const HalftoneSpec spec{
              .method = method, .cell = static_cast<double>(n), .levels = levels};
          const double mean = mean_of(halftone(flat(3 * n, 2 * n, static_cast<float>(tone)), spec));
          EXPECT_NEAR(mean, tone, 0.5 / (n * n) / (levels - 1) + 1e-6) << n << " at " << tone;
        }
      }
    }
  }
}

// Error diffusion loses what leaves the borders: under half a step for each border pixel.
TEST(Halftone, ErrorDiffusionKeepsTheMeanTone) {
  constexpr int kSide = 128;
  for (const int levels : {2, 4}) {
    for (int i = 0; i <= 50; ++i) {
      const double tone = i / 50.0;
      const HalftoneSpec spec{.method = Method::error_diffusion, .levels = levels};
      const double mean = mean_of(halftone(flat(kSide, kSide, static_cast<float>(tone)), spec));
      EXPECT_NEAR(mean, tone, 0.5 * 4.0 / kSide / (levels - 1)) << tone;
    }
  }
}

// Where dots and pixels have no common period, pixels see all of a dot evenly. What is left is how
// evenly: points of a lattice count an area of A cells to about its boundary in pixels, here
// 64 cells and up, dots of up to 16 px around: 0.005 is a quarter of a pixel a dot of 7 x 7.
TEST(Halftone, RoundDotsCoverTheShareThatTheToneSays) {
  for (const double degrees : {15.0, 33.0, 75.0}) {
    for (int i = 1; i < 40; ++i) {
      const double tone = i / 40.0;
      const HalftoneSpec spec{
          .method = Method::varying_dot, .cell = 7.3, .angle = degrees * std::numbers::pi / 180.0};
      const double mean = mean_of(halftone(flat(400, 400, static_cast<float>(tone)), spec));
      EXPECT_NEAR(mean, tone, 0.005) << degrees << " degrees";
    }
  }
}

// In step with the pixels a screen is a cell of n x n pixels: the nearest of its n^2 + 1 levels.
// Turned by atan(1/2) a screen of sqrt 5 px has 5 pixels a dot.
TEST(Halftone, RoundDotsInStepWithPixelsKeepTheirTone) {
  const auto expect_tones = [](double cell, double angle, int pixels_a_dot) {
    const HalftoneSpec spec{.method = Method::varying_dot, .cell = cell, .angle = angle};
    const int side = 60;  // whole periods of every screen here
    for (int i = 0; i <= 100; ++i) {
      const double tone = i / 100.0;
      const double mean = mean_of(halftone(flat(side, side, static_cast<float>(tone)), spec));
      EXPECT_NEAR(mean, tone, 0.5 / pixels_a_dot + 1e-6) << cell << " px at " << angle;
    }
  };
  for (const int n : {2, 3, 4, 5, 6}) {
    expect_tones(n, 0.0, n * n);
    expect_tones(n, 0.5 * std::numbers::pi, n * n);
  }
  expect_tones(2.0 * std::numbers::sqrt2, 0.25 * std::numbers::pi, 8);
  expect_tones(std::sqrt(5.0), std::atan(0.5), 5);
}

// The picture's own frequencies: the dots stand on a square lattice of side `cell`, turned by
// `angle`, so that the lattice's wave carries the first harmonic, and the unturned one does not.
TEST(Halftone, ScreenHasItsCellAndAngle) {
  constexpr int kSide = 240;
  constexpr double kAngle = std::numbers::pi / 6.0;
  constexpr double kCell = 6.0;
  const Image screen = halftone(flat(kSide, kSide, 0.3F),
                                {.method = Method::varying_dot, .cell = kCell, .angle = kAngle});
  const auto amplitude = [&](double angle) {
    double real = 0.0, imaginary = 0.0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const double phase =
            2.0 * std::numbers::pi * (x * std::cos(angle) + y * std::sin(angle)) / kCell;
        real += double{*screen.at(x, y)} * std::cos(phase);
        imaginary += double{*screen.at(x, y)} * std::sin(phase);
      }
    }
    return std::hypot(real, imaginary) / (kSide * kSide);
  };
  // A disc of area t in a cell: its first harmonic is sqrt(t/pi) J1(2 sqrt(pi t)) = 0.179; the dots
  // of (cos + cos) are discs but for a fourth order in their radius.
  const double disc = std::sqrt(0.3 / std::numbers::pi) *
                      std::cyl_bessel_j(1.0, 2.0 * std::sqrt(std::numbers::pi * 0.3));
  EXPECT_NEAR(amplitude(kAngle), disc, 0.02);
  EXPECT_NEAR(amplitude(kAngle + std::numbers::pi / 2.0), disc, 0.02);
  EXPECT_LT(amplitude(0.0), 0.01);
}

bool is_own_mirror(const std::string& pattern, int n) {
  const auto at = [&](int x, int y) { return pattern[static_cast<std::size_t>(y * (n + 1) + x)]; };
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      if (at(x, y) != at(n - 1 - x, y) || at(x, y) != at(x, n - 1 - y)) return false;
    }
  }
  return true;
}

TEST(Halftone, SymmetricPatternsAreAvoidedUnlessAskedFor) {
  for (const int n : {3, 4, 5, 6, 8}) {
    int symmetric = 0;
    std::set<std::string> asked;
    for (int k = 1; k < n * n; ++k) {
      const double tone = static_cast<double>(k) / (n * n);
      HalftoneSpec spec{.method = Method::clustered_dot, .cell = static_cast<double>(n)};
      symmetric += is_own_mirror(pattern(spec, tone), n) ? 1 : 0;
      spec.symmetric = true;
      asked.insert(pattern(spec, tone));
      EXPECT_TRUE(is_own_mirror(pattern(spec, tone), n));
    }
    // Rings: the different distances in a cell, (x^2 + y^2) of odd or even numbers.
    std::set<int> rings;
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        rings.insert((2 * x - n + 1) * (2 * x - n + 1) + (2 * y - n + 1) * (2 * y - n + 1));
      }
    }
    EXPECT_LT(symmetric, static_cast<int>(rings.size())) << n;
    EXPECT_LE(asked.size(), rings.size() + 1) << n << ": fewer levels";
  }
}

TEST(Halftone, PatternsTradeResolutionForLevels) {
  Image ramp(5, 1, 1);
  for (int x = 0; x < 5; ++x) *ramp.at(x, 0) = static_cast<float>(x) / 4.0F;
  const Image cells =
      halftone(ramp, {.method = Method::dispersed_dot, .cell = 2, .patterns = true});
  ASSERT_EQ(cells.width(), 10);
  ASSERT_EQ(cells.height(), 2);
  for (int x = 0; x < 5; ++x) {
    float lit = 0.0F;
    for (int j = 0; j < 2; ++j) lit += *cells.at(2 * x, j) + *cells.at(2 * x + 1, j);
    EXPECT_EQ(lit, static_cast<float>(x)) << "each pixel is a cell of its own tone";
  }
}

TEST(Halftone, DevicesOfManyLevelsShowOnlyThose) {
  Image ramp(257, 8, 1);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 257; ++x) *ramp.at(x, y) = static_cast<float>(x) / 256.0F;
  }
  for (const Method method : {Method::clustered_dot, Method::dispersed_dot, Method::varying_dot,
                              Method::error_diffusion}) {
    const Image shown = halftone(ramp, {.method = method, .levels = 4});
    const std::set<float> values(shown.pixels().begin(), shown.pixels().end());
    EXPECT_EQ(values, (std::set<float>{0.0F, 1.0F / 3.0F, 2.0F / 3.0F, 1.0F}));
  }
}

TEST(Halftone, ColourKeepsItsChannelsAndGrayTheirLuminance) {
  Image color(64, 64, 3);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      color.at(x, y)[0] = 0.75F;
      color.at(x, y)[1] = 0.25F;
    }
  }
  const auto means = [](const Image& image) {
    std::array<double, 3> sums = {};
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        for (std::size_t c = 0; c < 3; ++c) sums[c] += double{image.at(x, y)[c]} / 4096.0;
      }
    }
    return sums;
  };
  EXPECT_EQ(means(halftone(color, {})), (std::array<double, 3>{0.75, 0.25, 0.0}));
  // 0.2126 * 0.75 + 0.7152 * 0.25 = 0.33825: 5 of 16.
  EXPECT_EQ(means(halftone(color, {.gray = true})),
            (std::array<double, 3>{0.3125, 0.3125, 0.3125}));
}

TEST(Halftone, WhatIsNoToneIsBlackOrWhite) {
  Image color(3, 1, 1);
  *color.at(0, 0) = std::numeric_limits<float>::quiet_NaN();
  *color.at(1, 0) = -1.0F;
  *color.at(2, 0) = std::numeric_limits<float>::infinity();
  for (const Method method :
       {Method::clustered_dot, Method::varying_dot, Method::error_diffusion}) {
    EXPECT_EQ(halftone(color, {.method = method}).pixels(), (std::vector<float>{0.0F, 0.0F, 1.0F}));
  }
}

TEST(Halftone, WhatCannotBeIsRefused) {
  const Image color = flat(4, 4, 0.5F);
  const std::vector<HalftoneSpec> refused = {{.cell = 1},
                                             {.cell = 17},
                                             {.cell = 2.5},
                                             {.cell = std::numeric_limits<double>::quiet_NaN()},
                                             {.method = Method::dispersed_dot, .cell = 5},
                                             {.levels = 1},
                                             {.levels = 257},
                                             {.method = Method::varying_dot, .patterns = true},
                                             {.method = Method::error_diffusion, .patterns = true}};
  for (const HalftoneSpec& spec : refused) EXPECT_THROW(halftone(color, spec), Error);
}

}  // namespace
}  // namespace fstop
