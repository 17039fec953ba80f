#include "core/measure/sharpness.h"

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/references/blurred_edge.h"

namespace fstop {
namespace {

using Score = SharpnessScore;

Image painted(int size, const std::function<double(double, double)>& value) {
  Image image(size, size, 1);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) *image.at(x, y) = static_cast<float>(value(x, y));
  }
  return image;
}

double score(Score which, const Image& image) {
  return sharpness(which, image.view(), 0, {0, 0, image.width(), image.height()});
}

// A ramp a x + b y has no curvature and a known slope; values are exact in float.
TEST(Sharpness, RampHasItsSlope) {
  const Image ramp = painted(16, [](double x, double y) { return 0.5 * x + 0.25 * y; });
  EXPECT_NEAR(score(Score::variance_of_laplacian, ramp), 0.0, 1e-15);
  EXPECT_NEAR(score(Score::tenengrad, ramp), 0.25 + 0.0625, 1e-15);
  EXPECT_NEAR(score(Score::brenner, ramp), 0.25, 1e-15);
}

// A wave cos(w x) over whole periods: Laplacian 2 (cos w - 1) cos(w x), central slope sin w; half
// of the squares each. Tolerance: float pixels.
TEST(Sharpness, WaveHasItsResponses) {
  const double w = 2.0 * std::numbers::pi / 16.0;
  const Image wave = painted(34, [w](double x, double) { return std::cos(w * x); });
  const double laplacian = 2.0 * (std::cos(w) - 1.0);
  EXPECT_NEAR(score(Score::variance_of_laplacian, wave), 0.5 * laplacian * laplacian, 1e-6);
  EXPECT_NEAR(score(Score::tenengrad, wave), 0.5 * std::sin(w) * std::sin(w), 1e-6);
  EXPECT_NEAR(score(Score::brenner, wave), 0.5 * std::sin(w) * std::sin(w), 1e-6);
}

// An edge without noise: every score falls with the blur's radius.
TEST(Sharpness, FallsWithBlurWithoutNoise) {
  for (const Score which : {Score::variance_of_laplacian, Score::tenengrad, Score::brenner}) {
    double previous = std::numeric_limits<double>::infinity();
    for (const double radius : {0.5, 1.0, 2.0, 4.0, 8.0, 16.0}) {
      const double now =
          score(which, oracle::edge_picture({.angle = 0.1}, oracle::disc_profile(radius)));
      EXPECT_LT(now, previous) << radius;
      previous = now;
    }
  }
}

// Of noise alone, with variance s^2: the Laplacian has (16 + 4) s^2; that is what it measures of
// an edge once the blur has taken the edge away. Tolerance: 126^2 correlated squares, 6 %.
TEST(Sharpness, LaplacianOfABlurredEdgeMeasuresNoise) {
  const double sigma = 0.02 * 0.7;
  const Image image =
      oracle::edge_picture({.angle = 0.1, .noise = 0.02}, oracle::disc_profile(8.0));
  EXPECT_NEAR(score(Score::variance_of_laplacian, image), 20.0 * sigma * sigma,
              0.06 * 20.0 * sigma * sigma);
}

// No universal score: a grating of period P through a disc of R has contrast 2 J1(x)/x,
// x = 2 pi R/P; it vanishes at R = 0.6098 P and is 0.13 again at 0.82 P.
TEST(Sharpness, PeriodicSubjectsComeBackBlurred) {
  constexpr double kPeriod = 16.0;
  const auto grating = [](double radius) {
    const double x = 2.0 * std::numbers::pi * radius / kPeriod;
    const double contrast = 2.0 * std::cyl_bessel_j(1.0, x) / x;
    return painted(64, [contrast](double column, double) {
      return 0.5 + 0.4 * contrast * std::cos(2.0 * std::numbers::pi * column / kPeriod);
    });
  };
  for (const Score which : {Score::variance_of_laplacian, Score::tenengrad, Score::brenner}) {
    EXPECT_GT(score(which, grating(0.82 * kPeriod)), 100.0 * score(which, grating(0.61 * kPeriod)));
  }
}

TEST(Sharpness, RefusesWhatIsOutside) {
  Image image = painted(8, [](double x, double) { return x; });
  const auto refused = [&](const PixelRegion& region, int channel) {
    EXPECT_THROW(sharpness(Score::tenengrad, std::as_const(image).view(), channel, region), Error);
  };
  refused({0, 0, 2, 8}, 0);
  refused({0, 0, 9, 8}, 0);
  refused({-1, 0, 4, 4}, 0);
  refused({0, 0, 8, 8}, 1);
  *image.at(4, 4) = std::numeric_limits<float>::infinity();
  refused({0, 0, 8, 8}, 0);
}

}  // namespace
}  // namespace fstop
