// Small bright lights with diffraction: splatted into the waves' layers, and through the pupil
// where an edge hides part of them.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/physics/test_scenes.h"

namespace fstop {
namespace {

constexpr Length kPitch = Length::si(10e-6);
constexpr int kSide = 64;
constexpr double kDepth = 3.0;  // metres
constexpr double kScale = 1.0 / (1.0 / 0.050 - 1.0 / 2.0) / 10e-6;

SimulationSpec wave_shot() {
  SimulationSpec shot = lens_shot(8.0, kPitch, kSide, kSide);
  shot.quality.method = "wave";
  shot.effects.diffraction = EffectChoice::on;
  shot.effects.defocus = EffectChoice::on;
  return shot;
}

Scene lamp(double radius_px, float radiance) {
  Scene scene;
  scene.materials = {{.emission = {.value = {radiance, radiance, radiance}}}, {.name = "black"}};
  scene.objects = {
      {.shape = SphereObject{.center = {0, 0, -kDepth}, .radius = radius_px * kDepth / kScale}}};
  return scene;
}

Image picture_of(const SimulationSpec& shot, const Scene& scene) {
  const RayScene ray_scene(scene);
  return finished_exr(shot, ray_scene);
}

double sum_of(const Image& image) {
  double sum = 0.0;
  for (const float value : image.pixels()) sum += static_cast<double>(value) / 3.0;
  return sum;
}

// A lamp of a hundredth of a pixel: no camera ray of these would meet it. Its light is its radiance
// times its area, less what diffraction sends beyond the frame: of the density h/(2 pi r^3), h = 2
// Q/pi^2, a square of half side a leaves 2 sqrt(2) h/(pi a) outside. Splats, 1e-3 at most.
TEST(WaveEmitter, TinyLampKeepsItsLight) {
  SimulationSpec shot = wave_shot();
  shot.quality.samples = 16;
  const float radiance = 1e6F;
  const double light = sum_of(picture_of(shot, lamp(0.01, radiance)));
  const double expected = 1e6 * std::numbers::pi * 0.01 * 0.01;
  std::printf("light %.5g of %.5g\n", light, expected);
  const double q = 550e-9 * 8.0 * 2.0 / (2.0 - 0.050) / kPitch.si();
  const double halo = 2.0 * q / std::pow(std::numbers::pi, 2);
  const double outside = 2.0 * std::numbers::sqrt2 * halo / (std::numbers::pi * 0.5 * kSide);
  EXPECT_NEAR(light / expected, 1.0 - outside, 1e-3);
}

// Pictures are linear in the radiance: a lamp that is dim, so that camera rays show it, and one
// that is bright and splatted, have the same picture but for the factor; also half behind a plate.
// Tolerances: free, nothing but the lamp's 512 samples a pixel is random, 0.3 % of the light.
// Half hidden, splats leave an RMSE of 0.0004, 0.027 were it all in one pixel of the peak's 0.8,
// and rays, one of five of which meets the lamp, 2 % in each of 50 pixels: 6 % of the peak, and
// 1.5 % of the light. The bright lamp's picture stays below white, where noise counts.
TEST(WaveEmitter, SplatsAndCameraRaysMakeTheSamePicture) {
  for (const bool plate : {false, true}) {
    SimulationSpec shot = wave_shot();
    shot.quality.samples = 512;
    shot.quality.max_error = 0.002;
    Scene dim = lamp(1.7, 2.4F / 64.0F);
    // Something white elsewhere, so that the dim lamp is no emitter.
    dim.materials.push_back({.emission = {.value = {2, 2, 2}}});
    dim.objects.push_back(
        {.shape = SphereObject{.center = {50, 0, -3}, .radius = 0.1}, .material = 2});
    if (plate) {
      dim.objects.push_back(
          {.shape = QuadObject{.corner = {0, -1, -1.5}, .edge_u = {1, 0, 0}, .edge_v = {0, 2, 0}},
           .material = 1});
    }
    Scene bright = dim;
    for (float& value : bright.materials[0].emission.value) value *= 64.0F;
    const Image traced = picture_of(shot, dim);
    const Image splatted = picture_of(shot, bright);
    double peak = 0.0;
    double worst = 0.0;
    for (std::size_t i = 0; i < traced.pixels().size(); ++i) {
      const auto a = static_cast<double>(traced.pixels()[i]);
      const double b = static_cast<double>(splatted.pixels()[i]) / 64.0;
      peak = std::max(peak, a);
      worst = std::max(worst, std::abs(a - b));
    }
    const double ratio = sum_of(splatted) / 64.0 / sum_of(traced);
    std::printf("%s: light %.5f of the rays', worst pixel off by %.4f of the peak\n",
                plate ? "half hidden" : "free", ratio, worst / peak);
    EXPECT_NEAR(ratio, 1.0, plate ? 0.015 : 0.003);
    EXPECT_LT(worst / peak, plate ? 0.06 : 0.003);
  }
}

}  // namespace
}  // namespace fstop
