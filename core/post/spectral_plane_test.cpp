#include "core/post/spectral_plane.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

constexpr int kWidth = 12;
constexpr int kHeight = 10;

SpectralPlane noise() {
  SpectralPlane plane(kWidth, kHeight);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-1.0F, 1.0F);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) *plane.view().at(x, y) = value(random);
  }
  return plane;
}

// The multiplier applied by the definition of the transform, in double precision.
template <typename Multiplier>
double filtered(const SpectralPlane& plane, int x, int y, Multiplier multiplier) {
  std::complex<double> sum = 0.0;
  const double tau = 2.0 * std::numbers::pi;
  for (int fy = -kHeight / 2 + 1; fy <= kHeight / 2; ++fy) {
    for (int fx = -kWidth / 2 + 1; fx <= kWidth / 2; ++fx) {
      std::complex<double> coefficient = 0.0;
      for (int v = 0; v < kHeight; ++v) {
        for (int u = 0; u < kWidth; ++u) {
          const double turn = double(fx * (x - u)) / kWidth + double(fy * (y - v)) / kHeight;
          coefficient += double(*plane.view().at(u, v)) * std::polar(1.0, tau * turn);
        }
      }
      sum += coefficient * multiplier(fx, fy);
    }
  }
  return sum.real() / (kWidth * kHeight);
}

template <typename Multiplier>
void expect_filtered(const SpectralPlane& plane, const SpectralPlane& result,
                     Multiplier multiplier) {
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      // Float transforms of 120 values up to 1.
      EXPECT_NEAR(*result.view().at(x, y), filtered(plane, x, y, multiplier), 1e-5);
    }
  }
}

TEST(SpectralPlane, BackTransformGivesThePlane) {
  const SpectralPlane plane = noise();
  SpectralPlane there = plane;
  there.transform();
  there.invert();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      EXPECT_NEAR(*there.view().at(x, y), *plane.view().at(x, y), 1e-6);
    }
  }
}

TEST(SpectralPlane, RealMultiplierFiltersAsTheDefinitionSays) {
  // Its odd part vanishes at the highest frequencies, where f and -f are one.
  const auto multiplier = [](int fx, int fy) {
    const double tau = 2.0 * std::numbers::pi;
    return 1.0 / (1.0 + fx * fx + fy * fy) +
           0.1 * std::sin(tau * fx / kWidth) * std::sin(tau * fy / kHeight);
  };
  SpectralPlane spectrum = noise();
  spectrum.transform();
  SpectralPlane result(kWidth, kHeight);
  result.add_product(spectrum, [&](int fy, std::span<float> g) {
    for (int fx = 0; fx <= kWidth / 2; ++fx) {
      g[static_cast<std::size_t>(fx)] = static_cast<float>(multiplier(fx, fy));
    }
  });
  result.invert();
  expect_filtered(noise(), result, multiplier);
}

TEST(SpectralPlane, HermitianMultiplierShifts) {
  // exp(-2 pi i (f . d)) moves the plane by d; at the highest frequencies only its real part
  // can act, so the plane is one without them.
  SpectralPlane plane(kWidth, kHeight);
  const auto wave = [](double x, double y) {
    const double tau = 2.0 * std::numbers::pi;
    return std::cos(tau * (2 * x / kWidth + y / kHeight) + 0.3) +
           0.5 * std::sin(tau * (3 * y / kHeight)) + 0.25 * std::cos(tau * (5 * x / kWidth));
  };
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) *plane.view().at(x, y) = static_cast<float>(wave(x, y));
  }
  const double dx = 1.3;
  const double dy = -0.6;
  plane.transform();
  SpectralPlane moved(kWidth, kHeight);
  moved.add_complex_product(plane, [&](int fy, std::span<std::complex<float>> g) {
    for (int fx = 0; fx <= kWidth / 2; ++fx) {
      const double turn = -2.0 * std::numbers::pi * (fx * dx / kWidth + fy * dy / kHeight);
      g[static_cast<std::size_t>(fx)] = std::complex<float>(std::polar(1.0, turn));
    }
  });
  moved.invert();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      EXPECT_NEAR(*moved.view().at(x, y), wave(x - dx, y - dy), 1e-5);
    }
  }
}

TEST(SpectralPlane, LengthsAreEvenAndSmooth) {
  for (const int n : {1, 2, 3, 7, 97, 961, 2593}) {
    int length = fast_transform_length(n);
    EXPECT_GE(length, n);
    EXPECT_EQ(length % 2, 0);
    for (const int prime : {2, 3, 5}) {
      while (length % prime == 0) length /= prime;
    }
    EXPECT_EQ(length, 1) << n;
  }
  EXPECT_THROW(SpectralPlane(3, 4), Error);
}

}  // namespace
}  // namespace fstop
