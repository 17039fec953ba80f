// Local, recursive and global illumination: what a surface shows of all others' light.
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/shading/ray_tree.h"

namespace fstop {
namespace {

struct Estimate {
  double mean = 0.0;
  double error = 0.0;  // standard, from replicates of other seeds
};

constexpr int kReplicates = 16;

// What a ray from `origin` sees in red: 16 independent nets of `samples` each.
Estimate radiance(const Scene& scene, Vec3f origin, Vec3f direction, Illumination illumination,
                  std::uint32_t samples) {
  const RayScene ray_scene(scene);
  double sum = 0.0;
  double squares = 0.0;
  for (std::uint32_t replicate = 0; replicate < kReplicates; ++replicate) {
    double net = 0.0;
    for (std::uint32_t first = 0; first < samples; first += kLanes) {
      RayPacket packet;
      alignas(64) LaneMask all;
      all.fill(-1);
      for (int k = 0; k < kLanes; ++k) packet.set(k, origin, normalized(direction), kFar, 0.0F);
      ray_scene.intersect(packet, all, Coherence::coherent);
      ShadingInputs inputs{.scene = ray_scene,
                           .sequence = SampleSequence(100 + replicate),
                           .illumination = illumination};
      for (std::uint32_t k = 0; k < kLanes; ++k) inputs.keys.index[k] = first + k;
      LaneColors colors;
      std::uint64_t rays = 0;
      shade(inputs, packet, all, colors, rays);
      for (const float red : colors.r) net += double{red} / samples;
    }
    sum += net;
    squares += net * net;
  }
  const double mean = sum / kReplicates;
  const double variance = std::max(0.0, squares / kReplicates - mean * mean) / (kReplicates - 1);
  return {.mean = mean, .error = std::sqrt(variance)};
}

Estimate global_radiance(const Scene& scene, Vec3f origin, Vec3f direction,
                         std::uint32_t samples = 4096) {
  return radiance(scene, origin, direction, Illumination::global, samples);
}

// Three standard errors, single precision's roundings, and no more than half a percent.
void expect_radiance(const Estimate& seen, double expected) {
  EXPECT_NEAR(seen.mean, expected, 3.0 * seen.error + 1e-5 * expected);
  EXPECT_NEAR(seen.mean, expected, 0.005 * expected);
}

Rgb grey(double value) {
  const auto v = static_cast<float>(value);
  return {v, v, v};
}

Material diffuse(double albedo, double emission = 0.0) {
  return {.model = ShadingModel::phong,
          .emission = {.value = grey(emission)},
          .ambient = {.value = grey(0.3)},
          .diffuse = {.value = grey(albedo)}};
}
Material lamp(double emission) { return {.emission = {.value = grey(emission)}}; }

// A horizontal square about the axis.
Object square(double height, double half, int material) {
  return {.shape = QuadObject{.corner = {-half, height, -half},
                              .edge_u = {2 * half, 0, 0},
                              .edge_v = {0, 0, 2 * half}},
          .material = material};
}

Scene box(const Material& material) {
  Scene scene;
  scene.materials = {material};
  const auto add = [&](Vec3 corner, Vec3 u, Vec3 v) {
    scene.objects.push_back({.shape = QuadObject{.corner = corner, .edge_u = u, .edge_v = v}});
  };
  for (const double side : {-1.0, 1.0}) {
    add({side, -1, -2}, {0, 2, 0}, {0, 0, 4});
    add({-1, side, -2}, {2, 0, 0}, {0, 0, 4});
    add({-1, -1, 2 * side}, {2, 0, 0}, {0, 2, 0});
  }
  return scene;
}

Scene hollow_sphere(const Material& material) {
  Scene scene;
  scene.materials = {material};
  scene.objects = {{.shape = SphereObject{.center = {0.2, 0.1, 0.3}, .radius = 2.0}}};
  return scene;
}

// In a closed room of one emission e and albedo rho radiance is e (1 + rho + rho^2 + ...).
TEST(Interreflection, FurnaceIsTheGeometricSeries) {
  for (const double albedo : {0.2, 0.5, 0.8}) {
    const double expected = 0.4 / (1.0 - albedo);
    expect_radiance(global_radiance(box(diffuse(albedo, 0.4)), {0.1F, 0.2F, 0}, {1, 0.3F, -0.2F}),
                    expected);
    expect_radiance(
        global_radiance(hollow_sphere(diffuse(albedo, 0.4)), {0.1F, 0.2F, 0}, {1, 0.3F, -0.2F}),
        expected);
  }
}

// A surface that both scatters and mirrors sends on what it would if it did one of them: its
// branches must live and die independently, or light would hide in few samples.
TEST(Interreflection, FurnaceOfDiffuseMirrorsIsTheSameSeries) {
  for (const auto& [albedo, reflection] : {std::pair{0.5, 0.4}, {0.7, 0.2}, {0.3, 0.5}}) {
    Material material = diffuse(albedo, 0.1);
    material.reflection = reflection;
    const double expected = 0.1 / (1.0 - albedo - reflection);
    const Estimate seen = global_radiance(box(material), {0.1F, 0.2F, 0}, {1, 0.3F, -0.2F}, 1024);
    std::printf("diffuse %.1f, mirrored %.1f: %.4f of %.1f, standard error %.4f\n", albedo,
                reflection, seen.mean, expected, seen.error);
    // Mirrors before the first diffuse bounce are cut below kSmallestBranch: less than 0.001 in
    // all.
    EXPECT_NEAR(seen.mean, expected, 3.0 * seen.error + 0.001 * expected);
    EXPECT_LT(seen.error, 0.01 * expected);
  }
}

// More light than falls on it counts as all of it: otherwise it would have no end.
TEST(Interreflection, ColoursAboveOneCountAsOne) {
  const auto seen = [](double albedo) {
    return global_radiance(box(diffuse(albedo, 0.1)), {0.1F, 0.2F, 0}, {1, 0.3F, -0.2F}, 64).mean;
  };
  EXPECT_EQ(seen(1e6), seen(1.0));
}

// The same light by lights instead of emission: reflected once at each wall, it goes on.
TEST(Interreflection, LightsReflectionsGoOnAsEmission) {
  Scene scene = hollow_sphere(diffuse(0.5));
  std::get<SphereObject>(scene.objects[0].shape) = {.center = {}, .radius = 2.0};
  scene.lights = {{.kind = PointLight{.position = {}}, .intensity = {1, 1, 1}}};
  // The lamp in the middle, N.L = 1 everywhere: 0.5 of it at once, 0.5/(1 - 0.5) in all.
  EXPECT_NEAR(radiance(scene, {0.1F, 0.2F, 0}, {1, 0.3F, -0.2F}, Illumination::recursive, 16).mean,
              0.5, 1e-5);
  expect_radiance(global_radiance(scene, {0.1F, 0.2F, 0}, {1, 0.3F, -0.2F}), 1.0);
}

// An element opposite the middle of a parallel square, half as wide as a, at distance h: four times
// the factor of a rectangle with a corner over the element, X = Y = a/h. Source: Howell, A Catalog
// of Radiation Heat Transfer Configuration Factors, elements to rectangles.
double square_factor(double half, double distance) {
  const double x = half / distance;
  const double root = std::sqrt(1.0 + x * x);
  return 4.0 * (1.0 / (2.0 * std::numbers::pi)) * 2.0 * (x / root) * std::atan(x / root);
}

TEST(Interreflection, ASquareLampLightsByItsConfigurationFactor) {
  for (const double half : {0.3, 1.0, 4.0}) {
    Scene scene;
    scene.materials = {diffuse(0.6), lamp(2.0)};
    scene.objects = {square(0.0, 10.0, 0), square(1.0, half, 1)};
    scene.ambient_light = {1, 1, 1};  // interreflection takes its place
    // From below the lamp, at the point under its middle.
    expect_radiance(global_radiance(scene, {0.2F, 0.5F, 0}, {-0.2F, -0.5F, 0}, 16384),
                    0.6 * 2.0 * square_factor(half, 1.0));
  }
}

// A sphere of radius r, centre h above the element: (r/h)^2.
TEST(Interreflection, ABallLightsByItsConfigurationFactor) {
  Scene scene;
  scene.materials = {diffuse(0.6), lamp(2.0)};
  scene.objects = {square(0.0, 10.0, 0),
                   {.shape = SphereObject{.center = {0, 1, 0}, .radius = 0.5}, .material = 1}};
  expect_radiance(global_radiance(scene, {0.8F, 0.4F, 0}, {-0.8F, -0.4F, 0}, 16384),
                  0.6 * 2.0 * 0.25);
}

// Planes so large that what leaves at their borders is a millionth: B1 = e + rho1 B2, B2 = rho2 B1.
TEST(Interreflection, FacingPlanesAddUpAllOrders) {
  Scene scene;
  scene.materials = {diffuse(0.7), diffuse(0.5, 0.3)};
  scene.objects = {square(0.0, 1000.0, 0), square(1.0, 1000.0, 1)};
  const double lower = 0.7 * 0.3 / (1.0 - 0.7 * 0.5);
  expect_radiance(global_radiance(scene, {0.2F, 0.5F, 0}, {-0.2F, -0.5F, 0.1F}), lower);
  expect_radiance(global_radiance(scene, {0.2F, 0.5F, 0}, {-0.2F, 0.5F, 0.1F}), 0.3 + 0.5 * lower);
}

// What misses the scene brings the background, whose mean over any directions it is.
TEST(Interreflection, TheBackgroundIsTheSky) {
  Scene scene;
  scene.materials = {diffuse(0.6)};
  scene.objects = {square(0.0, 10.0, 0)};
  scene.background = grey(0.5);
  scene.ambient_light = {1, 1, 1};
  expect_radiance(global_radiance(scene, {0, 1, 0}, {0.2F, -1, 0}), 0.3);
}

// A perfect mirror shows a floor itself, e + rho (e + ...); a sheet passes its share of the sky.
TEST(Interreflection, DiffuseRaysFollowMirrorsAndSheets) {
  Scene scene;
  scene.materials = {diffuse(0.5, 0.4), Material{.reflection = 1.0}};
  scene.objects = {square(0.0, 1000.0, 0), square(1.0, 1000.0, 1)};
  expect_radiance(global_radiance(scene, {0, 0.5F, 0}, {0.2F, -1, 0}), 0.8);
  expect_radiance(global_radiance(scene, {0, 0.5F, 0}, {0.2F, 1, 0}), 0.8);

  scene.materials = {diffuse(0.5), Material{.transmission = 0.2}};
  scene.background = {1, 1, 1};
  expect_radiance(global_radiance(scene, {0, 0.5F, 0}, {0.2F, -1, 0}), 0.5 * 0.2);
}

// A ball of glass without loss, Fresnel's shares adding up to one, changes nothing in a furnace.
TEST(Interreflection, ClearGlassIsInvisibleInAFurnace) {
  Scene scene = box(diffuse(0.5, 0.4));
  scene.materials.push_back(
      Material{.reflection = 1.0, .transmission = 1.0, .ior = 1.5, .fresnel = true});
  scene.objects.push_back(
      {.shape = SphereObject{.center = {0.3, 0, 0}, .radius = 0.5}, .material = 1});
  expect_radiance(global_radiance(scene, {-0.9F, 0.2F, 0}, {0.1F, -1, 0.2F}), 0.8);
}

// A thin sheet's own colour counts for what it does not let through.
TEST(Interreflection, ASheetKeepsItsShareOfDiffuseLight) {
  Scene scene;
  scene.materials = {diffuse(0.6)};
  scene.materials[0].transmission = 0.25;
  scene.objects = {square(0.0, 10.0, 0)};
  scene.background = grey(1.0);
  // 0.75 of 0.6 of the sky above, and 0.25 of that below.
  expect_radiance(global_radiance(scene, {0, 1, 0}, {0.2F, -1, 0}), 0.75 * 0.6 + 0.25);
}

// Without diffuse colours there is nothing to add: the same numbers, bit for bit.
TEST(Interreflection, WithoutDiffuseSurfacesGlobalIsRecursive) {
  Scene scene = box(lamp(0.7));
  scene.materials.push_back(
      Material{.reflection = 0.9, .transmission = 0.8, .ior = 1.5, .fresnel = true});
  scene.objects.push_back({.shape = SphereObject{.center = {}, .radius = 0.5}, .material = 1});
  const auto seen = [&](Illumination illumination) {
    return radiance(scene, {-0.9F, 0.2F, 0}, {0.9F, -0.1F, 0.2F}, illumination, 16).mean;
  };
  EXPECT_EQ(seen(Illumination::global), seen(Illumination::recursive));
}

TEST(LocalIllumination, MirrorsAndGlassShowTheirOwnLightAlone) {
  Scene scene;
  scene.materials = {Material{.model = ShadingModel::phong,
                              .emission = {.value = grey(0.1)},
                              .ambient = {.value = grey(0.5)},
                              .reflection = 0.5},
                     lamp(1.0)};
  scene.objects = {square(0.0, 10.0, 0), square(1.0, 10.0, 1)};
  scene.ambient_light = grey(0.4);
  const auto seen = [&](Illumination illumination) {
    return radiance(scene, {0, 0.5F, 0}, {0.2F, -1, 0}, illumination, 16).mean;
  };
  EXPECT_NEAR(seen(Illumination::recursive), 0.1 + 0.2 + 0.5, 1e-6);
  EXPECT_NEAR(seen(Illumination::local), 0.1 + 0.2, 1e-6);
  // A sheet still covers what lies behind it by its share: it is black there.
  scene.materials[0].transmission = 0.25;
  EXPECT_NEAR(seen(Illumination::local), 0.75 * 0.3, 1e-6);
}

TEST(LocalIllumination, WhatIsLeftOutIsCounted) {
  Scene scene;
  scene.materials = {Material{.reflection = 0.5, .transmission = 0.25}};
  scene.objects = {square(0.0, 10.0, 0)};
  const RayScene ray_scene(scene);
  RayPacket packet;
  packet.set(0, {0, 1, 0}, {0, -1, 0}, kFar, 0.0F);
  ray_scene.intersect_one(packet);
  alignas(64) LaneFloats cut = {};
  ShadingInputs inputs{.scene = ray_scene,
                       .sequence = SampleSequence(1),
                       .cut = &cut,
                       .illumination = Illumination::local};
  alignas(64) LaneMask first = {-1};
  LaneColors colors;
  std::uint64_t rays = 0;
  shade(inputs, packet, first, colors, rays);
  EXPECT_EQ(cut[0], 0.75F * 0.5F + 0.25F);
  EXPECT_EQ(rays, 0U);
  EXPECT_EQ(branch_bound(scene.materials, Illumination::local).error, 0.75 * 0.5 + 0.25);
}

// A white room never ends by chance: what is cut at the deepest is its full weight.
TEST(Interreflection, EndsOfPathsAreCounted) {
  const Scene scene = box(diffuse(1.0));
  const RayScene ray_scene(scene);
  RayPacket packet;
  packet.set(0, {}, normalized(Vec3f{0.1F, 1, 0}), kFar, 0.0F);
  ray_scene.intersect_one(packet);
  alignas(64) LaneFloats cut = {};
  ShadingInputs inputs{.scene = ray_scene,
                       .sequence = SampleSequence(1),
                       .cut = &cut,
                       .illumination = Illumination::global};
  alignas(64) LaneMask first = {-1};
  LaneColors colors;
  std::uint64_t rays = 0;
  shade(inputs, packet, first, colors, rays);
  EXPECT_EQ(cut[0], 1.0F);
  EXPECT_EQ(rays, static_cast<std::uint64_t>(kDeepestBranch));
  EXPECT_EQ(branch_bound(scene.materials, Illumination::global).error, 1.0);
}

}  // namespace
}  // namespace fstop
