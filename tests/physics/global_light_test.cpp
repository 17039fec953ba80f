// Global illumination in whole photographs: by every method, with its report.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/render/simulation.h"

namespace fstop {
namespace {

Rgb grey(double value) {
  const auto v = static_cast<float>(value);
  return {v, v, v};
}

Material diffuse(double albedo, double emission = 0.0) {
  return {.model = ShadingModel::phong,
          .emission = {.value = grey(emission)},
          .ambient = {.value = grey(0.5)},
          .diffuse = {.value = grey(albedo)}};
}

SimulationSpec shot(const std::string& method, int side = 32) {
  SimulationSpec spec;
  spec.camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 2.0}, .focus_distance = 3.0_m};
  spec.camera.sensor_width = 36.0_mm;
  spec.camera.sensor_height = 36.0_mm;
  spec.width = side;
  spec.height = side;
  spec.effects.diffraction = EffectChoice::off;
  spec.illumination = Illumination::global;
  spec.quality.method = method;
  return spec;
}

Photograph photograph(const SimulationSpec& spec, const Scene& scene, int threads = 2) {
  const RayScene ray_scene(scene);
  WorkerPool workers(threads);
  RunControl run;
  run.workers = &workers;
  return simulate(spec, ray_scene, run);
}

const ModelledEffect* told(const Photograph& photograph, const std::string& effect) {
  const auto found = std::ranges::find(photograph.report.model, effect, &ModelledEffect::effect);
  return found == photograph.report.model.end() ? nullptr : &*found;
}

double mean_of(const Image& image) {
  double sum = 0.0;
  for (const float value : image.pixels()) sum += double{value};
  return sum / static_cast<double>(image.pixels().size());
}

Scene furnace(double albedo, double emission) {
  Scene scene;
  scene.materials = {diffuse(albedo, emission)};
  scene.objects = {{.shape = SphereObject{.center = {0, 0, 0}, .radius = 3.0}}};
  scene.ambient_light = {1, 1, 1};
  return scene;
}

// A patterned room with a glass ball, a mirror and a lamp: every kind of path.
Scene furnished_room() {
  Scene scene;
  const auto wall = [&](Vec3 corner, Vec3 u, Vec3 v, int material) {
    scene.objects.push_back(
        {.shape = QuadObject{.corner = corner, .edge_u = u, .edge_v = v}, .material = material});
  };
  Material red = diffuse(0.6);
  red.diffuse.value = {0.6F, 0.1F, 0.1F};
  scene.materials = {diffuse(0.7), red, Material{.emission = {.value = grey(0.9)}},
                     Material{.reflection = 0.9, .transmission = 0.9, .ior = 1.5, .fresnel = true},
                     Material{.model = ShadingModel::phong,
                              .diffuse = {.value = grey(0.1)},
                              .reflection = 0.7,
                              .reflection_exponent = 200.0}};
  wall({-1, -1, 0.5}, {0, 2, 0}, {0, 0, -5}, 1);
  wall({1, -1, 0.5}, {0, 2, 0}, {0, 0, -5}, 0);
  wall({-1, -1, 0.5}, {2, 0, 0}, {0, 0, -5}, 0);
  wall({-1, 1, 0.5}, {2, 0, 0}, {0, 0, -5}, 0);
  wall({-1, -1, -4.5}, {2, 0, 0}, {0, 2, 0}, 0);
  wall({-1, -1, 0.5}, {2, 0, 0}, {0, 2, 0}, 0);
  wall({-0.6, 0.99, -2}, {1.2, 0, 0}, {0, 0, -1.5}, 2);
  scene.objects.push_back(
      {.shape = SphereObject{.center = {-0.4, -0.6, -3}, .radius = 0.4}, .material = 3});
  scene.objects.push_back(
      {.shape = SphereObject{.center = {0.45, -0.65, -3.4}, .radius = 0.35}, .material = 4});
  scene.lights = {
      {.kind = AreaLight{.corner = {-0.2, 0.9, -1}, .edge_u = {0.4, 0, 0}, .edge_v = {0, 0, 0.4}},
       .intensity = grey(0.3)}};
  return scene;
}

