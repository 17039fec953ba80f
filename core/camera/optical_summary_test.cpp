#include "core/camera/optical_summary.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/depth_of_field.h"
#include "core/optics/exposure.h"

namespace fstop {
namespace {

CameraSpec fifty_at_two_metres() {
  CameraSpec camera;
  camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 1.4}, .focus_distance = 2.0_m};
  return camera;
}

CameraSpec pinhole(Length diameter) {
  CameraSpec camera;
  camera.optics = PinholeSpec{.image_distance = 50.0_mm, .diameter = diameter};
  return camera;
}

OpticalSummary summary_of(const CameraSpec& camera, std::optional<Length> coc_limit = {},
                          const std::vector<Length>& distances = {}) {
  return optical_summary(camera, sensor_of(camera, 960, 640), coc_limit, distances);
}

double degrees(double radians) { return radians * 180.0 / std::numbers::pi; }

// The contract's example: 50 mm f/1.4 at 2 m, full frame, 960 x 640 pixels, 550 nm. Every number to
// half a unit of the last digit given there (near_m is given cut off, not rounded).
TEST(OpticalSummary, GivesTheNumbersOfTheContract) {
  const OpticalSummary summary = summary_of(fifty_at_two_metres());
  EXPECT_NEAR(summary.near.si(), 1.9365, 1e-4);
  EXPECT_NEAR(summary.far.si(), 2.0677, 5e-5);
  EXPECT_NEAR(summary.hyperfocal.si(), 59.56, 5e-3);
  EXPECT_NEAR(summary.image_distance.si() * 1e3, 51.28, 5e-3);
  EXPECT_NEAR(summary.working_f_number, 1.436, 5e-4);
  EXPECT_NEAR(summary.airy_diameter.si() * 1e6, 1.9, 0.05);
  EXPECT_NEAR(degrees(summary.view_angle[0]), 38.7, 0.05);
  // The example's intrinsics say 2 atan(320/1367.5) = 26.34; its 26.4 is rounded up.
  EXPECT_NEAR(degrees(summary.view_angle[1]), 26.34, 5e-3);
  EXPECT_NEAR(summary.focal_px, 1367.5, 0.05);
  EXPECT_EQ(summary.principal_point, (Vec2{480, 320}));
}

TEST(OpticalSummary, DefaultLimitIsTheDiagonalOver1442) {
  // sqrt(36^2 + 24^2) = 12 sqrt(13) mm.
  EXPECT_NEAR(summary_of(fifty_at_two_metres()).coc_limit.si(), 12e-3 * std::sqrt(13.0) / 1442,
              1e-19);
  EXPECT_EQ(summary_of(fifty_at_two_metres(), 0.02_mm).coc_limit, 0.02_mm);
}

TEST(OpticalSummary, LimitDecidesTheDepthOfField) {
  const OpticalSummary summary = summary_of(fifty_at_two_metres(), 0.03_mm);
  const DepthOfField range = depth_of_field({50.0_mm, 1.4}, 2.0_m, 0.03_mm);
  EXPECT_EQ(summary.near, range.near);
  EXPECT_EQ(summary.far, range.far);
  EXPECT_EQ(summary.hyperfocal, hyperfocal_distance({50.0_mm, 1.4}, 0.03_mm));
  EXPECT_NEAR(summary.magnification, -50.0 / 1950.0, 1e-16);
}

TEST(OpticalSummary, FocusedAtInfinity) {
  CameraSpec camera = fifty_at_two_metres();
  std::get<LensSpec>(camera.optics).focus_distance = kInfinitelyFar;
  const OpticalSummary summary = summary_of(camera, 0.03_mm, {kInfinitelyFar, 10.0_m});
  EXPECT_EQ(summary.image_distance, 50.0_mm);
  EXPECT_EQ(summary.magnification, 0.0);
  EXPECT_EQ(summary.far, kInfinitelyFar);
  EXPECT_EQ(summary.working_f_number, 1.4);
  EXPECT_EQ(summary.at.at(0).blur_diameter, Length{});
  EXPECT_LT(summary.at.at(1).blur_diameter, Length{});
}

