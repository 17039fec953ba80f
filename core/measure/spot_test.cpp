#include "core/measure/spot.h"

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr Vec2 kCentre = {50.3, 47.8};

// Pixel averages of `density` (of x, y from kCentre) by 32 x 32 points, on an even background.
Image spot_image(const std::function<double(double, double)>& density, double background = 0.0) {
  constexpr int kSide = 32;
  Image image(101, 96, 1);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      double sum = 0.0;
      for (int i = 0; i < kSide * kSide; ++i) {
        sum += density(x + (i % kSide + 0.5) / kSide - kCentre.x,
                       y + (i / kSide + 0.5) / kSide - kCentre.y);
      }
      *image.at(x, y) = static_cast<float>(background + sum / (kSide * kSide));
    }
  }
  return image;
}

SpotSpec whole(const Image& image) {
  return {.region = {.x = 0, .y = 0, .width = image.width(), .height = image.height()}};
}

// Pixels sample the disc's average over their square, and the sum over them is not the integral: by
// Poisson's formula the mean square errs by the four nearest aliases, each at most
// 2 |sinc'(1)| |jinc'|/(4 pi^2) with jinc' of a disc of d px at one cycle/px at most
// 2 sqrt(2/(pi pi d)): 0.182/sqrt(d) px^2 in all, or 0.73/d^1.5 px of the diameter. 32 x 32 points
// that place the rim within 1/32 px at random add less than 0.1 %.
TEST(Spot, ADiscHasItsDiameter) {
  for (const double diameter : {5.0, 12.5, 40.0, 70.0}) {
    const Image image = spot_image(
        [&](double x, double y) { return std::hypot(x, y) <= diameter / 2.0 ? 0.7 : 0.0; }, 0.2);
    SpotSpec spec = whole(image);
    spec.fractions = {0.25};
    const Spot spot = measured_spot(image.view(), spec);
    EXPECT_NEAR(spot.background, 0.2, 1e-6);
    EXPECT_NEAR(spot.energy, 0.7 * kPi * diameter * diameter / 4.0, 2e-3 * spot.energy);
    EXPECT_NEAR(spot.centroid.x, kCentre.x, 0.02);
    EXPECT_NEAR(spot.centroid.y, kCentre.y, 0.02);
    EXPECT_NEAR(spot.disc_diameter, diameter, 0.73 / std::pow(diameter, 1.5) + 1e-3 * diameter);
    EXPECT_NEAR(spot.mean_square, diameter * diameter / 8.0,
                0.182 / std::sqrt(diameter) + 2e-3 * spot.mean_square);
    // A quarter of an even disc's energy lies within half of its diameter; parts of 1/8 px and
    // what the pixels at the rim of so small a circle hold leave 2 %.
    EXPECT_NEAR(spot.encircled_diameters.at(0) / diameter, 0.5, 0.02);
  }
}

// 1 - exp(-r^2/(2 s^2)) of a Gaussian's energy lies within r; the pixel's square adds 1/12 to s^2.
TEST(Spot, AGaussianHasItsMomentsAndCircles) {
  const double s = 4.0;
  const Image image =
      spot_image([&](double x, double y) { return std::exp(-(x * x + y * y) / (2.0 * s * s)); });
  SpotSpec spec = whole(image);
  spec.background = 0.0;
  spec.fractions = {0.5, 0.838};
  const Spot spot = measured_spot(image.view(), spec);
  EXPECT_NEAR(spot.mean_square, 2.0 * s * s, 1e-3 * spot.mean_square);
  EXPECT_NEAR(spot.energy, 2.0 * kPi * s * s, 1e-4 * spot.energy);
  // As each pixel's light is spread over its square once more.
  const double seen = std::sqrt(s * s + 2.0 / 12.0);
  for (std::size_t i = 0; i < 2; ++i) {
    const double expected = 2.0 * seen * std::sqrt(-2.0 * std::log(1.0 - spec.fractions[i]));
    EXPECT_NEAR(spot.encircled_diameters.at(i), expected, 2e-3 * expected);
  }
}

// The mean square of a disc blurred by a source's disc is the sum of both.
TEST(Spot, TheSourceIsTakenOff) {
  const double s = 3.0;
  const Image image =
      spot_image([&](double x, double y) { return std::exp(-(x * x + y * y) / (2.0 * s * s)); });
  SpotSpec spec = whole(image);
  spec.source_diameter = 6.0;
  EXPECT_NEAR(measured_spot(image.view(), spec).mean_square, 2.0 * s * s - 36.0 / 8.0, 0.02);
  spec.source_diameter = 13.0;
  EXPECT_THROW(measured_spot(image.view(), spec), Error);
}

// A square of side a: mean square a^2/6, and the disc of its area.
TEST(Spot, AnIrisOfFourBladesIsASquare) {
  const double side = 21.0;
  const Image image = spot_image([&](double x, double y) {
    return std::max(std::abs(x), std::abs(y)) <= side / 2.0 ? 1.0 : 0.0;
  });
  SpotSpec spec = whole(image);
  spec.blades = 4;
  const Spot spot = measured_spot(image.view(), spec);
  EXPECT_NEAR(spot.mean_square, side * side / 6.0, 2e-3 * spot.mean_square);
  EXPECT_NEAR(spot.disc_diameter, side * std::sqrt(4.0 / kPi), 1e-3 * side);
}

TEST(Spot, RefusesWhatIsNoSpot) {
  Image image(16, 16, 1);
  SpotSpec good = whole(image);
  const auto refuses = [&](const SpotSpec& spec) {
    EXPECT_THROW(measured_spot(std::as_const(image).view(), spec), Error);
  };
  refuses(good);  // no light
  *image.at(8, 8) = 1.0F;
  refuses(good);  // one pixel is no wider than a pixel
  for (const auto& [x, y] : {std::pair{7, 8}, {9, 8}, {8, 7}, {8, 9}}) *image.at(x, y) = 1.0F;
  EXPECT_NO_THROW(measured_spot(std::as_const(image).view(), good));
  SpotSpec wrong = good;
  wrong.region.width = 17;
  refuses(wrong);
  wrong = good;
  wrong.region.height = 2;
  refuses(wrong);
  wrong = good;
  wrong.channel = 1;
  refuses(wrong);
  wrong = good;
  wrong.blades = 2;
  refuses(wrong);
  wrong = good;
  wrong.fractions = {1.0};
  refuses(wrong);
  wrong = good;
  wrong.background = 2.0;  // all is darker than the background
  refuses(wrong);
  *image.at(0, 0) = std::numeric_limits<float>::quiet_NaN();
  refuses(good);
}

}  // namespace
}  // namespace fstop
