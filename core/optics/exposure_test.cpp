#include "core/optics/exposure.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/thin_lens.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The fixture's own statement: 1e-12 relative. The corner is sensor_width/2 off the axis.
TEST(Illuminance, AgreesWithEveryRowOfTheFixture) {
  const nlohmann::json table = oracle::fixture("thinlens");
  for (const nlohmann::json& row : table.at("rows")) {
    const ThinLens lens{.focal_length = oracle::millimetres(row.at("f")), .f_number = row.at("N")};
    const Length focus = oracle::millimetres(row.at("focus_distance"));
    const double working = working_f_number(lens, focus);
    const Length v = image_distance(lens.focal_length, focus);
    const Length corner = oracle::millimetres(row.at("sensor_width")) / 2.0;
    const auto difference = [&](double actual, const char* column) {
      return oracle::relative_difference(actual, oracle::number(row.at(column)));
    };
    const double on_axis = relative_illuminance_on_axis(working);
    EXPECT_LE(difference(on_axis, "illuminance_on_axis_flat_pupil"), 1e-12) << row.dump();
    EXPECT_LE(difference(relative_illuminance(working, corner, v), "illuminance_corner_flat_pupil"),
              1e-12)
        << row.dump();
    // The usual law is only contrast: larger by exactly 1/(4 N_w^2).
    const double small = oracle::number(row.at("illuminance_on_axis_small_aperture"));
    EXPECT_NEAR(small / on_axis - 1.0, 1.0 / (4.0 * working * working), 1e-12) << row.dump();
  }
}

TEST(Illuminance, UsualLawIsHighForWideApertures) {
  const auto excess = [](double N) {
    return 1.0 / (4 * N * N) / relative_illuminance_on_axis(N) - 1.0;
  };
  EXPECT_NEAR(excess(1.0), 0.25, 1e-15);
  EXPECT_NEAR(excess(1.436), 0.12, 0.002);  // f/1.4 at 2 m
  EXPECT_NEAR(excess(4.0), 0.016, 0.0005);
}

// Every surface element of the pupil sends L cos^2 dA/r^2: integrated over the disc, without the
// closed form. The trapezoidal rule is exact on the circle, the midpoint rule in r^2 leaves
// (1/400)^2 of the second derivative, below 1e-5.
double integrated_illuminance(double working_f_number, double tangent) {
  const double radius_squared = 1.0 / (4.0 * working_f_number * working_f_number);  // v = 1
  constexpr int kRings = 400;
  constexpr int kSpokes = 64;
  double sum = 0.0;
  for (int i = 0; i < kRings; ++i) {
    const double r = std::sqrt(radius_squared * (i + 0.5) / kRings);
    for (int k = 0; k < kSpokes; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kSpokes;
      const double distance_squared =
          1.0 + r * r + tangent * tangent - 2.0 * r * tangent * std::cos(angle);
      sum += 1.0 / (distance_squared * distance_squared);
    }
  }
  return radius_squared * sum / (kRings * kSpokes);
}

TEST(Illuminance, IsTheIntegralOverThePupil) {
  for (const double N : {0.7, 1.0, 1.4, 2.8, 8.0}) {
    for (const double tangent : {0.0, 0.2, 0.5, 1.0}) {
      const double exact = relative_illuminance(N, tangent * 50.0_mm, 50.0_mm);
      EXPECT_NEAR(exact / integrated_illuminance(N, tangent), 1.0, 1e-5)
          << "N " << N << ", tan " << tangent;
    }
  }
}

TEST(Illuminance, OnAxisIsTheLimitOfTheGeneralForm) {
  for (const double N : {0.25, 0.5, 0.6, 1.0, 5.6, 256.0, 1e6}) {
    // Both forms are four roundings long.
    EXPECT_NEAR(relative_illuminance(N, Length{}, 50.0_mm) / relative_illuminance_on_axis(N), 1.0,
                1e-15)
        << N;
  }
  EXPECT_EQ(relative_illuminance(2.0, 10.0_mm, kInfinitelyFar),
            relative_illuminance(2.0, Length{}, 50.0_mm));
}

