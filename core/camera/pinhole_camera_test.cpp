#include "core/camera/pinhole_camera.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/camera/camera.h"
#include "core/error.h"
#include "core/optics/pinhole.h"

namespace fstop {
namespace {

const Sensor kSensor{.pixel_pitch = 10.0_um, .width = 300, .height = 200};
constexpr Length kScreen = 50.0_mm;
constexpr Length kHole = 0.4_mm;

const PinholeCamera kCamera(kScreen, kHole, kSensor, Pose{});

// The true point of the screen, behind the hole: the mirror image of the upright one.
Vec3 screen_point(Vec2 raster) {
  return {-(raster.x - 150) * 1e-5, -(raster.y - 100) * 1e-5, -kScreen.si()};
}

TEST(PinholeCamera, RaysGoStraightFromTheScreenThroughTheHole) {
  for (const Vec2 raster : {Vec2{150, 100}, Vec2{0, 0}, Vec2{299.5, 13.25}}) {
    for (const Vec2 pupil : {Vec2{0, 0}, Vec2{1, 0}, Vec2{0, -1}, Vec2{-0.6, 0.8}}) {
      const Ray ray = kCamera.ray(raster, pupil);
      const Vec3 in_hole{pupil.x * 0.2e-3, pupil.y * 0.2e-3, 0.0};
      EXPECT_NEAR(norm(ray.origin - in_hole), 0.0, 1e-19);
      const Vec3 expected = normalized(in_hole - screen_point(raster));
      EXPECT_NEAR(norm(ray.direction - expected), 0.0, 4e-16);
    }
  }
}

// The raster whose ray through `pupil` meets the point (0, 0, depth): what the hole's edge draws on
// the screen, found by stepping once along the ray's linear miss.
double raster_offset_meeting_axis(double pupil, Length depth) {
  const auto miss = [&](double offset) {
    const Ray ray = kCamera.ray({150 + offset, 100}, {pupil, 0});
    return ray.origin.x * (1.0 / depth).si() + ray.direction.x / ray.direction.z;
  };
  return -miss(0.0) / (miss(1.0) - miss(0.0));
}

// Slopes of 1e-2 round by 1e-18; one pixel is a slope of 2e-4: 1e-14 pixels and a few roundings.
TEST(PinholeCamera, FarPointDrawsADiscOfTheHolesDiameter) {
  const double left = raster_offset_meeting_axis(-1, kInfinitelyFar);
  const double right = raster_offset_meeting_axis(+1, kInfinitelyFar);
  EXPECT_NEAR(std::abs(right - left) * 1e-5, kHole.si(), 1e-15);
}

TEST(PinholeCamera, NearPointDrawsTheLargerShadow) {
  for (const Length depth : {0.05_m, 0.3_m, 4.0_m}) {
    const double left = raster_offset_meeting_axis(-1, depth);
    const double right = raster_offset_meeting_axis(+1, depth);
    EXPECT_NEAR(std::abs(right - left) * 1e-5, geometric_spot_diameter(kHole, kScreen, depth).si(),
                1e-15)
        << depth.si();
  }
}

// The image is turned upright by a half turn, and the shadow of the hole with it: inverted.
TEST(PinholeCamera, DiscShowsTheHoleInverted) {
  EXPECT_LT(raster_offset_meeting_axis(+1, kInfinitelyFar), 0.0);
}

TEST(PinholeCamera, IdealHoleProjectsThroughItsCentre) {
  const PinholeCamera ideal(kScreen, Length{}, kSensor, Pose{});
  for (const Vec2 pupil : {Vec2{0, 0}, Vec2{1, 0}, Vec2{-0.6, 0.8}}) {
    const Ray ray = ideal.ray({10, 20}, pupil);
    EXPECT_EQ(ray.origin, (Vec3{0, 0, 0}));
    EXPECT_EQ(ray.direction, ideal.ray({10, 20}, {0, 0}).direction);
  }
}

TEST(PinholeCamera, ImageIsUprightAndUnmirrored) {
  const Pose pose = Pose::looking_at({0, 1, 4}, {0, 1, 0}, {0, 1, 0});
  const PinholeCamera camera(kScreen, kHole, kSensor, pose);
  const Vec3 up = camera.ray({150, 0.5}, {0, 0}).direction;
  const Vec3 right = camera.ray({299.5, 100}, {0, 0}).direction;
  EXPECT_GT(up.y, 0.01);
  EXPECT_NEAR(up.x, 0.0, 1e-16);
  EXPECT_GT(right.x, 0.01);
  EXPECT_NEAR(right.y, 0.0, 1e-16);
  EXPECT_LT(right.z, 0.0);
}

// A lens and a pinhole at the same image distance see the same perspective.
TEST(PinholeCamera, CentralProjectionOfALensIsItsChiefRays) {
  CameraSpec spec;
  spec.optics = LensSpec{.lens = {50.0_mm, 1.4}, .focus_distance = 2.0_m};
  const Sensor sensor = sensor_of(spec, 360, 240);
  const Camera lens = camera_of(spec, sensor);
  const PinholeCamera projection = central_projection(spec, sensor);
  EXPECT_EQ(projection.image_distance(), std::get<ThinLensCamera>(lens).image_distance());
  for (const Vec2 raster : {Vec2{180, 120}, Vec2{0.5, 0.5}, Vec2{359, 77}}) {
    const Ray chief = std::get<ThinLensCamera>(lens).ray(raster, {0, 0});
    const Ray ray = projection.ray(raster, {0.7, 0.7});
    EXPECT_EQ(ray.origin, chief.origin);
    EXPECT_NEAR(norm(ray.direction - chief.direction), 0.0, 4e-16);
  }
}

TEST(PinholeCamera, FalloffIsTheFourthPowerOfTheCosine) {
  EXPECT_EQ(kCamera.falloff(kSensor.centre()), 1.0);
  for (const Vec2 raster : {Vec2{0, 0}, Vec2{299, 17}}) {
    EXPECT_NEAR(kCamera.falloff(raster), std::pow(kCamera.ray(raster, {0, 0}).direction.z, 4),
                1e-15);
  }
}

TEST(PinholeCamera, RefusesWhatLiesOutsideItsDomain) {
  const Length nan = Length::si(std::numeric_limits<double>::quiet_NaN());
  for (const Length screen : {Length{}, -kScreen, nan, kInfinitelyFar}) {
    EXPECT_THROW(PinholeCamera(screen, kHole, kSensor, Pose{}), Error) << screen.si();
  }
  for (const Length hole : {-kHole, nan, kInfinitelyFar}) {
    EXPECT_THROW(PinholeCamera(kScreen, hole, kSensor, Pose{}), Error) << hole.si();
  }
}

}  // namespace
}  // namespace fstop
