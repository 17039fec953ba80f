// Fresnel's shares, gloss and frosting of the recursive light.
#include "core/shading/ray_tree.h"

#include <cmath>
#include <cstdio>
#include <numbers>

#include <gtest/gtest.h>

namespace fstop {
namespace {

// Sixteen samples at once, `packets` times: the mean of what a ray from the origin sees.
double mean_red(const Scene& scene, Vec3f direction, std::uint32_t packets,
                std::uint32_t seed = 7) {
  const RayScene ray_scene(scene);
  double sum = 0.0;
  for (std::uint32_t first = 0; first < packets; ++first) {
    RayPacket packet;
    alignas(64) LaneMask all;
    all.fill(-1);
    for (int k = 0; k < kLanes; ++k) packet.set(k, {0, 0, 0}, normalized(direction), kFar, 0.0F);
    ray_scene.intersect(packet, all, Coherence::coherent);
    ShadingInputs inputs{.scene = ray_scene, .sequence = SampleSequence(seed)};
    for (std::uint32_t k = 0; k < kLanes; ++k) inputs.keys.index[k] = kLanes * first + k;
    LaneColors colors;
    std::uint64_t rays = 0;
    shade(inputs, packet, all, colors, rays);
    for (const float red : colors.r) sum += double{red};
  }
  return sum / (kLanes * packets);
}

// Branches of r = t = 1/2 at depth d are 2^d of weight 2^-d: followed to 2^-9, 1023 in all.
TEST(RaysOfAPoint, CountLightsAndForks) {
  Scene scene;
  scene.materials = {Material{}, Material{.reflection = 0.9}, Material{.transmission = 0.9}};
  EXPECT_EQ(most_rays_of_a_point(scene), 1.0);
  scene.lights.resize(3);
  EXPECT_EQ(most_rays_of_a_point(scene), 4.0);
  scene.materials.push_back(Material{.reflection = 0.5, .transmission = 0.5});
  EXPECT_EQ(most_rays_of_a_point(scene), 1023.0 * 4.0);
  scene.materials.push_back(Material{.reflection = 0.9, .transmission = 0.9});
  EXPECT_EQ(most_rays_of_a_point(scene), 4096.0 * 4.0);
}

TEST(Fresnel, KnownReflectances) {
  // ((n-1)/(n+1))^2 at normal incidence, from either side.
  EXPECT_NEAR(fresnel_reflectance(1.0F, 1.0F / 1.5F), 0.04F, 1e-6F);
  EXPECT_NEAR(fresnel_reflectance(1.0F, 1.5F), 0.04F, 1e-6F);
  EXPECT_NEAR(fresnel_reflectance(1.0F, 1.0F / 2.4F), std::pow(1.4F / 3.4F, 2.0F), 1e-6F);
  EXPECT_NEAR(fresnel_reflectance(0.0F, 1.0F / 1.5F), 1.0F, 1e-6F) << "grazing";
  // Brewster's angle, tan = n: p is not reflected, s by ((n^2-1)/(n^2+1))^2, half of the light
  // each.
  const float n = 1.5F;
  EXPECT_NEAR(fresnel_reflectance(std::cos(std::atan(n)), 1.0F / n),
              0.5F * std::pow((n * n - 1) / (n * n + 1), 2.0F), 1e-6F);
  // Beyond the critical angle, sin = 1/n, all of it.
  const float critical = std::asin(1.0F / n);
  EXPECT_EQ(fresnel_reflectance(std::cos(critical + 0.01F), n), 1.0F);
  EXPECT_LT(fresnel_reflectance(std::cos(critical - 0.01F), n), 0.9F);
}

TEST(Fresnel, BothSidesReflectAlike) {
  for (int i = 1; i < 90; ++i) {
    const float angle = static_cast<float>(i) * std::numbers::pi_v<float> / 180.0F;
    const float inside = std::asin(std::sin(angle) / 1.7F);
    EXPECT_NEAR(fresnel_reflectance(std::cos(angle), 1.0F / 1.7F),
                fresnel_reflectance(std::cos(inside), 1.7F), 2e-5F)
        << i;
  }
}

// A quad before a white sky, seen 60 degrees off its normal: R of the sky behind the eye and 1 - R
// of that beyond, which are equally bright: together 1. With black beyond, R.
TEST(Fresnel, SharesOfASurfaceAddUpToOne) {
  Scene scene;
  scene.materials = {Material{.reflection = 1.0, .transmission = 1.0, .ior = 1.5, .fresnel = true}};
  scene.objects = {{.shape = QuadObject{
                        .corner = {-50, -50, -1}, .edge_u = {100, 0, 0}, .edge_v = {0, 100, 0}}}};
  scene.background = {1.0F, 1.0F, 1.0F};
  const Vec3f slanted{std::sqrt(3.0F) / 2.0F, 0.0F, -0.5F};
  EXPECT_NEAR(mean_red(scene, slanted, 1), 1.0, 1e-6);

  scene.materials.push_back({});  // unlit, black
  scene.objects.push_back(
      {.shape =
           QuadObject{.corner = {-500, -500, -2}, .edge_u = {1000, 0, 0}, .edge_v = {0, 1000, 0}},
       .material = 1});
  // 60 degrees: sin of the refracted angle 0.577350, cos 0.816497; s: (0.5 - 1.224745)/(0.5 +
  // 1.224745) = -0.420204; p: (0.75 - 0.816497)/(0.75 + 0.816497) = -0.042449; mean square
  // 0.089186.
  EXPECT_NEAR(mean_red(scene, slanted, 1), 0.089186, 2e-6);
}

TEST(Lobe, DirectionsHaveTheDensityOfCosinesPowers) {
  // Mean of cos over (n+1)/(2 pi) cos^n is (n+1)/(n+2), of its square (n+1)/(n+3); the directions
  // of a grid of 256 x 256 numbers, midpoints, whose error is that of the rule on a power of
  // 1/(n+1).
  const Vec3f axis = normalized(Vec3f{1.0F, 2.0F, -2.0F});
  for (const float n : {1.0F, 20.0F, 500.0F}) {
    double cosine = 0.0;
    Vec3f sum = {};
    for (int i = 0; i < 256; ++i) {
      for (int k = 0; k < 256; ++k) {
        const Vec3f direction = lobe_direction(axis, n, (static_cast<float>(i) + 0.5F) / 256.0F,
                                               (static_cast<float>(k) + 0.5F) / 256.0F);
        EXPECT_NEAR(dot(direction, direction), 1.0F, 1e-5F);
        cosine += double{dot(direction, axis)} / 65536.0;
        sum = sum + direction;
      }
    }
    EXPECT_NEAR(cosine, (double{n} + 1.0) / (double{n} + 2.0), 2e-4) << n;
    EXPECT_NEAR(dot(normalized(sum), axis), 1.0F, 1e-6F);
  }
}

// A mirror at z = -1, seen from the origin along its normal: what it shows about the axis. A white
// ball of angular radius a around the mirror direction fills 1 - cos^(n+1) a of the lobe.
Scene ball_behind_the_eye(const Material& material, double z) {
  Scene scene;
  scene.materials = {material, Material{.emission = {.value = {1.0F, 1.0F, 1.0F}}}};
  scene.objects = {
      {.shape = QuadObject{.corner = {-1, -1, -1}, .edge_u = {2, 0, 0}, .edge_v = {0, 2, 0}}},
      {.shape = SphereObject{.center = {0, 0, z}, .radius = 0.8}, .material = 1}};
  return scene;
}

TEST(Gloss, ALobeSeesTheShareOfItThatABallFills) {
  // 2048 stratified samples of a share near one half: 4 standard errors of random ones are 0.044.
  for (const double n : {10.0, 60.0}) {
    const Scene scene = ball_behind_the_eye({.reflection = 1.0, .reflection_exponent = n}, 3.0);
    const double cosine = std::sqrt(1.0 - std::pow(0.8 / 4.0, 2));
    EXPECT_NEAR(mean_red(scene, {0, 0, -1}, 128), 1.0 - std::pow(cosine, n + 1.0), 0.02) << n;
  }
}

// A glossy mirror shows a wall behind the eye that an area light lights past a ball: which point of
// the wall is seen and which of the light shines on it are chosen together.
TEST(Gloss, AndAreaLightsConvergeTogether) {
  Scene scene;
  scene.materials = {{.model = ShadingModel::phong, .reflection = 1.0, .reflection_exponent = 8.0},
                     {.model = ShadingModel::phong, .diffuse = {.value = {1.0F, 1.0F, 1.0F}}}};
  scene.objects = {
      {.shape = QuadObject{.corner = {-1, -1, -1}, .edge_u = {2, 0, 0}, .edge_v = {0, 2, 0}}},
      {.shape = QuadObject{.corner = {-9, -9, 2}, .edge_u = {18, 0, 0}, .edge_v = {0, 18, 0}},
       .material = 1},
      {.shape = SphereObject{.center = {0, 0.6, 1.2}, .radius = 0.5}, .material = 1}};
  scene.lights = {
      {.kind = AreaLight{.corner = {-1, 1, 0}, .edge_u = {2, 0, 0}, .edge_v = {0, 1, 0}},
       .intensity = {1, 1, 1}}};
  constexpr int kSeeds = 24;
  double sum = 0.0;
  double squares = 0.0;
  for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
    const double red = mean_red(scene, {0, 0, -1}, 256, seed);
    sum += red / kSeeds;
    squares += red * red / kSeeds;
  }
  const double deviation = std::sqrt(squares - sum * sum);
  std::printf("glossy mirror of an area light's shadow: %.4f, deviation %.5f\n", sum, deviation);
  // 4096 independent samples between 0 and 1 deviate by at most 0.5/sqrt(4096) = 0.0078, nets by
  // less; where one choice is a function of the other it stays at 0.03, however many samples.
  EXPECT_LT(deviation, 0.0078);
}

TEST(Gloss, WithoutAnExponentAMirrorIsOne) {
  EXPECT_EQ(mean_red(ball_behind_the_eye({.reflection = 1.0}, 3.0), {0, 0, -1}, 1), 1.0);
}

TEST(Frosting, AThinSheetSpreadsWhatItLetsThrough) {
  const Scene scene =
      ball_behind_the_eye({.transmission = 1.0, .transmission_exponent = 30.0}, -5.0);
  const double cosine = std::sqrt(1.0 - std::pow(0.8 / 4.0, 2));
  EXPECT_NEAR(mean_red(scene, {0, 0, -1}, 128), 1.0 - std::pow(cosine, 31.0), 0.02);
}

// At grazing incidence half of a wide lobe would lie behind the surface: it stays before it, and no
// light is lost.
TEST(Gloss, LobesStayOnTheirSide) {
  Scene scene;
  scene.materials = {Material{.reflection = 1.0, .reflection_exponent = 2.0}, {}};
  scene.objects = {
      {.shape =
           QuadObject{.corner = {-500, -500, -1}, .edge_u = {1000, 0, 0}, .edge_v = {0, 1000, 0}}},
      {.shape =
           QuadObject{.corner = {-500, -500, -2}, .edge_u = {1000, 0, 0}, .edge_v = {0, 1000, 0}},
       .material = 1}};  // black: what passes the mirror
  scene.background = {1.0F, 1.0F, 1.0F};
  EXPECT_NEAR(mean_red(scene, {1.0F, 0.0F, -0.1F}, 16), 1.0, 1e-6);
}

}  // namespace
}  // namespace fstop