// cos^4 holds for a small pupil; the next term is of the order of the pupil's solid angle. With
// N_w = 1e4 that is 2.5e-9, and digits must survive where the textbook form would have none.
TEST(Illuminance, CosineFourthIsTheSmallPupilLimit) {
  for (const Length height : {Length{}, 5.0_mm, 20.0_mm, 60.0_mm}) {
    const double ratio =
        relative_illuminance(1e4, height, 50.0_mm) / relative_illuminance_on_axis(1e4);
    EXPECT_NEAR(ratio / cosine_fourth(height, 50.0_mm), 1.0, 2e-8) << height.si();
  }
}

TEST(Illuminance, NeverExceedsOneNorGrowsOffTheAxis) {
  for (double N = 0.01; N < 300.0; N *= 1.3) {
    double last = 1.0;
    for (double tangent = 0.0; tangent < 4.0; tangent += 0.1) {
      const double value = relative_illuminance(N, tangent * 50.0_mm, 50.0_mm);
      EXPECT_LE(value, last + 1e-15) << "N " << N << ", tan " << tangent;
      EXPECT_GT(value, 0.0);
      last = value;
    }
  }
}

TEST(CosineFourth, IsOneQuarterAtFortyFiveDegrees) {
  EXPECT_EQ(cosine_fourth(50.0_mm, 50.0_mm), 0.25);
  EXPECT_EQ(cosine_fourth(Length{}, 50.0_mm), 1.0);
  EXPECT_EQ(cosine_fourth(-(50.0_mm), 50.0_mm), 0.25);
  EXPECT_NEAR(cosine_fourth(36.0_mm, 50.0_mm), std::pow(std::cos(std::atan(0.72)), 4), 1e-15);
}

TEST(Illuminance, RefusesWhatLiesOutsideItsDomain) {
  for (const double N : {0.0, -1.0, kNan}) {
    EXPECT_THROW(relative_illuminance_on_axis(N), Error);
    EXPECT_THROW(relative_illuminance(N, 1.0_mm, 50.0_mm), Error);
  }
  for (const Length v : {Length{}, -(50.0_mm), Length::si(kNan)}) {
    EXPECT_THROW(relative_illuminance(2.0, 1.0_mm, v), Error);
  }
  EXPECT_THROW(relative_illuminance(2.0, Length::si(kNan), 50.0_mm), Error);
}

TEST(ExposureFactor, IsOneAtItsReference) {
  EXPECT_DOUBLE_EQ(exposure_factor(1.0 / 125.0, 100.0, 8.0), 1.0);
}

TEST(ExposureFactor, FollowsTimeSpeedAndSquareOfTheWorkingNumber) {
  const double reference = exposure_factor(1.0 / 125.0, 100.0, 8.0);
  EXPECT_DOUBLE_EQ(exposure_factor(1.0 / 250.0, 100.0, 8.0), reference / 2);
  EXPECT_DOUBLE_EQ(exposure_factor(1.0 / 125.0, 400.0, 8.0), reference * 4);
  EXPECT_DOUBLE_EQ(exposure_factor(1.0 / 125.0, 100.0, 4.0), reference * 4);
  // Sunny 16: f/16 at 1/125 s and ISO 100 is two stops under the reference.
  EXPECT_DOUBLE_EQ(exposure_factor(1.0 / 125.0, 100.0, 16.0), 0.25);
}

TEST(ExposureFactor, RefusesWhatLiesOutsideItsDomain) {
  for (const double bad : {0.0, -1.0, kNan, kInfinity}) {
    EXPECT_THROW(exposure_factor(bad, 100.0, 8.0), Error) << bad;
    EXPECT_THROW(exposure_factor(0.01, bad, 8.0), Error) << bad;
    EXPECT_THROW(exposure_factor(0.01, 100.0, bad), Error) << bad;
  }
}

}  // namespace
}  // namespace fstop
