#include "core/camera/camera_spec.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/camera/camera.h"
#include "core/error.h"

namespace fstop {
namespace {

CameraSpec lens_camera(Length focus = 2.0_m) {
  CameraSpec camera;
  camera.optics = LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 1.4},
                           .focus_distance = focus,
                           .aperture = {.blades = 6, .rotation = 0.1}};
  return camera;
}

CameraSpec pinhole_camera() {
  CameraSpec camera;
  camera.optics = PinholeSpec{.image_distance = 50.0_mm, .diameter = 0.35_mm};
  return camera;
}

TEST(SensorDistance, IsTheImageDistanceOfTheFocusedPlane) {
  // 1/v = 20 - 0.5 dioptres.
  EXPECT_NEAR(sensor_distance(lens_camera()).si(), 1.0 / 19.5, 1e-17);
  EXPECT_EQ(sensor_distance(lens_camera(kInfinitelyFar)), 50.0_mm);
}

TEST(SensorDistance, StaysAtTheFocalLengthWithoutBreathing) {
  CameraSpec camera = lens_camera();
  camera.breathing = false;
  EXPECT_EQ(sensor_distance(camera), 50.0_mm);
}

TEST(SensorDistance, OfAPinholeIsItsScreens) {
  CameraSpec camera = pinhole_camera();
  EXPECT_EQ(sensor_distance(camera), 50.0_mm);
  camera.breathing = false;
  EXPECT_EQ(sensor_distance(camera), 50.0_mm);
}

TEST(SensorDistance, RefusesAFocusInsideTheFocalLengthBreathingOrNot) {
  for (const bool breathing : {true, false}) {
    for (const Length focus : {50.0_mm, 30.0_mm, Length{}}) {
      CameraSpec camera = lens_camera(focus);
      camera.breathing = breathing;
      EXPECT_THROW(sensor_distance(camera), Error) << focus.si();
      EXPECT_THROW(camera_of(camera, sensor_of(camera, 36, 24)), Error) << focus.si();
    }
  }
}

TEST(PupilDiameter, IsTheApertureOrTheHole) {
  EXPECT_NEAR(pupil_diameter(lens_camera()).si(), 0.05 / 1.4, 1e-17);
  EXPECT_EQ(pupil_diameter(pinhole_camera()), 0.35_mm);
}

TEST(WorkingFNumber, CountsTheCloserFocus) {
  // N v/f with v = 1/19.5: 1.4 * 20/19.5.
  EXPECT_NEAR(working_f_number(lens_camera()), 1.4 * 20 / 19.5, 1e-15);
  EXPECT_EQ(working_f_number(lens_camera(kInfinitelyFar)), 1.4);
  EXPECT_NEAR(working_f_number(pinhole_camera()), 50 / 0.35, 1e-13);
}

TEST(BlurDiameter, IsSignedForALensAndFollowsTheSensor) {
  const CameraSpec breathing = lens_camera();
  CameraSpec fixed = breathing;
  fixed.breathing = false;
  for (const Length distance : {1.0_m, 2.0_m, 5.0_m, kInfinitelyFar}) {
    // A v (1/s - 1/d) with A = 50/1.4 mm, v = 1/19.5 m or 50 mm.
    const double defocus = 0.5 - (1.0 / distance).si();
    EXPECT_NEAR(blur_diameter(breathing, distance).si(), 0.05 / 1.4 / 19.5 * defocus, 1e-18);
    EXPECT_NEAR(blur_diameter(fixed, distance).si(), 0.05 / 1.4 * 0.05 * defocus, 1e-18);
  }
}

TEST(BlurDiameter, OfAPinholeIsItsShadow) {
  EXPECT_EQ(blur_diameter(pinhole_camera(), kInfinitelyFar), 0.35_mm);
  EXPECT_NEAR(blur_diameter(pinhole_camera(), 0.1_m).si(), 0.35e-3 * 1.5, 1e-18);
}

TEST(SensorOf, DividesTheSensorIntoSquarePixels) {
  const Sensor sensor = sensor_of(lens_camera(), 960, 640);
  EXPECT_EQ(sensor.width, 960);
  EXPECT_EQ(sensor.height, 640);
  EXPECT_NEAR(sensor.pixel_pitch.si(), 37.5e-6, 1e-20);
  EXPECT_EQ(sensor.centre(), (Vec2{480, 320}));
}

TEST(SensorOf, RefusesPixelsThatAreNotSquare) {
  for (const auto& [width, height] : {std::pair{960, 641}, {961, 640}, {640, 960}, {100, 100}}) {
    EXPECT_THROW(sensor_of(lens_camera(), width, height), Error) << width << " x " << height;
  }
}

// A thousandth of a pixel over the image is allowed, as decimal millimetres need.
TEST(SensorOf, AllowsRoundedSensorSizes) {
  CameraSpec camera = lens_camera();
  camera.sensor_width = 23.5_mm;
  camera.sensor_height = Length::si(0.0235 * 2 / 3);
  EXPECT_NO_THROW(sensor_of(camera, 960, 640));
  camera.sensor_height = 15.66666_mm;
  EXPECT_NO_THROW(sensor_of(camera, 960, 640));
  camera.sensor_height = 15.666_mm;
  EXPECT_THROW(sensor_of(camera, 960, 640), Error);
}

TEST(UprightPoint, RunsRightAndDownFromTheTopLeft) {
  const Sensor sensor = sensor_of(lens_camera(), 960, 640);
  const Vec3 top_left = sensor.upright_point({0, 0}, 0.05);
  EXPECT_NEAR(top_left.x, -0.018, 1e-17);
  EXPECT_NEAR(top_left.y, -0.012, 1e-17);
  EXPECT_EQ(top_left.z, 0.05);
  const Vec3 bottom_right = sensor.upright_point({960, 640}, 0.05);
  EXPECT_NEAR(bottom_right.x, 0.018, 1e-17);
  EXPECT_NEAR(bottom_right.y, 0.012, 1e-17);
}

TEST(Camera, IsTheKindThatIsAskedFor) {
  const Sensor sensor = sensor_of(lens_camera(), 960, 640);
  EXPECT_TRUE(std::holds_alternative<ThinLensCamera>(camera_of(lens_camera(), sensor)));
  EXPECT_TRUE(std::holds_alternative<PinholeCamera>(camera_of(pinhole_camera(), sensor)));
  EXPECT_EQ(aperture_of(lens_camera()), (Aperture{.blades = 6, .rotation = 0.1}));
  EXPECT_EQ(aperture_of(pinhole_camera()), Aperture{});
}

TEST(Camera, StandsAtThePositionAndLooksAtTheTarget) {
  CameraSpec spec = pinhole_camera();
  spec.position = {1, 2, 3};
  spec.look_at = {1, 2, 8};
  const auto camera = std::get<PinholeCamera>(camera_of(spec, sensor_of(spec, 36, 24)));
  EXPECT_EQ(camera.pose().position(), (Vec3{1, 2, 3}));
  const Vec3 ahead = camera.ray({18, 12}, {0, 0}).direction;
  EXPECT_NEAR(norm(ahead - Vec3{0, 0, 1}), 0.0, 1e-15);
}

TEST(Camera, RefusesAPoseWithoutUp) {
  CameraSpec spec = lens_camera();
  spec.look_at = spec.position;
  EXPECT_THROW(camera_of(spec, sensor_of(spec, 36, 24)), Error);
}

}  // namespace
}  // namespace fstop
