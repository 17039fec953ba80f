// The filters that average over a footprint, on sinusoids, whose averages have closed forms.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/scene/summed_area.h"
#include "core/scene/texture.h"

namespace fstop {
namespace {

constexpr int kSize = 256;

// 1/2 + 1/2 sin(2 pi waves x), constant over each texel: its mean there.
TextureSource sinusoid(int waves, TextureFilter filter) {
  TextureSource source{.name = "sinusoid", .filter = filter};
  source.image = Image(kSize, kSize, 3);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double phase = 2.0 * std::numbers::pi * waves * (x + 0.5) / kSize;
      std::fill_n(source.image.at(x, y), 3, static_cast<float>(0.5 + 0.5 * std::sin(phase)));
    }
  }
  return source;
}

double sinc(double x) {
  return x == 0.0 ? 1.0 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
}

// The amplitude of the wave in lookups over `footprint` texels, by its first Fourier coefficient.
// Aliases of 64 lookups a texel, whose corners have slopes of their own, are below 2e-6.
double amplitude(const Texture& texture, int waves, float footprint, int lookups = 16384) {
  double real = 0.0;
  double imaginary = 0.0;
  for (int i = 0; i < lookups; ++i) {
    const double u = (i + 0.5) / lookups;
    const double value = double{texture.sample(
        static_cast<float>(u), 0.37F + 0.0001F * static_cast<float>(i % 997), footprint)[0]};
    real += value * std::cos(2.0 * std::numbers::pi * waves * u);
    imaginary += value * std::sin(2.0 * std::numbers::pi * waves * u);
  }
  return 2.0 * std::hypot(real, imaginary) / lookups;
}

// A box of w texels over texels of one: sinc(f w) sinc(f), f in waves a texel; the image's samples
// are the wave itself, so that only the texel's box counts beside.
TEST(TextureFilters, SummedAreaIsTheBoxOfASinusoid) {
  for (const int waves : {3, 8, 20}) {
    const Texture texture(sinusoid(waves, TextureFilter::summed_area));
    const double f = double(waves) / kSize;
    for (const double width : {1.0, 2.5, 7.0, 16.0, 40.0}) {
      EXPECT_NEAR(amplitude(texture, waves, static_cast<float>(width)),
                  0.5 * std::abs(sinc(f * width)) * sinc(f), 2e-6)
          << waves << " waves, " << width << " texels";
    }
  }
}

// Level l of the pyramid averages 2^l texels (a box), of which a lookup mixes two (a tent of 2^l
// texels, sinc^2): 1/2 sinc(f 2^l)^3 up to aliases of the coarse samples, which the pyramid's
// Nyquist keeps small here: the tent's at frequency 1 - f 2^l leave another frequency.
// The box of 2^l texels is a sum of samples: sin(pi f 2^l)/(2^l sin(pi f)).
TEST(TextureFilters, TheMipMapIsTheBoxAndTheTentOfASinusoid) {
  constexpr int kWaves = 4;
  const Texture texture(sinusoid(kWaves, TextureFilter::mipmap));
  const double f = double(kWaves) / kSize;
  const auto level_amplitude = [&](int level) {
    const double texels = std::exp2(level);
    const double box =
        std::sin(std::numbers::pi * f * texels) / (texels * std::sin(std::numbers::pi * f));
    return 0.5 * box * std::pow(sinc(f * texels), 2);
  };
  for (int level = 0; level <= 4; ++level) {
    EXPECT_NEAR(amplitude(texture, kWaves, static_cast<float>(std::exp2(level))),
                level_amplitude(level), 1e-5)
        << level;
  }
  // Half way between two levels, by the logarithm, the mean of both.
  EXPECT_NEAR(amplitude(texture, kWaves, std::exp2(2.5F)),
              0.5 * (level_amplitude(2) + level_amplitude(3)), 1e-4);
}

// A texel at random within w: in the mean the same box. 65,536 lookups of a standard deviation of
// at most 0.36: the amplitude is known to sqrt(2/65536) 0.36 = 0.002, 4 of which bound it.
TEST(TextureFilters, StochasticLookupsAverageToTheBox) {
  constexpr int kWaves = 6;
  const Texture texture(sinusoid(kWaves, TextureFilter::stochastic));
  const double f = double(kWaves) / kSize;
  for (const double width : {1.0, 8.0, 24.0}) {
    EXPECT_NEAR(amplitude(texture, kWaves, static_cast<float>(width), 65536),
                0.5 * std::abs(sinc(f * width)) * sinc(f), 0.008)
        << width;
  }
}