// e/(1 - rho) in every pixel, and an error that holds for it.
TEST(GlobalLight, EveryMethodShowsTheFurnace) {
  const Scene scene = furnace(0.5, 0.3);
  for (const std::string method :
       {"pinhole", "lens-sampling", "lens-reconstruction", "gather", "wave"}) {
    SimulationSpec spec = shot(method);
    if (method == "wave") spec.effects.diffraction = EffectChoice::on;
    if (method == "lens-reconstruction") {  // which needs blur
      spec.camera.optics =
          LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 1.0}, .focus_distance = 0.35_m};
    }
    spec.quality.samples = 256;
    const Photograph picture = photograph(spec, scene);
    const double mean = mean_of(picture.color);
    double square = 0.0;
    for (const float value : picture.color.pixels()) square += std::pow(double{value} - 0.6, 2);
    const double rmse = std::sqrt(square / static_cast<double>(picture.color.pixels().size()));
    std::printf("furnace by %s: mean %.5f, RMSE %.2g, estimate %.2g, bound %.2g\n", method.c_str(),
                mean, rmse, picture.report.error.estimate, picture.report.error.upper_95);
    EXPECT_NEAR(mean, 0.6, 0.003) << method;
    EXPECT_LE(rmse, picture.report.error.upper_95) << method;
    ASSERT_NE(told(picture, "diffuse interreflection"), nullptr);
    EXPECT_TRUE(told(picture, "diffuse interreflection")->modelled);
  }
}

TEST(GlobalLight, RecursiveKnowsNothingOfIt) {
  SimulationSpec spec = shot("pinhole");
  spec.illumination = Illumination::recursive;
  const Photograph picture = photograph(spec, furnace(0.5, 0.3));
  EXPECT_NEAR(mean_of(picture.color), 0.3 + 0.5, 1e-6);  // emission and ambient light
  EXPECT_EQ(told(picture, "diffuse interreflection"), nullptr);
}

// The bound at a target holds against a picture of many samples.
TEST(GlobalLight, AutoKeepsItsTarget) {
  const Scene scene = furnished_room();
  SimulationSpec spec = shot("lens-sampling");
  spec.quality.samples = 2048;
  spec.seed = 99;
  const Photograph truth = photograph(spec, scene);
  for (const double target : {0.03, 0.015}) {
    SimulationSpec wanted = shot("auto");
    wanted.quality.max_error = target;
    const Photograph picture = photograph(wanted, scene);
    double square = 0.0;
    for (std::size_t i = 0; i < picture.color.pixels().size(); ++i) {
      const double a = std::clamp(double{picture.color.pixels()[i]}, 0.0, 1.0);
      const double b = std::clamp(double{truth.color.pixels()[i]}, 0.0, 1.0);
      square += (a - b) * (a - b);
    }
    const double error = std::sqrt(square / static_cast<double>(picture.color.pixels().size()));
    std::printf("room at %.3f by %s: error %.4f, estimate %.4f, bound %.4f, truth's %.4f\n", target,
                picture.report.method.c_str(), error, picture.report.error.estimate,
                picture.report.error.upper_95, truth.report.error.estimate);
    EXPECT_LE(picture.report.error.upper_95, target);
    EXPECT_LE(error, std::hypot(picture.report.error.upper_95, truth.report.error.upper_95));
  }
}

