#include "core/measure/star_contrast.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kSize = 200;
const SinusoidalStar kStar{
    .centre = {100.3, 99.6}, .cycles = 24, .phase = 0.4, .mean = 0.5, .amplitude = 0.45};

double star_value(double right, double up) {
  return kStar.mean +
         kStar.amplitude * std::cos(kStar.cycles * std::atan2(up, right) - kStar.phase);
}

// The star seen through a uniform disc of `radius` px, by 40 x 6 points of equal area.
Image blurred_star(double radius) {
  constexpr int kTurn = 40, kRings = 6;
  Image image(kSize, kSize, 1);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      double sum = 0.0;
      for (int i = 0; i < kTurn * kRings; ++i) {
        const double r = radius * std::sqrt((i / kTurn + 0.5) / kRings);
        const double angle = 2.0 * kPi * (i % kTurn + 0.5) / kTurn;
        sum += star_value(x + 0.5 - kStar.centre.x + r * std::cos(angle),
                          kStar.centre.y - y - 0.5 + r * std::sin(angle));
      }
      *image.at(x, y) = static_cast<float>(sum / (kTurn * kRings));
    }
  }
  return image;
}

// Pixels sampled at their centres: exact but for the ring's width, over which nothing changes
// with radius.
TEST(StarContrast, UnblurredStarKeepsItsContrast) {
  const Image star = blurred_star(0.0);
  for (const double radius : {9.0, 15.0, 40.0, 80.0}) {
    const StarContrast c = star_contrast(star.view(), 0, kStar, radius);
    EXPECT_NEAR(c.modulation, 1.0, 1e-5) << radius;
    EXPECT_NEAR(c.quadrature, 0.0, 1e-5);
    EXPECT_NEAR(c.mean, 1.0, 1e-5);
    EXPECT_NEAR(c.frequency, 24.0 / (2.0 * kPi * radius), 1e-15);
  }
}

// A disc's transfer is 2 J1(x)/x, x = 2 pi nu R, negative between its first zeros: the star's
// contrast turns. Tolerance: curvature, (R/r)^2/4 of the curve's second derivative, 0.01 from
// r = 4 R on.
TEST(StarContrast, ContrastTurnsWhereTheDiscsTransferIsNegative) {
  constexpr double kRadius = 8.0;
  const Image star = blurred_star(kRadius);
  int negative = 0;
  for (double radius = 4.0 * kRadius; radius < 90.0; radius += 3.0) {
    const StarContrast c = star_contrast(star.view(), 0, kStar, radius);
    const double x = 2.0 * kPi * c.frequency * kRadius;
    EXPECT_NEAR(c.modulation, 2.0 * std::cyl_bessel_j(1.0, x) / x, 0.01) << radius;
    EXPECT_NEAR(c.quadrature, 0.0, 1e-3);
    negative += c.modulation < -0.02 ? 1 : 0;
  }
  EXPECT_GE(negative, 3);
}

TEST(StarContrast, RefusesRingsItCannotRead) {
  const Image star = blurred_star(0.0);
  EXPECT_THROW(star_contrast(star.view(), 0, kStar, 7.0), Error);  // 0.546 cycles/px
  EXPECT_THROW(star_contrast(star.view(), 0, kStar, 99.0), Error);
  EXPECT_THROW(star_contrast(star.view(), 1, kStar, 40.0), Error);
  EXPECT_THROW(star_contrast(star.view(), 0, kStar, -1.0), Error);
  SinusoidalStar flat = kStar;
  flat.amplitude = 0.0;
  EXPECT_THROW(star_contrast(star.view(), 0, flat, 40.0), Error);
}

}  // namespace
}  // namespace fstop