TEST(OpticalSummary, TellsWhereObjectsAreImagedAndHowBlurred) {
  const OpticalSummary summary =
      summary_of(fifty_at_two_metres(), {}, {1.0_m, 2.0_m, kInfinitelyFar, 50.0_mm, 25.0_mm});
  ASSERT_EQ(summary.at.size(), 5U);
  const auto plane = [&](std::size_t i) { return summary.at.at(i); };
  // 1/v = 20 - 1/d dioptres; A = 50/1.4 mm, sensor at 1/19.5 m; pixels of 37.5 um.
  EXPECT_NEAR(plane(0).image_distance.si(), 1.0 / 19.0, 1e-16);
  EXPECT_NEAR(plane(1).image_distance.si(), 1.0 / 19.5, 1e-16);
  EXPECT_EQ(plane(2).image_distance, 50.0_mm);
  EXPECT_EQ(plane(3).image_distance, kInfinitelyFar);
  EXPECT_NEAR(plane(4).image_distance.si(), -0.05, 1e-16);
  EXPECT_NEAR(plane(0).blur_diameter.si(), -0.5 * 0.05 / 1.4 / 19.5, 1e-17);
  EXPECT_EQ(plane(1).blur_diameter, Length{});
  EXPECT_NEAR(plane(2).blur_diameter.si(), 0.5 * 0.05 / 1.4 / 19.5, 1e-17);
  EXPECT_NEAR(plane(2).blur_px, 0.5 * 0.05 / 1.4 / 19.5 / 37.5e-6, 1e-12);
}

TEST(OpticalSummary, WithoutBreathingFramingIsThatOfInfinity) {
  CameraSpec camera = fifty_at_two_metres();
  camera.breathing = false;
  const OpticalSummary summary = summary_of(camera);
  EXPECT_EQ(summary.image_distance, 50.0_mm);
  EXPECT_NEAR(degrees(summary.view_angle[0]), 39.6, 0.05);  // 2 atan(18/50)
  EXPECT_NEAR(summary.focal_px, 50.0 / 0.0375, 1e-9);
}

TEST(OpticalSummary, IlluminanceFallsTowardsTheCorner) {
  const OpticalSummary summary = summary_of(fifty_at_two_metres());
  const double N = summary.working_f_number;
  EXPECT_NEAR(summary.illuminance_on_axis, 1.0 / (4 * N * N + 1), 1e-16);
  // cos^4 of the corner, within the square of the pupil's half-angle, 1/(4 N^2) = 0.12.
  const double cos4 = cosine_fourth(21.633_mm, summary.image_distance);
  const double ratio = summary.illuminance_at_corner / summary.illuminance_on_axis;
  EXPECT_LT(ratio, 1.0);
  EXPECT_NEAR(ratio / cos4, 1.0, 0.12);
}

TEST(OpticalSummary, PinholeIsSharpFromWhereItsShadowMeetsTheLimit) {
  const OpticalSummary summary = summary_of(pinhole(0.02_mm), 0.03_mm, {kInfinitelyFar, 0.1_m});
  // 0.02 (1 + 50/u) = 0.03 at u = 100 mm.
  EXPECT_NEAR(summary.near.si(), 0.1, 1e-15);
  EXPECT_EQ(summary.far, kInfinitelyFar);
  EXPECT_NEAR(summary.hyperfocal.si(), 0.1, 1e-15);
  EXPECT_EQ(summary.magnification, 0.0);
  EXPECT_EQ(summary.image_distance, 50.0_mm);
  EXPECT_NEAR(summary.working_f_number, 2500.0, 1e-9);
  EXPECT_NEAR(summary.at.at(0).blur_diameter.si(), 0.02e-3, 1e-18);
  EXPECT_NEAR(summary.at.at(1).blur_diameter.si(), 0.03e-3, 1e-18);
  EXPECT_EQ(summary.at.at(1).image_distance, 50.0_mm);
}

TEST(OpticalSummary, PinholeWiderThanTheLimitIsNeverSharp) {
  for (const Length diameter : {0.03_mm, 0.35_mm}) {
    const OpticalSummary summary = summary_of(pinhole(diameter), 0.03_mm);
    EXPECT_EQ(summary.near, kInfinitelyFar);
    EXPECT_EQ(summary.far, kInfinitelyFar);
    EXPECT_EQ(summary.hyperfocal, kInfinitelyFar);
  }
}

TEST(OpticalSummary, RefusesWhatTheFormulasRefuse) {
  CameraSpec camera = fifty_at_two_metres();
  EXPECT_THROW(summary_of(camera, Length{}), Error);
  EXPECT_THROW(summary_of(camera, {}, {Length{}}), Error);
  std::get<LensSpec>(camera.optics).focus_distance = 50.0_mm;
  EXPECT_THROW(summary_of(camera), Error);
}

}  // namespace
}  // namespace fstop
