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
// times its area; what diffraction sends beyond the frame, a share of 2 Q/(pi^2 x) for each
// border at x = 32 px with Q = 0.44, is 0.011 in all. The splats leave 1e-3.
TEST(WaveEmitter, TinyLampKeepsItsLight) {
  SimulationSpec shot = wave_shot();
  shot.quality.samples = 16;
  const float radiance = 1e6F;
  const double light = sum_of(picture_of(shot, lamp(0.01, radiance)));
  const double expected = 1e6 * std::numbers::pi * 0.01 * 0.01;
  std::printf("light %.5g of %.5g\n", light, expected);
  EXPECT_NEAR(light / expected, 1.0 - 0.011, 0.006);
}

// Pictures are linear in the radiance: a lamp that is dim, so that camera rays show it, and one
// that is bright and splatted, have the same picture but for the factor; also half behind a plate.
// Tolerances: the dim lamp's 1,024 samples meet 3 px of it in every pixel's net, which leaves
// 0.3 % of the light; a pixel may be off by 3 % of the peak near the plate, where rays add noise.
TEST(WaveEmitter, SplatsAndCameraRaysMakeTheSamePicture) {
  for (const bool plate : {false, true}) {
    SimulationSpec shot = wave_shot();
    shot.quality.samples = 1024;
    Scene dim = lamp(1.7, 0.5F);
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
    EXPECT_NEAR(ratio, 1.0, plate ? 0.01 : 0.003);
    EXPECT_LT(worst / peak, 0.03);
  }
}

}  // namespace
}  // namespace fstop
