#include "core/camera/thin_lens_camera.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "core/camera/camera.h"
#include "core/error.h"

namespace fstop {
namespace {

const ThinLens kFifty{.focal_length = 50.0_mm, .f_number = 1.8};
const Sensor kSensor{.pixel_pitch = 4.0_um, .width = 640, .height = 480};
constexpr Length kFocuses[] = {0.5_m, 2.0_m, kInfinitelyFar};

ThinLensCamera camera_focused_at(Length focus) { return {kFifty, focus, kSensor, Pose{}}; }

// Where a ray crosses depth d, seen from the lens centre; finite for d = infinity.
Vec2 slope_at(const Ray& ray, Length d) {
  const double vergence = (1.0 / d).si();
  return {ray.origin.x * vergence + ray.direction.x / ray.direction.z,
          ray.origin.y * vergence + ray.direction.y / ray.direction.z};
}

// One pixel's cone of rays, cut at depth d and projected to the sensor, is the circle of
// confusion. ray() never calls circle_of_confusion(): two derivations check each other.
// Tolerance: slopes and v below 0.1 round by about 1e-18 m; a hundred roundings.
TEST(ThinLensCamera, PixelConeIsTheCircleOfConfusion) {
  for (const Length focus : kFocuses) {
    const ThinLensCamera camera = camera_focused_at(focus);
    for (const Length depth : {0.3_m, 2.0_m, 7.0_m, kInfinitelyFar}) {
      const double left = slope_at(camera.ray(kSensor.centre(), {-1, 0}), depth).x;
      const double right = slope_at(camera.ray(kSensor.centre(), {+1, 0}), depth).x;
      const Length measured = std::abs(right - left) * camera.image_distance();
      EXPECT_NEAR(measured.si(), circle_of_confusion(kFifty, focus, depth).si(), 1e-16)
          << "focus " << focus.si() << " m, depth " << depth.si() << " m";
    }
  }
}

// The same off the axis and for the whole rim: the cut is a circle around the chief ray's point.
TEST(ThinLensCamera, ConeOfEveryPixelIsACircle) {
  for (const Length focus : kFocuses) {
    const ThinLensCamera camera = camera_focused_at(focus);
    for (const Length depth : {0.3_m, 7.0_m, kInfinitelyFar}) {
      const double radius = 0.5 * circle_of_confusion(kFifty, focus, depth).si();
      for (const Vec2 raster : {Vec2{0, 0}, Vec2{639.5, 0.5}, Vec2{100.25, 333.0}}) {
        const Vec2 centre = slope_at(camera.ray(raster, {0, 0}), depth);
        for (int i = 0; i < 12; ++i) {
          const double angle = i * std::numbers::pi / 6;
          const Vec2 rim =
              slope_at(camera.ray(raster, {std::cos(angle), std::sin(angle)}), depth) - centre;
          EXPECT_NEAR(std::hypot(rim.x, rim.y) * camera.image_distance().si(), radius, 1e-16);
        }
      }
    }
  }
}

// Refraction by the lens and the way to the sensor as ray matrices, which ray() does not use: light
// that comes in with slope -m at height y leaves with -m - y/f and arrives v later at y + v(-m -
// y/f). It must be the mirror image of the upright point, for every point of the pupil.
TEST(ThinLensCamera, RayMatricesSendEveryRayToItsPixel) {
  const double f = kFifty.focal_length.si();
  for (const Length focus : kFocuses) {
    const ThinLensCamera camera = camera_focused_at(focus);
    const double v = image_distance(kFifty.focal_length, focus).si();
    EXPECT_EQ(camera.image_distance().si(), v);
    for (const Vec2 raster : {Vec2{320, 240}, Vec2{0.5, 0.5}, Vec2{639.5, 100.0}}) {
      for (const Vec2 pupil : {Vec2{0, 0}, Vec2{1, 0}, Vec2{-0.6, 0.8}, Vec2{0.1, -0.3}}) {
        const Ray ray = camera.ray(raster, pupil);
        const Vec2 slope = slope_at(ray, kInfinitelyFar);
        EXPECT_NEAR(ray.origin.x + v * (-slope.x - ray.origin.x / f), -(raster.x - 320) * 4e-6,
                    1e-16);
        EXPECT_NEAR(ray.origin.y + v * (-slope.y - ray.origin.y / f), -(raster.y - 240) * 4e-6,
                    1e-16);
      }
    }
  }
}

TEST(ThinLensCamera, FocusedPlaneIsSharpFromEveryPupilPoint) {
  for (const Length focus : kFocuses) {
    const ThinLensCamera camera = camera_focused_at(focus);
    for (const Vec2 raster : {Vec2{0, 0}, Vec2{320, 240}, Vec2{600, 17}}) {
      const Vec2 chief = slope_at(camera.ray(raster, {0, 0}), focus);
      for (const Vec2 pupil : {Vec2{1, 0}, Vec2{0, -1}, Vec2{-0.6, 0.8}, Vec2{0.3, 0.2}}) {
        const Vec2 slope = slope_at(camera.ray(raster, pupil), focus);
        EXPECT_NEAR(slope.x, chief.x, 1e-16);
        EXPECT_NEAR(slope.y, chief.y, 1e-16);
      }
    }
  }
}

TEST(ThinLensCamera, FocusedAtInfinityRaysOfAPixelAreParallel) {
  const ThinLensCamera camera = camera_focused_at(kInfinitelyFar);
  const Vec3 chief = camera.ray({17, 400}, {0, 0}).direction;
  for (const Vec2 pupil : {Vec2{1, 0}, Vec2{0, 1}, Vec2{-0.5, -0.5}}) {
    EXPECT_EQ(camera.ray({17, 400}, pupil).direction, chief);
  }
}

TEST(ThinLensCamera, RaysStartOnThePupilWithUnitDirection) {
  const ThinLensCamera camera = camera_focused_at(2.0_m);
  const double radius = 0.5 * aperture_diameter(kFifty).si();
  for (const Vec2 pupil : {Vec2{1, 0}, Vec2{0, 1}, Vec2{-0.6, 0.8}}) {
    const Ray ray = camera.ray({100, 100}, pupil);
    EXPECT_EQ(ray.origin, (Vec3{pupil.x * radius, pupil.y * radius, 0.0}));
    EXPECT_NEAR(norm(ray.direction), 1.0, 4e-16);
    EXPECT_GT(ray.direction.z, 0.0);
  }
}

// The raster a world point at finite depth is imaged to, by similar triangles in the camera frame.
Vec2 raster_of(const Pose& pose, Vec3 world, double image_distance) {
  const Vec3 p = pose.from_world(world);
  return {320 + p.x / p.z * image_distance / 4e-6, 240 + p.y / p.z * image_distance / 4e-6};
}

// Upright and unmirrored: what is up in the world is up in the image (smaller y), right is right.
TEST(ThinLensCamera, ImageIsUprightAndUnmirrored) {
  const Pose pose = Pose::looking_at({1, 2, 3}, {1, 2, -5}, {0, 1, 0});
  const ThinLensCamera camera(kFifty, 2.0_m, kSensor, pose);
  const Vec3 up = camera.ray({320, 0.5}, {0, 0}).direction;
  const Vec3 right = camera.ray({639.5, 240}, {0, 0}).direction;
  EXPECT_GT(up.y, 0.01);
  EXPECT_NEAR(up.x, 0.0, 1e-16);
  EXPECT_GT(right.x, 0.01);
  EXPECT_NEAR(right.y, 0.0, 1e-16);
  EXPECT_LT(up.z, 0.0);
}

// A point of the focused plane is met by the rays of its raster from all over the pupil.
TEST(ThinLensCamera, RaysOfARasterMeetItsObjectPoint) {
  const Pose pose = Pose::looking_at({1, 2, 3}, {4, 0, -5}, {0.1, 1, 0});
  const ThinLensCamera camera(kFifty, 2.0_m, kSensor, pose);
  const Vec3 object = pose.point({0.021, -0.013, 2.0});
  const Vec2 raster = raster_of(pose, object, camera.image_distance().si());
  EXPECT_GT(raster.x, 320);
  EXPECT_LT(raster.y, 240);
  for (const Vec2 pupil : {Vec2{0, 0}, Vec2{1, 0}, Vec2{0, -1}, Vec2{-0.6, 0.8}}) {
    const Ray ray = camera.ray(raster, pupil);
    const Vec3 miss = cross(object - ray.origin, ray.direction);
    EXPECT_NEAR(norm(miss), 0.0, 2e-14);  // 30 roundings of coordinates up to 5
  }
}

// Behind the focused plane the disc shows the pupil as it is, in front of it upside down: a far
// point lies on the ray from pupil point q where the raster's offset has the sign of q.
TEST(ThinLensCamera, BackgroundDiscIsUprightForegroundDiscInverted) {
  const ThinLensCamera camera = camera_focused_at(2.0_m);
  const double radius_px = 0.5 * circle_of_confusion(kFifty, 2.0_m, 10.0_m).si() / 4e-6;
  const double near_px = 0.5 * circle_of_confusion(kFifty, 2.0_m, 1.0_m).si() / 4e-6;
  const Vec2 q{0.6, 0.8};
  // On the axis at 10 m and 1 m: slope zero.
  const Vec2 behind = slope_at(camera.ray(kSensor.centre() + q * radius_px, q), 10.0_m);
  EXPECT_NEAR(behind.x, 0.0, 1e-16);
  EXPECT_NEAR(behind.y, 0.0, 1e-16);
  const Vec2 before = slope_at(camera.ray(kSensor.centre() - q * near_px, q), 1.0_m);
  EXPECT_NEAR(before.x, 0.0, 1e-16);
  EXPECT_NEAR(before.y, 0.0, 1e-16);
}

CameraSpec spec_focused_at(Length focus, bool breathing) {
  return {.sensor_width = 2.56_mm,
          .sensor_height = 1.92_mm,
          .optics = LensSpec{.lens = kFifty, .focus_distance = focus},
          .breathing = breathing};
}

// With breathing the sensor follows the image; without, the same picture is scaled by f/v.
TEST(ThinLensCamera, BreathingScalesThePicture) {
  for (const Length focus : {0.2_m, 2.0_m}) {
    const auto camera = [&](bool breathing) {
      const CameraSpec spec = spec_focused_at(focus, breathing);
      return std::get<ThinLensCamera>(camera_of(spec, sensor_of(spec, 640, 480)));
    };
    const ThinLensCamera moving = camera(true);
    const ThinLensCamera fixed = camera(false);
    const Length v = image_distance(kFifty.focal_length, focus);
    EXPECT_EQ(moving.image_distance(), v);
    EXPECT_EQ(fixed.image_distance(), kFifty.focal_length);
    const double scale = kFifty.focal_length / v;
    for (const Vec2 offset : {Vec2{200, 0}, Vec2{-100, 150}}) {
      for (const Vec2 pupil : {Vec2{0, 0}, Vec2{1, 0}, Vec2{-0.6, 0.8}}) {
        const Vec3 here = moving.ray(kSensor.centre() + offset, pupil).direction;
        const Vec3 there = fixed.ray(kSensor.centre() + offset * scale, pupil).direction;
        EXPECT_NEAR(norm(here - there), 0.0, 1e-15);
      }
    }
  }
}

TEST(ThinLensCamera, FramingChangesWithFocusOnlyWhereTheLensBreathes) {
  const auto edge = [](Length focus, bool breathing) {
    const CameraSpec spec = spec_focused_at(focus, breathing);
    const Camera camera = camera_of(spec, sensor_of(spec, 640, 480));
    return slope_at(std::get<ThinLensCamera>(camera).ray({640, 240}, {0, 0}), kInfinitelyFar).x;
  };
  EXPECT_NEAR(std::abs(edge(0.5_m, false)), std::abs(edge(kInfinitelyFar, false)), 1e-16);
  EXPECT_LT(std::abs(edge(0.5_m, true)), 0.91 * std::abs(edge(kInfinitelyFar, true)));
}

TEST(ThinLensCamera, FalloffIsTheFourthPowerOfTheCosine) {
  const ThinLensCamera camera = camera_focused_at(2.0_m);
  EXPECT_EQ(camera.falloff(kSensor.centre()), 1.0);
  for (const Vec2 raster : {Vec2{0, 0}, Vec2{639, 17}, Vec2{100, 470}}) {
    EXPECT_NEAR(camera.falloff(raster), std::pow(camera.ray(raster, {0, 0}).direction.z, 4), 1e-15);
  }
}

TEST(ThinLensCamera, RefusesAFocusAtOrInsideTheFocalLength) {
  const Length nan = Length::si(std::numeric_limits<double>::quiet_NaN());
  for (const Length focus : {50.0_mm, 20.0_mm, Length{}, -(1.0_m), nan}) {
    EXPECT_THROW(ThinLensCamera(kFifty, focus, kSensor, Pose{}), Error);
    EXPECT_THROW(ThinLensCamera(kFifty, focus, 50.0_mm, kSensor, Pose{}), Error);
  }
  EXPECT_THROW(ThinLensCamera(ThinLens{50.0_mm, 0.0}, 2.0_m, kSensor, Pose{}), Error);
  EXPECT_THROW(ThinLensCamera(ThinLens{nan, 2.0}, 2.0_m, kSensor, Pose{}), Error);
}

}  // namespace
}  // namespace fstop
