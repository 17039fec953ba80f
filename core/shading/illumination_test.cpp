#include "core/shading/illumination.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/shading/light.h"
#include "core/shading/material.h"
#include "core/shading/ray_tree.h"

namespace fstop {
namespace {

// Promised: 1e-5. A dozen single-precision roundings of numbers below 1 leave 1e-6.
constexpr float kTolerance = 1e-5F;

Rgb radiance(const Scene& scene, Vec3f origin, Vec3f direction, std::uint32_t index = 0) {
  const RayScene ray_scene(scene);
  RayPacket packet;
  packet.set(0, origin, normalized(direction), kFar, 0.0F);
  ray_scene.intersect_one(packet);
  ShadingInputs inputs{.scene = ray_scene, .sequence = SampleSequence(1)};
  inputs.keys.index[0] = index;
  alignas(64) LaneMask first = {-1};
  LaneColors colors;
  std::uint64_t rays = 0;
  shade(inputs, packet, first, colors, rays);
  return colors.get(0);
}

void expect_color(const Rgb& actual, const Rgb& expected) {
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(actual[c], expected[c], kTolerance) << "c " << c;
}

Object wall(double z, double size = 2.0) {
  return {.shape = QuadObject{
              .corner = {-size / 2, -size / 2, z}, .edge_u = {size, 0, 0}, .edge_v = {0, size, 0}}};
}

// A wall one metre in front of the eye at the origin; it is hit at (0, 0, -1), N = V = (0,0,1).
Scene lit_wall(ShadingModel model, double shininess) {
  Scene scene;
  scene.materials = {Material{.model = model,
                              .emission = {.value = {0.01F, 0.0F, 0.0F}},
                              .ambient = {.value = {0.2F, 0.2F, 0.2F}},
                              .diffuse = {.value = {0.5F, 0.25F, 0.1F}},
                              .specular = {.value = {0.3F, 0.3F, 0.3F}},
                              .shininess = shininess}};
  scene.objects = {wall(-1.0)};
  scene.ambient_light = {0.1F, 0.2F, 0.0F};
  return scene;
}

Light point_light() {
  // From (0,0,-1) it is at (3,0,4): d = 5, L = (0.6, 0, 0.8), f = 1/(1 + 0.1*5 + 0.02*25) = 1/2.
  return {.kind = PointLight{.position = {3, 0, 3}, .attenuation = {1.0, 0.1, 0.02}},
          .intensity = {2.0F, 1.0F, 0.5F}};
}

TEST(Illumination, PhongWithAttenuationAtAPoint) {
  Scene scene = lit_wall(ShadingModel::phong, 3.0);
  scene.lights = {point_light()};
  // N.L = 0.8; R = (-0.6, 0, 0.8), R.V = 0.8, cubed 0.512.
  // red: 0.01 + 0.2*0.1 + 0.5*2*(0.5*0.8 + 0.3*0.512) = 0.5836
  // green: 0.2*0.2 + 0.5*1*(0.25*0.8 + 0.1536) = 0.2168; blue: 0.5*0.5*(0.08 + 0.1536) = 0.0584
  expect_color(radiance(scene, {0, 0, 0}, {0, 0, -1}), {0.5836F, 0.2168F, 0.0584F});
}

TEST(Illumination, BlinnPhongAtAPoint) {
  Scene scene = lit_wall(ShadingModel::blinn_phong, 2.0);
  scene.lights = {point_light()};
  // H = (0.6, 0, 1.8)/sqrt(3.6), (N.H)^2 = 3.24/3.6 = 0.9.
  expect_color(radiance(scene, {0, 0, 0}, {0, 0, -1}),
               {0.03F + 0.4F + 0.27F, 0.04F + 0.5F * (0.2F + 0.27F), 0.25F * (0.08F + 0.27F)});
}

TEST(Illumination, SpotLightFallsWithTheCosineToItsExponent) {
  Scene scene = lit_wall(ShadingModel::phong, 3.0);
  scene.ambient_light = {0, 0, 0};
  scene.materials[0].emission.value = {0, 0, 0};
  scene.materials[0].specular.value = {0, 0, 0};
  // The lamp points along -z: cos = 0.8, squared 0.64, on top of attenuation 1/2.
  scene.lights = {{.kind = SpotLight{.position = {3, 0, 3},
                                     .direction = {0, 0, -7},
                                     .exponent = 2.0,
                                     .attenuation = {1.0, 0.1, 0.02}},
                   .intensity = {2.0F, 1.0F, 0.5F}}};
  expect_color(radiance(scene, {0, 0, 0}, {0, 0, -1}),
               {0.64F * 0.5F * 2.0F * 0.4F, 0.64F * 0.5F * 0.2F, 0.64F * 0.25F * 0.08F});
  // Turned away, it gives nothing, whatever the exponent.
  std::get<SpotLight>(scene.lights[0].kind).direction = {0, 0, 1};
  std::get<SpotLight>(scene.lights[0].kind).exponent = 0.0;
  expect_color(radiance(scene, {0, 0, 0}, {0, 0, -1}), {0, 0, 0});
}

TEST(Illumination, DirectionalLightHasNoAttenuation) {
  Scene scene = lit_wall(ShadingModel::phong, 1.0);
  scene.lights = {{.kind = DirectionalLight{.direction = {-6, 0, -8}}, .intensity = {1, 1, 1}}};
  const Rgb expected = {0.03F + 0.4F + 0.24F, 0.04F + 0.2F + 0.24F, 0.08F + 0.24F};
  expect_color(radiance(scene, {0, 0, 0}, {0, 0, -1}), expected);
  // Of any length: single precision does not hold the square of 1e-30.
  scene.lights[0].kind = DirectionalLight{.direction = {-6e-30, 0, -8e-30}};
  expect_color(radiance(scene, {0, 0, 0}, {0, 0, -1}), expected);
}

TEST(Illumination, BothSidesOfASurfaceAreLit) {
  Scene scene = lit_wall(ShadingModel::phong, 1.0);
  scene.lights = {{.kind = DirectionalLight{.direction = {0, 0, 1}}, .intensity = {1, 1, 1}}};
  // Seen from behind, the normal is turned: light from behind counts.
  expect_color(radiance(scene, {0, 0, -3}, {0, 0, 1}), {0.03F + 0.8F, 0.04F + 0.55F, 0.4F});
  // Seen from the front it comes from behind the surface.
  expect_color(radiance(scene, {0, 0, 0}, {0, 0, -1}), {0.03F, 0.04F, 0.0F});
}

TEST(Illumination, ShadowLeavesAmbientAndEmission) {
  Scene scene = lit_wall(ShadingModel::phong, 3.0);
  scene.lights = {point_light()};
  // A small screen half-way to the light, at (1.5, 0, 1).
  scene.objects.push_back(
      {.shape =
           QuadObject{.corner = {1.4, -0.1, 1.0}, .edge_u = {0.2, 0, 0}, .edge_v = {0, 0.2, 0}}});
  expect_color(radiance(scene, {0, 0, 0}, {0, 0, -1}), {0.03F, 0.04F, 0.0F});
  // Behind the light it casts none: shadow rays end at the light.
  std::get<QuadObject>(scene.objects[1].shape).corner = {3.65, -0.1, 4.0};
  expect_color(radiance(scene, {0, 0, 0}, {0, 0, -1}), {0.5836F, 0.2168F, 0.0584F});
}

TEST(Illumination, ShadowRaysPassThinSheetsByTheirTransmission) {
  Scene scene = lit_wall(ShadingModel::phong, 3.0);
  scene.materials[0].ambient.value = {0, 0, 0};
  scene.materials[0].emission.value = {0, 0, 0};
  scene.lights = {point_light()};
  scene.materials.push_back(Material{.model = ShadingModel::phong, .transmission = 0.5});
  for (const double z : {0.5, 1.0}) {
    scene.objects.push_back(
        {.shape = QuadObject{.corner = {-1, -1, z}, .edge_u = {4, 0, 0}, .edge_v = {0, 2, 0}},
         .material = 1});
  }
  expect_color(radiance(scene, {0, 0, 0}, {0, 0, -1}),
               {0.25F * 0.5536F, 0.25F * 0.1768F, 0.25F * 0.0584F});
}

Scene triangle(Interpolation interpolation) {
  Mesh mesh{.positions = {{-1, -1, -1}, {1, -1, -1}, {0, 1, -1}},
            .normals = {{-0.6F, 0, 0.8F}, {0.6F, 0, 0.8F}, {0, 0, 1}},
            .triangles = {{0, 1, 2}}};
  Scene scene;
  scene.materials = {Material{.model = ShadingModel::phong,
                              .diffuse = {.value = {0.5F, 0.5F, 0.5F}},
                              .specular = {.value = {0.4F, 0.4F, 0.4F}},
                              .shininess = 2.0}};
  scene.objects = {{.shape = MeshObject{.interpolation = interpolation, .mesh = mesh}}};
  scene.lights = {{.kind = DirectionalLight{.direction = {0, 0, -1}}, .intensity = {1, 1, 1}}};
  return scene;
}

// The middle ray hits (0,0,-1) with barycentric weights 1/4, 1/4, 1/2. L = (0,0,1).
TEST(Illumination, GouraudInterpolatesTheCornersFactors) {
  // N.L: 0.8, 0.8, 1 -> 0.9. R.V: at the lower corners (-+0.96, 0, 0.28).(+-1, 1, 1) < 0 -> 0; at
  // the upper one (0,0,1).(0,-1,1)/sqrt 2, squared 1/2 -> 1/4 in all.
  const float expected = 0.5F * 0.9F + 0.4F * 0.25F;
  expect_color(radiance(triangle(Interpolation::gouraud), {0, 0, 0}, {0, 0, -1}),
               {expected, expected, expected});
}

TEST(Illumination, PhongInterpolationUsesTheInterpolatedNormal) {
  // The middle normal is (0,0,1): all of both terms.
  expect_color(radiance(triangle(Interpolation::phong), {0, 0, 0}, {0, 0, -1}), {0.9F, 0.9F, 0.9F});
  // At (0,-0.6,-1): weights 0.4, 0.4, 0.2; N = (0, 0, 0.84) again along z; V = (0, 0.6, 1)/1.16619.
  const float rv = 1.0F / std::sqrt(1.36F);
  const float expected = 0.5F + 0.4F * rv * rv;
  expect_color(radiance(triangle(Interpolation::phong), {0, 0, 0}, {0, -0.6F, -1}),
               {expected, expected, expected});
}

TEST(Illumination, FlatInterpolationUsesTheFaceNormal) {
  Scene scene = triangle(Interpolation::flat);
  scene.lights[0].kind = DirectionalLight{.direction = {-0.6, 0, -0.8}};
  const float expected = 0.5F * 0.8F + 0.4F * 0.64F;  // whatever the corners' normals say
  expect_color(radiance(scene, {0, 0, 0}, {0, 0, -1}), {expected, expected, expected});
  // Off the middle the view changes and nothing else: at (0.3, -0.5, -1), V = (-0.3, 0.5, 1)/|.|,
  // R = (-0.6, 0, 0.8).
  const float rv = (0.18F + 0.8F) / std::sqrt(1.34F);
  const float beside = 0.5F * 0.8F + 0.4F * rv * rv;
  expect_color(radiance(scene, {0, 0, 0}, {0.3F, -0.5F, -1}), {beside, beside, beside});
}

TEST(Illumination, AreaLightIsTheMeanOfItsPoints) {
  Scene scene = lit_wall(ShadingModel::phong, 1.0);
  scene.materials[0] =
      Material{.model = ShadingModel::phong, .diffuse = {.value = {1.0F, 1.0F, 1.0F}}};
  scene.ambient_light = {0, 0, 0};
  const AreaLight area{
      .corner = {-1, -1, 1}, .edge_u = {2, 0, 0}, .edge_v = {0, 2, 0}, .attenuation = {0, 0, 1}};
  scene.lights = {{.kind = area, .intensity = {1, 1, 1}}};
  // Mean of cos/d^2 over the square 2 m above the point: midpoint rule, 400 x 400 points, whose
  // error is below 1e-6 for so smooth an integrand.
  double expected = 0.0;
  constexpr int kGrid = 400;
  for (int j = 0; j < kGrid; ++j) {
    for (int i = 0; i < kGrid; ++i) {
      const double x = -1.0 + 2.0 * (i + 0.5) / kGrid;
      const double y = -1.0 + 2.0 * (j + 0.5) / kGrid;
      const double d2 = x * x + y * y + 4.0;
      expected += 2.0 / std::sqrt(d2) / d2 / (kGrid * kGrid);
    }
  }
  const RayScene ray_scene(scene);
  double sum = 0.0;
  constexpr std::uint32_t kSamples = 4096;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    RayPacket packet;
    packet.set(0, {0, 0, 0}, {0, 0, -1}, kFar, 0.0F);
    ray_scene.intersect_one(packet);
    ShadingInputs inputs{.scene = ray_scene, .sequence = SampleSequence(7)};
    inputs.keys.index[0] = i;
    alignas(64) LaneMask first = {-1};
    LaneColors colors;
    std::uint64_t rays = 0;
    shade(inputs, packet, first, colors, rays);
    sum += colors.r[0];
  }
  // 4,096 scrambled points of a smooth integrand of spread 0.02: under 1e-5 (1e-3 if independent).
  EXPECT_NEAR(sum / kSamples, expected, 5e-5);
}

TEST(Illumination, TextureTimesScaleIsTheColour) {
  Scene scene;
  TextureSource texture{
      .name = "halves", .filter = TextureFilter::nearest, .image = Image(2, 2, 3)};
  // Row 0 is the top: v > 1/2.
  const float values[4] = {0.1F, 0.2F, 0.3F, 0.4F};
  for (int i = 0; i < 4; ++i) {
    for (int c = 0; c < 3; ++c) texture.image.at(i % 2, i / 2)[c] = values[i];
  }
  scene.textures = {texture};
  scene.materials = {Material{.emission = {.value = {1.0F, 2.0F, 3.0F}, .texture = 0}}};
  scene.objects = {wall(-1.0)};
  expect_color(radiance(scene, {0, 0, 0}, {-0.5F, 0.5F, -1}), {0.1F, 0.2F, 0.3F});  // upper left
  expect_color(radiance(scene, {0, 0, 0}, {0.5F, -0.5F, -1}), {0.4F, 0.8F, 1.2F});  // lower right
}

Scene mirror_scene() {
  Scene scene;
  scene.materials = {Material{.reflection = 0.5},
                     Material{.emission = {.value = {1.0F, 0.5F, 0.25F}}},
                     Material{.emission = {.value = {0.2F, 0.2F, 0.2F}}, .transmission = 0.75}};
  scene.background = {0.1F, 0.1F, 0.1F};
  return scene;
}

TEST(RayTree, MirrorShowsWhatLiesBehindTheEye) {
  Scene scene = mirror_scene();
  scene.objects = {wall(-1.0), wall(2.0)};
  scene.objects[1].material = 1;
  expect_color(radiance(scene, {0, 0, 0}, {0.1F, 0, -1}), {0.5F, 0.25F, 0.125F});
}

TEST(RayTree, ThinSheetMixesItselfWithWhatIsBehind) {
  Scene scene = mirror_scene();
  scene.objects = {wall(-1.0), wall(-2.0, 6.0)};
  scene.objects[0].material = 2;
  scene.objects[1].material = 1;
  // (1 - 0.75) 0.2 + 0.75 behind, straight on.
  expect_color(radiance(scene, {0, 0, 0}, {0.2F, 0.1F, -1}),
               {0.05F + 0.75F, 0.05F + 0.375F, 0.05F + 0.1875F});
}

TEST(RayTree, ManyClearSheetsLetTheLightThrough) {
  Scene scene = mirror_scene();
  scene.materials[2] = Material{.transmission = 0.98};
  for (int i = 0; i < 40; ++i) {
    scene.objects.push_back(wall(-1.0 - 0.01 * i));
    scene.objects.back().material = 2;
  }
  scene.objects.push_back(wall(-2.0, 6.0));
  scene.objects.back().material = 1;
  // 0.98^40 of what is behind; 40 products of single precision round by 40 * 2^-24.
  EXPECT_NEAR(radiance(scene, {0, 0, 0}, {0.1F, 0, -1})[0], std::pow(0.98, 40), 1e-5);
}

TEST(RayTree, BoundCoversTheDeepestPath) {
  const std::vector<Material> clear = {Material{.transmission = 1.0}};
  EXPECT_DOUBLE_EQ(branch_bound(clear).error, 1.0);  // a longer stack would be black
  const std::vector<Material> mirror = {Material{.reflection = 0.95}};
  EXPECT_DOUBLE_EQ(branch_bound(mirror).error, std::pow(0.95, kDeepestBranch));
  EXPECT_FALSE(branch_bound(mirror).forks);
  const std::vector<Material> glass = {
      Material{.reflection = 0.1, .transmission = 0.9, .ior = 1.5}};
  EXPECT_TRUE(branch_bound(glass).forks);
}

TEST(Illumination, LightsOnAndNearSurfacesStayFinite) {
  Scene scene = lit_wall(ShadingModel::phong, 3.0);
  for (const Vec3 position : {Vec3{0, 0, -1}, Vec3{0, 0, -1 + 1e-30}, Vec3{0.1, 0, -0.9}}) {
    for (const Attenuation attenuation : {Attenuation{0, 0, 1e-300}, Attenuation{5e-324, 0, 0}}) {
      scene.lights = {{.kind = PointLight{.position = position, .attenuation = attenuation},
                       .intensity = {1e6F, 1e6F, 1e6F}}};
      for (const float value : radiance(scene, {0, 0, 0}, {0, 0, -1})) {
        EXPECT_TRUE(std::isfinite(value * value));
      }
    }
  }
}

TEST(RayTree, FacingMirrorsEndAtTheWeightThatCountsNoMore) {
  Scene scene = mirror_scene();
  scene.materials[0].emission.value = {1.0F, 1.0F, 1.0F};
  scene.objects = {wall(-1.0), wall(1.0)};
  // 1 + 1/2 + 1/4 + ... = 2, less what is cut off below kSmallestBranch.
  const Rgb color = radiance(scene, {0, 0, 0}, {0, 0, -1});
  EXPECT_NEAR(color[0], 2.0F, 2.0F * kSmallestBranch);
  EXPECT_LE(color[0], 2.0F);
}

TEST(RayTree, GlassBallBendsBySnellsLaw) {
  Scene scene = mirror_scene();
  scene.materials[0] = Material{.transmission = 0.9, .ior = 1.5};
  scene.objects = {{.shape = SphereObject{.center = {0, 0, -3}, .radius = 1.0}}, wall(-6.0, 20.0)};
  scene.objects[1].material = 1;
  // A ramp in x on the wall tells where the ray arrives.
  TextureSource ramp{.name = "ramp",
                     .filter = TextureFilter::bilinear,
                     .wrap = TextureWrap::clamp,
                     .image = Image(2, 1, 3)};
  for (int c = 0; c < 3; ++c) ramp.image.at(1, 0)[c] = 1.0F;
  scene.textures = {ramp};
  scene.materials[1].emission = {.value = {1, 1, 1}, .texture = 0};
  // Height 0.3 on a unit ball: sin i = 0.3, sin r = 0.2; in all the ray turns by 2 (i - r).
  const double i = std::asin(0.3);
  const double r = std::asin(0.2);
  const double turn = 2.0 * (i - r);
  // Exit point: the entry's angle from the +z axis is i; the chord subtends pi - 2r.
  const double exit_angle = i + std::numbers::pi - 2.0 * r;
  const double exit_x = std::sin(exit_angle);
  const double exit_z = -3.0 + std::cos(exit_angle);
  const double x = exit_x - std::tan(turn) * (exit_z + 6.0);
  // Between the two texels' centres (u = 1/4, 3/4) the ramp is 2u - 1/2; u = (x + 10)/20.
  const double expected = 0.81 * (2.0 * (x + 10.0) / 20.0 - 0.5);
  const Rgb color = radiance(scene, {0.3F, 0, 0}, {0, 0, -1});
  EXPECT_NEAR(color[0], expected, 2e-5);
}

TEST(RayTree, TotalReflectionTakesTheMirrorDirection) {
  Vec3f direction;
  // From index 1.5 into air the critical angle is 41.8 degrees.
  const Vec3f steep = normalized(Vec3f{0.5F, 0, -0.8F});
  EXPECT_TRUE(refracted(steep, {0, 0, 1}, 1.5F, direction));
  EXPECT_NEAR(direction.x, 1.5F * steep.x, 1e-6);
  EXPECT_NEAR(norm(direction), 1.0F, 1e-6);
  const Vec3f grazing = normalized(Vec3f{0.8F, 0, -0.5F});
  EXPECT_FALSE(refracted(grazing, {0, 0, 1}, 1.5F, direction));
  EXPECT_NEAR(mirrored(grazing, {0, 0, 1}).z, -grazing.z, 1e-7);

  // The same seen: from within glass a boundary at z = -1, whose normal points away from the eye,
  // and a shining wall at z = 1. What passes the boundary meets nothing.
  Scene scene;
  scene.materials = {Material{.transmission = 1.0, .ior = 1.5},
                     Material{.emission = {.value = {1.0F, 1.0F, 1.0F}}}};
  scene.objects = {
      {.shape =
           QuadObject{.corner = {-500, -500, -1}, .edge_u = {0, 1000, 0}, .edge_v = {1000, 0, 0}}},
      wall(1.0, 1000.0)};
  scene.objects[1].material = 1;
  EXPECT_EQ(radiance(scene, {}, grazing)[0], 1.0F);
  EXPECT_EQ(radiance(scene, {}, steep)[0], 0.0F);
}

// A quarter of the threshold: traced in one sample of four, four times as bright.
TEST(Illumination, DimLightIsTracedByChanceWithoutBias) {
  const Scene scene = [] {
    Scene dim = lit_wall(ShadingModel::phong, 10.0);
    dim.lights = {point_light()};
    return dim;
  }();
  const RayScene ray_scene(scene);
  const auto shaded = [&](float certain, std::uint32_t index, std::uint64_t& rays) {
    RayPacket packet;
    packet.set(0, {0, 0, 0}, {0, 0, -1}, kFar, 0.0F);
    ray_scene.intersect_one(packet);
    ShadingInputs inputs{
        .scene = ray_scene, .sequence = SampleSequence(1), .certain_light = certain};
    inputs.keys.index[0] = index;
    alignas(64) LaneMask first = {-1};
    LaneColors colors;
    shade(inputs, packet, first, colors, rays);
    return colors.get(0);
  };
  std::uint64_t rays = 0;
  const Rgb all = shaded(0.0F, 0, rays);
  ASSERT_EQ(rays, 1U);
  const float own = all[0] - shaded(1e-9F, 0, rays)[0];
  EXPECT_EQ(own, 0.0F);                        // brighter than that, it is always traced
  const float light = all[0] - 0.01F - 0.02F;  // beside emission and ambient light
  rays = 0;
  constexpr std::uint32_t kSamples = 64;
  double sum = 0.0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    sum += static_cast<double>(shaded(4.0F * light, i, rays)[0]);
  }
  EXPECT_EQ(rays, kSamples / 4);
  EXPECT_NEAR(sum / kSamples, static_cast<double>(all[0]), 1e-4);
}

}  // namespace
}  // namespace fstop
