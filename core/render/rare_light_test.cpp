// Light that few samples meet, and that those may miss.
#include <cmath>

#include <gtest/gtest.h>

#include "core/render/bar_scenes.h"
#include "core/render/simulation.h"

namespace fstop {
namespace {

SimulationSpec shot(double f_number, int width, int height) {
  SimulationSpec spec;
  spec.camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = f_number}, .focus_distance = 2.0_m};
  spec.width = width;
  spec.height = height;
  return spec;
}

// A lamp of 10^4 times white whose image in a mirror ball is about a tenth of a pixel wide:
// whether samples meet it is a chance, and the bound holds either way.
TEST(RareLight, BoundsHoldWhereSamplesMayMissALampInAMirror) {
  Scene scene;
  scene.materials = {Material{.reflection = 1.0},
                     Material{.emission = {.value = {1e4F, 1e4F, 1e4F}}}};
  scene.objects = {
      {.shape = SphereObject{.center = {0, 0, -2}, .radius = 0.2}},
      {.shape = QuadObject{.corner = {1, 1, 1}, .edge_u = {0.05, 0, 0}, .edge_v = {0, 0.05, 0}},
       .material = 1}};
  const RayScene lamp(scene);
  SimulationSpec spec = shot(8.0, 96, 64);
  spec.quality.samples = 4096;
  const Image truth = simulate(spec, lamp, {}).color;
  spec.quality.samples = 4;
  int held = 0;
  int above_estimate = 0;
  constexpr int kSeeds = 20;
  for (spec.seed = 1; spec.seed <= kSeeds; ++spec.seed) {
    const Photograph seen = simulate(spec, lamp, {});
    const double error = std::sqrt(mse_of(seen.color, truth));
    held += error <= seen.report.error.upper_95 ? 1 : 0;
    above_estimate += error > 2.0 * seen.report.error.estimate ? 1 : 0;
  }
  EXPECT_GE(held, kSeeds - 1);
  EXPECT_GE(above_estimate, 1) << "the lamp is not hard to meet";
}

// Glowing wires of 1 in 2000 of a pixel, 200 times white: rounds that meet more of their light than
// those before show more noise, not less. They go on until the error is reached or a pixel has the
// most samples allowed.
TEST(RareLight, RoundsGoOnWhileTheyMeetMoreOfIt) {
  Scene scene;
  scene.materials = {Material{.emission = {.value = {200.0F, 200.0F, 200.0F}}}};
  for (int i = 0; i < 40; ++i) {
    const double x = -0.78 + 0.04 * i;
    scene.objects.push_back({.shape = QuadObject{.corner = {x, -1, -2 + 0.4 * std::sin(i)},
                                                 .edge_u = {3e-5, 0, 0},
                                                 .edge_v = {0.05, 2, 0}}});
  }
  const RayScene wires(scene);
  SimulationSpec spec = shot(4.0, 24, 16);
  for (spec.seed = 0; spec.seed < 3; ++spec.seed) {
    const RenderReport report = simulate(spec, wires, {}).report;
    EXPECT_TRUE(report.error.upper_95 <= report.error.target || report.cost.samples_max >= 32768)
        << "seed " << spec.seed << ": " << report.error.upper_95 << " after "
        << report.cost.samples_mean << " samples a pixel";
  }
}

}  // namespace
}  // namespace fstop
