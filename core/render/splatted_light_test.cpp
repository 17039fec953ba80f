#include "core/render/splatted_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/optics/aperture.h"

namespace fstop {
namespace {

// Balls at 5 m before nothing, seen by a lens focused at 2 m: discs of 54 px.
struct Lamps {
  explicit Lamps(std::vector<std::pair<Vec3, float>> lamps, float wall = 0.0F,
                 double radius = 0.004, double f_number = 2.0, double pitch_um = 37.5) {
    Scene scene;
    scene.background = {wall, wall, wall};
    for (const auto& [center, value] : lamps) {
      scene.objects.push_back({.shape = SphereObject{.center = center, .radius = radius},
                               .material = static_cast<int>(scene.materials.size())});
      scene.materials.push_back({.emission = {.value = {value, value, value}}});
    }
    ray_scene.emplace(scene);
    spec.optics =
        LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = f_number}, .focus_distance = 2.0_m};
    spec.sensor_width = spec.sensor_height = Length::si(1e-6 * pitch_um * kSide);
    sensor = sensor_of(spec, kSide, kSide);
    camera.emplace(camera_of(spec, sensor));
  }
  static constexpr int kSide = 96;
  std::optional<RayScene> ray_scene;
  CameraSpec spec;
  Sensor sensor;
  std::optional<Camera> camera;
};

// The light of each replicate.
std::array<Image, kReplicates> splatted(const Lamps& lamps, double goal_mse, double most_points,
                                        std::uint64_t* rays = nullptr) {
  SampleSource source{.scene = *lamps.ray_scene,
                      .camera = *lamps.camera,
                      .sensor = lamps.sensor,
                      .pupil = PupilWarp(aperture_vertices(aperture_of(lamps.spec))),
                      .sequence = SampleSequence(1)};
  const Splatting splatting(*lamps.camera, 1, source);
  ReplicateFilm film(Lamps::kSide, Lamps::kSide);
  SplattedLight light(*splatting.light());
  light.splat(goal_mse, most_points, film, {});
  if (rays != nullptr) *rays = light.rays();
  std::array<Image, kReplicates> images;
  for (int r = 0; r < kReplicates; ++r) {
    for (std::size_t block = 0; block < film.grid().count(); ++block) film.add(r, block, {}, 1);
    film.copy_replicate(r, images[static_cast<std::size_t>(r)], {});
  }
  return images;
}

double sum_of(const Image& image) {
  double sum = 0.0;
  for (const float value : image.pixels()) sum += double{value} / 3.0;
  return sum;
}

double mse_between(const std::array<Image, kReplicates>& images) {
  double squares = 0.0;
  for (std::size_t i = 0; i < images[0].pixels().size(); ++i) {
    const double off = std::clamp(double{images[0].pixels()[i]}, 0.0, 1.0) -
                       std::clamp(double{images[1].pixels()[i]}, 0.0, 1.0);
    squares += 0.25 * off * off;
  }
  return squares / static_cast<double>(images[0].pixels().size());
}

// A ball's light: its radiance times the area of its sharp image, pi (r v/(d p))^2 pixels, whatever
// the points are that tell it, one for each lamp or thousands that have joined. v/p =
// 50/(1 - 50/2000) mm over 37.5 um.
TEST(SplattedLight, LightIsTheSameHoweverOftenPointsDouble) {
  // One far brighter than the others: they rest at the fewest points while it doubles, then follow.
  const Lamps lamps(
      {{{0.0, 0.0, -5.0}, 300.0F}, {{0.01, 0.01, -5.0}, 3.0F}, {{-0.02, 0.01, -5.0}, 2.0F}});
  const double scale = 0.05 / (1.0 - 0.05 / 2.0) / 37.5e-6;
  const double expected = 305.0 * std::numbers::pi * std::pow(0.004 / 5.0 * scale, 2);
  for (const double goal : {1e-2, 2e-4, 1e-4, 5e-5, 1e-6}) {
    const auto images = splatted(lamps, goal, 1e8);
    for (const Image& image : images) {
      // Discs lie within the picture; cos^3 over a pupil of 25 mm at 5 m changes 2e-5, the depth of
      // the balls' faces 0.004/5.
      EXPECT_NEAR(sum_of(image), expected, 2e-3 * expected) << goal;
    }
    EXPECT_LE(mse_between(images), goal);
  }
}

// What lamps hide, here half as bright as they are, is taken away from every point of their discs
// alike: more points bring both replicates together.
TEST(SplattedLight, WhatLampsHideConvergesToo) {
  Lamps lamps({{{0.0, 0.0, -5.0}, 40.0F}, {{0.02, -0.01, -5.0}, 35.0F}}, 20.0F);
  double before = 0.0;
  for (const double points : {1e5, 8e5, 6.4e6}) {
    const auto images = splatted(lamps, 1e-14, points);
    double squares = 0.0;
    for (std::size_t i = 0; i < images[0].pixels().size(); ++i) {
      squares += std::pow(double{images[0].pixels()[i]} - double{images[1].pixels()[i]}, 2);
    }
    // Eight times the points: an eighth of independent points' squares, nets leave less.
    if (before > 0.0) {
      EXPECT_LT(squares, before / 6.0) << points;
    }
    before = squares;
  }
}

// Lamps whose discs are a few pixels wide start at the fewest points, and their wishes double
// several times before they get more.
TEST(SplattedLight, LampsAtTheFewestPointsGetMore) {
  const Lamps lamps(
      {{{0.03, 0.0, -8.0}, 800.0F}, {{0.25, 0.2, -8.0}, 800.0F}, {{-0.2, 0.0, -8.0}, 800.0F}}, 0.0F,
      0.02, 1.4, 300.0);
  for (const double goal : {2e-5, 1e-6}) EXPECT_LE(mse_between(splatted(lamps, goal, 1e8)), goal);
}

TEST(SplattedLight, PointsEndAtTheMostAllowed) {
  const Lamps lamps({{{0.0, 0.0, -5.0}, 40.0F}});
  std::uint64_t rays = 0;
  splatted(lamps, 1e-12, 20'000.0, &rays);
  EXPECT_LE(rays, 2U * 20'000U);  // of a point at most its own and one for what it hides
  EXPECT_GE(rays, 10'000U);
}

}  // namespace
}  // namespace fstop