// Far beyond the edges of an image that goes on as it ends there is the edge alone, however wide
// the lookup.
TEST(TextureFilters, FarBeyondAClampedImageIsItsEdge) {
  for (const TextureFilter filter : {TextureFilter::summed_area, TextureFilter::stochastic}) {
    TextureSource source = sinusoid(1, filter);
    source.wrap = TextureWrap::clamp;
    const float left = source.image.at(0, 0)[0];
    const float right = source.image.at(kSize - 1, 0)[0];
    const Texture texture(source);
    for (const float far : {30.0F, 3000.0F, 1e5F, 1e6F}) {
      const float width = far * kSize / 20.0F;
      EXPECT_NEAR(texture.sample(-far, 0.5F, width)[0], left, 1e-6F) << far;
      EXPECT_NEAR(texture.sample(far, 0.5F, width)[0], right, 1e-6F) << far;
    }
  }
}

TEST(TextureFilters, StochasticLookupsReadWholeTexels) {
  TextureSource source = sinusoid(1, TextureFilter::stochastic);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      std::fill_n(source.image.at(x, y), 3, (x + y) % 2 == 0 ? 1.0F : 0.0F);
    }
  }
  const Texture texture(source);
  double sum = 0.0;
  for (int i = 0; i < 10000; ++i) {
    const float value = texture.sample(static_cast<float>(i) * 0.6180339F, 0.3F, 4.0F)[0];
    EXPECT_TRUE(value == 0.0F || value == 1.0F);
    sum += double{value};
  }
  EXPECT_NEAR(sum / 10000, 0.5, 0.02);  // 4 standard errors of a coin's
}

// Means of rectangles of a small image, by adding the parts of its texels up.
TEST(SummedArea, MeansAreThoseOfTheTexels) {
  Image image(5, 4, 3);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 5; ++x) {
      for (int c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>((7 * x + 3 * y + c) % 11);
    }
  }
  const auto texel = [&](int x, int y, int c, bool repeats) {
    const int column = repeats ? ((x % 5) + 5) % 5 : std::clamp(x, 0, 4);
    const int row = repeats ? ((y % 4) + 4) % 4 : std::clamp(y, 0, 3);
    return double{image.at(column, row)[c]};
  };
  for (const bool repeats : {true, false}) {
    const SummedArea sums(image, repeats);
    for (const auto& [x, y, w, h] :
         {std::array{2.5, 2.0, 3.0, 2.0}, std::array{0.3, 0.1, 1.7, 2.2},
          std::array{4.9, 3.8, 2.5, 1.0}, std::array{-3.2, 9.1, 4.0, 3.0},
          std::array{2.0, 2.0, 0.01, 0.01}}) {
      const auto mean = sums.mean(x, y, w, h);
      for (int c = 0; c < 3; ++c) {
        double wanted = 0.0;
        for (int j = -12; j < 16; ++j) {
          for (int i = -12; i < 16; ++i) {
            const auto overlap = [](double a, double b, int k) {
              return std::max(0.0, std::min(b, k + 1.0) - std::max(a, double(k)));
            };
            wanted += overlap(x - w / 2, x + w / 2, i) * overlap(y - h / 2, y + h / 2, j) *
                      texel(i, j, c, repeats);
          }
        }
        EXPECT_NEAR(double{mean[static_cast<std::size_t>(c)]}, wanted / (w * h), 2e-6)
            << x << ", " << y << (repeats ? " repeated" : " clamped");
      }
    }
  }
}

TEST(SummedArea, MoreThanTheWholeIsTheMeanWhereItRepeats) {
  Image image(4, 4, 3);
  for (int i = 0; i < 48; ++i)
    image.pixels()[static_cast<std::size_t>(i)] = static_cast<float>(i / 3);
  EXPECT_NEAR(SummedArea(image, true).mean(1.3, 2.9, 100.0, 100.0)[0], 7.5F, 1e-6F);
}

}  // namespace
}  // namespace fstop
