#include "core/post/far_halo.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace fstop {
namespace {

// One bright pixel: the halo is its density everywhere, to what linear interpolation on b/4 costs,
// (1/4)^2/8 of the second derivative, 3/b^2: 2.4 % at the centre, less outside.
TEST(FarHalo, OfAPointIsItsDensity) {
  Image light(200, 120, 1);
  const double radius = 16.0;
  const double kappa = 3.0;
  // The middle of a grid square of 4 pixels, as a point has no better place.
  for (int y = 60; y < 64; ++y) {
    for (int x = 100; x < 104; ++x) *light.at(x, y) = 1.0F;
  }
  const FarHalo halo(light, 1, kappa, radius);
  for (const double x : {3.0, 40.0, 102.0, 110.0, 150.0, 197.0}) {
    for (const double y : {1.0, 62.0, 90.0}) {
      const double square = std::pow(x - 102.0, 2) + std::pow(y - 62.0, 2) + radius * radius;
      const double density = 16.0 * kappa / (2.0 * std::numbers::pi * std::pow(square, 1.5));
      EXPECT_NEAR(halo.at(x, y) / density, 1.0, 0.03) << x << ", " << y;
    }
  }
}

TEST(FarHalo, HoldsTheEnergyItIsGivenAndWrapsNothing) {
  // Two cells along a pixel; light in one corner stays out of the opposite one.
  Image light(400, 400, 1);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) *light.at(x, y) = 1.0F;  // 16 pixels
  }
  const double radius = 16.0;
  const FarHalo halo(light, 2, 1.0, radius);
  const double distance = 2.0 * std::pow(197.0, 2);
  const double far = 16.0 / (2.0 * std::numbers::pi * std::pow(distance + 256.0, 1.5));
  EXPECT_NEAR(halo.at(199.0, 199.0) / far, 1.0, 0.02);

  Image centre(400, 400, 1);
  for (int y = 196; y < 204; ++y) {
    for (int x = 196; x < 204; ++x) *centre.at(x, y) = 1.0F;
  }
  const FarHalo spread(centre, 2, 1.0, radius);
  double sum = 0.0;
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) sum += static_cast<double>(spread.at(x + 0.5, y + 0.5));
  }
  // Of kappa/b a disc of radius R holds 1 - b/sqrt(R^2 + b^2); the square of side 200 lies between
  // the discs of 100 and 141.
  const auto within = [&](double r) {
    return 16.0 / radius * (1.0 - radius / std::sqrt(r * r + radius * radius));
  };
  EXPECT_GT(sum, within(100.0));
  EXPECT_LT(sum, within(141.0));
}

}  // namespace
}  // namespace fstop
