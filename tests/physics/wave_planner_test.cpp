// What the planner promises where diffraction decides: bounds that hold, hand-overs without a step.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "core/measure/image_difference.h"
#include "tests/physics/test_scenes.h"

namespace fstop {
namespace {

// A card with a hard pattern of a few pixels' grain, tilted about the vertical by `slope` (metres
// of depth per metre to the right), far wider than the frame.
Scene patterned_card(const SimulationSpec& shot, double depth, double slope, std::uint32_t seed) {
  constexpr int kTexels = 256;
  Scene scene;
  TextureSource texture{
      .name = "pattern", .filter = TextureFilter::bilinear, .image = Image(kTexels, kTexels, 3)};
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(0.0F, 1.0F);
  constexpr int kGrain = 4;  // texels
  for (int y = 0; y < kTexels; y += kGrain) {
    for (int x = 0; x < kTexels; x += kGrain) {
      const std::array<float, 3> color = {value(random), value(random), value(random)};
      for (int j = 0; j < kGrain * kGrain; ++j) {
        for (std::size_t c = 0; c < 3; ++c) {
          texture.image.at(x + j % kGrain, y + j / kGrain)[c] = color[c];
        }
      }
    }
  }
  scene.textures = {std::move(texture)};
  scene.materials = {Material{.emission = {.value = {1, 1, 1}, .texture = 0}}};
  const double pitch = (shot.camera.sensor_width / shot.width).si();
  // 160 pixels over 256 texels: a grain is 2.5 pixels.
  const double side = 160.0 * pitch * depth / sensor_distance(shot.camera).si();
  const double lean = slope * side;
  scene.objects = {{.shape = QuadObject{.corner = {-side / 2, -side / 2, -depth + lean / 2},
                                        .edge_u = {side, 0, -lean},
                                        .edge_v = {0, side, 0}}}};
  return scene;
}

Photograph photograph(const SimulationSpec& spec, const RayScene& scene) {
  WorkerPool workers(2);
  return simulate(spec, scene, {.workers = &workers});
}

struct RandomCamera {
  SimulationSpec shot;
  double depth = 2.0;
  double slope = 0.0;
};

RandomCamera random_camera(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto log_uniform = [&](double low, double high) {
    std::uniform_real_distribution<double> share(0.0, 1.0);
    return low * std::pow(high / low, share(random));
  };
  RandomCamera camera;
  const Length pitch = Length::si(log_uniform(4e-6, 80e-6));
  if (seed % 4 == 0) {
    camera.shot = pinhole_shot(Length::si(log_uniform(0.1e-3, 1e-3)), pitch, 48, 32);
    camera.depth = log_uniform(0.3, 20.0);
  } else {
    camera.shot = lens_shot(log_uniform(1.4, 64.0), pitch, 48, 32);
    auto& lens = std::get<LensSpec>(camera.shot.camera.optics);
    lens.focus_distance = Length::si(log_uniform(0.7, 10.0));
    // From sharp to some pixels of blur.
    const double blur_px = log_uniform(0.05, 12.0) * (seed % 2 == 0 ? 1.0 : -1.0);
    const double pupil = 0.050 / lens.lens.f_number;
    const double vergence =
        1.0 / lens.focus_distance.si() -
        blur_px * pitch.si() / (pupil * sensor_distance(camera.shot.camera).si());
    camera.depth = vergence > 0.05 ? std::max(0.2, 1.0 / vergence) : 20.0;
  }
  camera.slope = log_uniform(0.01, 1.0);
  camera.shot.camera.monochromatic = seed % 3 != 0;
  return camera;
}

// Two hundred cameras, lenses and pinholes, before a tilted card: what the planner's own choice is
// off from the full model - point spreads of every depth, a tenth of the error, 512 samples - lies
// below the bound of its report. 95 % are promised.
TEST(WavePlanner, BoundsHoldOnTwoHundredCameras) {
  int held = 0;
  int waves = 0;
  constexpr int kCameras = 200;
  for (std::uint32_t seed = 1; seed <= kCameras; ++seed) {
    RandomCamera camera = random_camera(seed);
    const RayScene scene(patterned_card(camera.shot, camera.depth, camera.slope, seed));
    camera.shot.quality.max_error = 0.02;
    const Photograph chosen = photograph(camera.shot, scene);
    SimulationSpec full = camera.shot;
    full.quality = {.max_error = 0.002, .method = "wave", .samples = 512};
    full.effects.diffraction = EffectChoice::on;
    const Photograph truth = photograph(full, scene);
    const double off = image_difference(chosen.color.view(), truth.color.view()).rmse_clipped;
    const bool holds = off <= chosen.report.error.upper_95 + truth.report.error.estimate;
    held += holds ? 1 : 0;
    waves += chosen.report.method == "wave" ? 1 : 0;
    if (!holds) {
      std::printf("camera %u: %s off by %.4f, bound %.4f\n", seed, chosen.report.method.c_str(),
                  off, chosen.report.error.upper_95);
    }
  }
  std::printf("bounds held on %d of %d cameras, %d of them by waves\n", held, kCameras, waves);
  EXPECT_GE(held, 190);
  EXPECT_GE(waves, 40) << "too few to say anything of waves";
  EXPECT_LE(waves, 180) << "too few to say anything of rays";
}

// Sweeps `spec_at` from 0 to 1 and, wherever the planner's method changes, renders both methods at
// the very change. Returns the number of changes.
int expect_no_step(const char* what, const std::function<SimulationSpec(double)>& spec_at,
                   const std::function<Scene(const SimulationSpec&, double)>& scene_at) {
  const auto method_at = [&](double t) {
    const SimulationSpec spec = spec_at(t);
    const RayScene scene(scene_at(spec, t));
    return plan_for(spec, &scene).method;
  };
  int changes = 0;
  constexpr int kSteps = 24;
  std::string before = method_at(0.0);
  for (int i = 1; i <= kSteps; ++i) {
    const std::string after = method_at(double(i) / kSteps);
    if (after != before) {
      double low = double(i - 1) / kSteps;
      double high = double(i) / kSteps;
      for (int k = 0; k < 12; ++k) {
        const double middle = 0.5 * (low + high);
        (method_at(middle) == before ? low : high) = middle;
      }
      SimulationSpec spec = spec_at(high);
      const RayScene scene(scene_at(spec, high));
      spec.quality.method = before;
      const Photograph one = photograph(spec, scene);
      spec.quality.method = after;
      const Photograph other = photograph(spec, scene);
      const double step = image_difference(one.color.view(), other.color.view()).rmse_clipped;
      std::printf("%s: %s to %s at %.3f, step %.4f of %.4f\n", what, before.c_str(), after.c_str(),
                  high, step, spec.quality.max_error);
      EXPECT_LE(step, spec.quality.max_error) << what << " at " << high;
      ++changes;
    }
    before = after;
  }
  return changes;
}

TEST(WavePlanner, HandOversChangeThePictureByLessThanTheError) {
  const auto lens = [](double f_number, double focus, double depth_of_card) {
    SimulationSpec shot = lens_shot(f_number, Length::si(24e-6), 72, 48);
    std::get<LensSpec>(shot.camera.optics).focus_distance = Length::si(focus);
    shot.quality.max_error = 0.02;
    return std::pair{shot, depth_of_card};
  };
  int changes = 0;
  for (const double focus : {2.0, 2.5}) {
    changes += expect_no_step(
        "aperture f/1.4 to f/64",
        [&](double t) { return lens(1.4 * std::pow(64.0 / 1.4, t), focus, 2.0).first; },
        [](const SimulationSpec& spec, double) { return patterned_card(spec, 2.0, 0.2, 7); });
  }
  for (const double f_number : {2.8, 5.6}) {
    changes += expect_no_step(
        "focus 1 to 4 m", [&](double t) { return lens(f_number, std::pow(4.0, t), 2.0).first; },
        [](const SimulationSpec& spec, double) { return patterned_card(spec, 2.0, 0.2, 8); });
    changes += expect_no_step(
        "depth 1 to 4 m", [&](double) { return lens(f_number, 2.0, 2.0).first; },
        [](const SimulationSpec& spec, double t) {
          return patterned_card(spec, std::pow(4.0, t), 0.2, 9);
        });
  }
  changes += expect_no_step(
      "pinhole 3 to 0.07 mm",
      [&](double t) {
        SimulationSpec shot =
            pinhole_shot(Length::si(3e-3 * std::pow(0.07 / 3.0, t)), Length::si(60e-6), 72, 48);
        shot.quality.max_error = 0.02;
        return shot;
      },
      [](const SimulationSpec& spec, double) { return patterned_card(spec, 5.0, 0.2, 10); });
  EXPECT_GE(changes, 4) << "the sweeps cross too few hand-overs";
}

}  // namespace
}  // namespace fstop
