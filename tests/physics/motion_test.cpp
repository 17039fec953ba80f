// A moving square's profile: the trapezoid of motion and pixel, in focus and out of focus.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "core/optics/thin_lens.h"
#include "tests/physics/test_scenes.h"

namespace fstop {
namespace {

constexpr int kWidth = 192;
constexpr int kHeight = 64;
constexpr Length kPitch = Length::si(36e-3 / kWidth);
constexpr double kSide = 0.3;     // metres: the bar's width
constexpr double kSpeed = 2.0;    // metres a second, to the right
constexpr double kShutter = 0.1;  // seconds

SimulationSpec moving_shot(double f_number) {
  SimulationSpec spec = lens_shot(f_number, kPitch, kWidth, kHeight);
  spec.camera.shutter_seconds = kShutter;
  spec.effects.diffraction = EffectChoice::off;
  spec.quality.method = "lens-sampling";
  spec.quality.samples = 2048;
  return spec;
}

// A bar that is far taller than the picture, its left edge at `left` when the shutter opens.
Scene moving_bar(double depth, double left) {
  Scene scene = glowing_scene({glowing_quad({left, -20.0, -depth}, {kSide, 0, 0}, {0, 40.0, 0})});
  scene.objects[0].velocity = {kSpeed, 0, 0};
  return scene;
}

// The integral of the step's integral.
double ramp(double z) { return z > 0.0 ? 0.5 * z * z : 0.0; }

// The share of (pixel [x, x+1]) x (time) that lies right of an edge which moves from e to e + l,
// px.
double right_of_edge(double x, double e, double l) {
  return (ramp(x + 1.0 - e) - ramp(x - e) - ramp(x + 1.0 - e - l) + ramp(x - e - l)) / l;
}

// The same seen with a blur disc of radius r px: the disc's line spread 2/(pi r^2) sqrt(r^2 - s^2),
// by Gauss-Chebyshev's rule of the second kind.
double right_of_blurred_edge(double x, double e, double l, double r) {
  constexpr int kNodes = 400;
  double sum = 0.0;
  for (int i = 1; i <= kNodes; ++i) {
    const double turn = i * std::numbers::pi / (kNodes + 1);
    const double weight = 2.0 / (kNodes + 1) * std::pow(std::sin(turn), 2);
    sum += weight * right_of_edge(x, e + r * std::cos(turn), l);
  }
  return sum;
}

struct Profile {
  double worst = 0.0;
  double largest = 0.0;
};

// What moves to the right: the bar, or the camera to the left before a bar at rest.
enum class Moving { bar, camera };

// Rows' mean against the closed form.
Profile deviation(double f_number, double depth, Moving moving = Moving::bar) {
  SimulationSpec spec = moving_shot(f_number);
  Scene scene = moving_bar(depth, -0.25);
  if (moving == Moving::camera) {
    scene.objects[0].velocity = {};
    spec.camera.velocity = {-kSpeed, 0, 0};
  }
  const Image image = finished_exr(spec, RayScene(scene));
  const double v = 1.0 / (1.0 / 0.050 - 1.0 / 2.0);
  const double px = v / depth / kPitch.si();  // of a metre at that depth
  const double left = kWidth / 2.0 - 0.25 * px;
  const double length = kSpeed * kShutter * px;
  const double radius =
      0.5 * (0.050 / f_number) * v * std::abs(1.0 / 2.0 - 1.0 / depth) / kPitch.si();
  Profile profile;
  for (int x = 0; x < kWidth; ++x) {
    double mean = 0.0;
    for (int y = 0; y < kHeight; ++y) mean += double{image.at(x, y)[1]} / kHeight;
    const auto right = [&](double edge) {
      return radius > 1e-6 ? right_of_blurred_edge(x, edge, length, radius)
                           : right_of_edge(x, edge, length);
    };
    const double wanted = right(left) - right(left + kSide * px);
    profile.worst = std::max(profile.worst, std::abs(mean - wanted));
    profile.largest = std::max(profile.largest, wanted);
  }
  return profile;
}

// In focus at 2 m: box of the bar (41 px) by box of the motion (27 px): a trapezoid.
TEST(Motion, AMovingSquareIsATrapezoid) {
  const Profile profile = deviation(1.4, 2.0);
  std::printf("motion in focus: worst %.4f of %.3f\n", profile.worst, profile.largest);
  EXPECT_GT(profile.largest, 0.99);
  EXPECT_LT(profile.worst, 0.01);
}

// At 8 m, out of focus by a disc of 3.7 px, moving 6.8 px: the integral over both.
TEST(Motion, LensAndMotionTogetherAreTheProductIntegral) {
  for (const double f_number : {1.4, 0.7}) {
    const Profile profile = deviation(f_number, 8.0);
    std::printf("motion out of focus, f/%.1f: worst %.4f of %.3f\n", f_number, profile.worst,
                profile.largest);
    EXPECT_LT(profile.worst, 0.01 * profile.largest);
  }
}

// The camera passes a bar at rest: the same profiles.
TEST(Motion, AMovingCameraBlursWhatStandsStill) {
  for (const auto& [f_number, depth] : {std::pair{1.4, 2.0}, {2.0, 8.0}}) {
    const Profile profile = deviation(f_number, depth, Moving::camera);
    std::printf("moving camera, %.0f m: worst %.4f of %.3f\n", depth, profile.worst,
                profile.largest);
    EXPECT_GT(profile.largest, 0.7);
    EXPECT_LT(profile.worst, 0.01);
  }
}

// Towards a wall of stripes that the camera moves with, nothing is blurred.
TEST(Motion, WhatMovesWithTheCameraIsSharp) {
  SimulationSpec spec = moving_shot(1.4);
  Scene scene = moving_bar(2.0, -0.25);
  scene.objects[0].velocity = {0.4, 0.3, -1.5};
  spec.camera.velocity = scene.objects[0].velocity;
  const Image together = finished_exr(spec, RayScene(scene));
  scene.objects[0].velocity = {};
  spec.camera.velocity = {};
  const Image at_rest = finished_exr(spec, RayScene(scene));
  // Of the pixels only those differ that the bar's two edges cross: by the samples of other rays'
  // roundings, one of 2048 and a few of their neighbours.
  for (std::size_t i = 0; i < together.pixels().size(); ++i) {
    ASSERT_NEAR(together.pixels()[i], at_rest.pixels()[i], 8.0F / 2048.0F) << i;
  }
}

}  // namespace
}  // namespace fstop