// A ball of radius r, emission e, lights a wall of albedo rho by rho e (r/d)^2 cos. Camera rays do
// not see it where it is splatted; all others do.
TEST(GlobalLight, SplattedEmittersLightTheWallOnce) {
  constexpr double kRadius = 0.05;
  constexpr double kEmission = 30.0;
  const Vec3 ball{0.15, 0.05, -2.8};
  Scene scene;
  scene.materials = {diffuse(0.6), Material{.emission = {.value = grey(kEmission)}}};
  scene.objects = {
      {.shape = QuadObject{.corner = {-4, -4, -3}, .edge_u = {8, 0, 0}, .edge_v = {0, 8, 0}}},
      {.shape = SphereObject{.center = ball, .radius = kRadius}, .material = 1}};
  double splatted = 0.0;
  for (const std::string method : {"bokeh-splatting", "lens-sampling", "pinhole"}) {
    SimulationSpec spec = shot(method, 64);
    spec.quality.samples = 1024;
    const Photograph picture = photograph(spec, scene);
    double seen = 0.0;
    double expected = 0.0;
    // The left half, away from the ball's picture.
    for (int y = 8; y < 56; ++y) {
      for (int x = 4; x < 32; ++x) {
        const double pixel = 36.0 / 64.0 * 3.0 / (50.0 * 3.0 / 2.95);
        const Vec3 point{(x + 0.5 - 32) * pixel, (32 - y - 0.5) * pixel, -3.0};
        const Vec3 to_ball = ball - point;
        const double d = norm(to_ball);
        expected += 0.6 * kEmission * std::pow(kRadius / d, 2) * to_ball.z / d;
        seen += double{picture.color.at(x, y)[0]};
      }
    }
    std::printf("ball by %s: wall %.5f of %.5f\n", method.c_str(), seen, expected);
    // As many paths as tell of it, and random ones' three standard errors.
    const double hits = expected * *spec.quality.samples / (0.6 * kEmission);
    EXPECT_NEAR(seen, expected, 3.0 / std::sqrt(hits) * expected) << method;
    const ModelledEffect* emitters = told(picture, "small bright emitters");
    ASSERT_NE(emitters, nullptr);
    EXPECT_EQ(emitters->why.find("traced through the pupil") != std::string::npos,
              method != "lens-sampling")
        << method;
    // And the ball itself is as bright by either.
    double total = mean_of(picture.color);
    if (splatted == 0.0) splatted = total;
    EXPECT_NEAR(total, splatted, 0.01 * splatted) << method;
  }
}

TEST(GlobalLight, BytesAreEqualForAnyNumberOfThreads) {
  for (const std::string method : {"lens-sampling", "pinhole", "wave"}) {
    Scene scene = furnished_room();
    if (method == "wave") scene.lights.clear();  // it carries no light from lamps by glass
    SimulationSpec spec = shot(method, 24);
    spec.effects.diffraction = EffectChoice::automatic;
    spec.quality.max_error = 0.04;
    const Photograph one = photograph(spec, scene, 1);
    for (const int threads : {2, 3, 4}) {
      const Photograph many = photograph(spec, scene, threads);
      EXPECT_TRUE(one.color == many.color) << method << ", " << threads << " threads";
      EXPECT_EQ(one.report.error.upper_95, many.report.error.upper_95) << method;
      EXPECT_EQ(one.report.cost.rays, many.report.cost.rays) << method;
    }
  }
}

// What was asked to be left out is told, as large as it would be with light of one all around, and
// no part of the error.
TEST(LocalLight, TellsWhatItLeavesOut) {
  Scene scene;
  scene.materials = {Material{.emission = {.value = grey(0.2)}, .reflection = 0.25}};
  scene.objects = {
      {.shape = QuadObject{.corner = {-4, -4, -3}, .edge_u = {8, 0, 0}, .edge_v = {0, 8, 0}}}};
  scene.background = {1, 1, 1};
  SimulationSpec spec = shot("auto");
  spec.illumination = Illumination::local;
  const Photograph local = photograph(spec, scene);
  EXPECT_NEAR(mean_of(local.color), 0.2, 1e-6);
  const ModelledEffect* branches = told(local, "reflection and transmission");
  ASSERT_NE(branches, nullptr);
  EXPECT_FALSE(branches->modelled);
  EXPECT_NEAR(branches->bound, 0.25, 1e-6);
  EXPECT_LE(local.report.error.upper_95, 0.01);
  spec.illumination = Illumination::recursive;
  EXPECT_NEAR(mean_of(photograph(spec, scene).color), 0.45, 1e-6);
}

}  // namespace
}  // namespace fstop
