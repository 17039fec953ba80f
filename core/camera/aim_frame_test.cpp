#include <cmath>
#include <random>
#include <variant>

#include <gtest/gtest.h>

#include "core/camera/camera.h"

namespace fstop {
namespace {

const Sensor kSensor{.pixel_pitch = 6.0_um, .width = 640, .height = 427};

// Packets are aimed in single precision; the frame itself is double, and differs from ray() by
// the roundings of a few products of numbers up to 1 and of positions of some metres.
void expect_same_rays(const Camera& camera, double tolerance) {
  const AimFrame frame = std::visit([](const auto& c) { return c.aim_frame(); }, camera);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 500; ++i) {
    const Vec2 raster{320.0 * (1.0 + unit(random)), 213.5 * (1.0 + unit(random))};
    const Vec2 pupil{0.7 * unit(random), 0.7 * unit(random)};
    const Ray ray = std::visit([&](const auto& c) { return c.ray(raster, pupil); }, camera);
    const double ax =
        frame.slope * (raster.x - frame.centre.x) - frame.radius * frame.vergence * pupil.x;
    const double ay =
        frame.slope * (raster.y - frame.centre.y) - frame.radius * frame.vergence * pupil.y;
    const Vec3 direction = normalized(frame.forward + frame.right * ax + frame.down * ay);
    const Vec3 origin = frame.position + frame.right * (frame.radius * pupil.x) +
                        frame.down * (frame.radius * pupil.y);
    EXPECT_LT(norm(direction - ray.direction), tolerance);
    EXPECT_LT(norm(origin - ray.origin), 10.0 * tolerance);
  }
}

TEST(AimFrame, AimsAsTheThinLensDoes) {
  const Pose pose = Pose::looking_at({1.5, -0.3, 4.0}, {0.2, 0.1, -1.0}, {0.1, 1.0, 0.0});
  for (const Length focus : {0.2_m, 2.0_m, kInfinitelyFar}) {
    const ThinLens lens{.focal_length = 50.0_mm, .f_number = 1.4};
    expect_same_rays(ThinLensCamera(lens, focus, kSensor, pose), 1e-14);
    expect_same_rays(ThinLensCamera(lens, focus, 50.0_mm, kSensor, pose), 1e-14);
  }
}

TEST(AimFrame, AimsAsThePinholeDoes) {
  const Pose pose = Pose::looking_at({-2.0, 0.7, 0.5}, {0.0, 0.0, -3.0}, {0.0, 1.0, 0.3});
  CameraSpec spec;
  spec.position = {-2.0, 0.7, 0.5};
  spec.optics = PinholeSpec{.image_distance = 50.0_mm, .diameter = 2.0_mm};
  expect_same_rays(camera_of(spec, kSensor), 1e-14);
  expect_same_rays(central_projection(spec, kSensor), 1e-14);
  expect_same_rays(PinholeCamera(50.0_mm, 1.0_mm, kSensor, pose), 1e-14);
}

}  // namespace
}  // namespace fstop
