#include "core/measure/spline_fit.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

std::vector<double> scattered(int count, double first, double last) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(first, last);
  std::vector<double> places;
  for (int i = 0; i < count; ++i) places.push_back(place(random));
  return places;
}

// A cubic is its own spline. Tolerance: the penalty of 1e-6 of the mean diagonal pulls the ends'
// second differences, 0.12 here, towards zero, and the B-splines' inverse, up to 60, spreads that:
// 7e-6; slopes four times as much per knot of 1/4.
TEST(SplineFit, ReproducesCubics) {
  const auto cubic = [](double x) { return 0.3 + x * (1.0 + x * (-0.2 + 0.05 * x)); };
  const auto slope = [](double x) { return 1.0 + x * (-0.4 + 0.15 * x); };
  const std::vector<double> places = scattered(600, -5.0, 5.0);
  std::vector<double> values;
  for (const double x : places) values.push_back(cubic(x));
  const CubicSpline spline = SplineFit(-5.0, 5.0, 0.25, places).fitted(values);
  for (double x = -4.9; x < 4.9; x += 0.13) {
    EXPECT_NEAR(spline.value(x), cubic(x), 1e-5);
    EXPECT_NEAR(spline.slope(x), slope(x), 4e-5);
  }
}

// A wave of nu h = 1/4 through evenly spread points comes out with the projection's response,
// sinc^8(1/4)/sum sinc^8(1/4 + k) = 1 - 1.6e-4, plus 1e-6 x 4/0.4 of the penalty.
TEST(SplineFit, PassesWavesOfFourKnots) {
  std::vector<double> places, values;
  for (int i = 0; i < 16 * 160; ++i) {
    places.push_back((i + 0.5) / 64.0);
    values.push_back(std::cos(2.0 * std::numbers::pi * places.back()));
  }
  const CubicSpline spline = SplineFit(0.0, 40.0, 0.25, places).fitted(values);
  double product = 0.0;
  constexpr int kPoints = 64 * 20;
  for (int i = 0; i < kPoints; ++i) {
    const double x = 10.0 + i / 64.0;
    product += spline.value(x) * std::cos(2.0 * std::numbers::pi * x) * 2.0 / kPoints;
  }
  double alias = 0.0;
  for (int k = -40; k <= 40; ++k) alias += std::pow(std::abs(0.25 / (0.25 + k)), 8.0);
  EXPECT_NEAR(product, 1.0 / alias, 2e-5);
}

// Gaps are bridged, not invented: a straight line goes on through five knots without a point.
// Tolerance: against the bridge's stiffness, of the order of the penalty, works the ridge of 1e-6
// of it times the values, 2.
TEST(SplineFit, BridgesGapsStraight) {
  std::vector<double> places, values;
  for (int i = 0; i < 400; ++i) {
    const double x = -4.0 + 0.02 * i;
    if (std::abs(x) < 0.7) continue;
    places.push_back(x);
    values.push_back(2.0 - 0.5 * x);
  }
  const CubicSpline spline = SplineFit(-4.0, 4.0, 0.25, places).fitted(values);
  for (double x = -0.7; x <= 0.7; x += 0.1) EXPECT_NEAR(spline.value(x), 2.0 - 0.5 * x, 1e-5);
}

TEST(SplineFit, RefusesWhatCannotBeFitted) {
  EXPECT_THROW(SplineFit(1.0, 1.0, 0.25, {1.0}), Error);
  EXPECT_THROW(SplineFit(0.0, 1.0, 0.0, {0.5}), Error);
  EXPECT_THROW(SplineFit(0.0, 1.0, 0.25, {}), Error);
  EXPECT_THROW(SplineFit(0.0, 1.0, 0.25, {2.0}), Error);
  EXPECT_THROW(CubicSpline(0.0, 1.0, {1.0, 2.0, 3.0}), Error);
}

}  // namespace
}  // namespace fstop
