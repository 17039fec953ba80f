// Textures that are fixed to the picture, through whole renders.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/render/simulation.h"
#include "core/sampling/sequence.h"

namespace fstop {
namespace {

constexpr int kWidth = 96;
constexpr int kHeight = 64;

// One texel a pixel, values 0.2 to 1: with the nearest texel every sample of a pixel reads the
// pixel's own.
TextureSource noise() {
  TextureSource source{.name = "noise", .filter = TextureFilter::nearest};
  source.image = Image(kWidth, kHeight, 3);
  std::uint32_t number = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 3; ++c) {
        const double share = hash_of(number++, 7U) / 4294967296.0;
        source.image.at(x, y)[c] = static_cast<float>(0.2 + 0.8 * share);
      }
    }
  }
  return source;
}

// `object` shows the noise on the screen, or is white.
Scene scene_of(Object object, bool on_screen, float radiance = 1.0F) {
  Scene scene;
  scene.textures = {noise()};
  scene.materials = {Material{.emission = {.value = {radiance, radiance, radiance},
                                           .texture = on_screen ? 0 : -1}},
                     Material{.reflection = 1.0}};
  if (on_screen) object.mapping = ScreenMapping{};
  scene.objects = {std::move(object)};
  return scene;
}

Object ball(double distance, double radius) {
  return {.shape = SphereObject{.center = {0.05, 0.02, -distance}, .radius = radius}};
}
Object wall(double z) {
  return {.shape = QuadObject{.corner = {-9, -9, z}, .edge_u = {18, 0, 0}, .edge_v = {0, 18, 0}}};
}

SimulationSpec shot(const std::string& method) {
  SimulationSpec spec;
  spec.camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 1.4}, .focus_distance = 2.0_m};
  spec.width = kWidth;
  spec.height = kHeight;
  spec.quality.method = method;
  if (method == "pinhole") spec.effects.defocus = EffectChoice::off;
  return spec;
}

Photograph photograph(const SimulationSpec& spec, const Scene& scene) {
  WorkerPool workers(2);
  RunControl run;
  run.workers = &workers;
  return simulate(spec, RayScene(scene), run);
}

template <typename Visit>
void for_each_value(const Visit& visit) {
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 3; ++c) visit(x, y, c);
    }
  }
}

// Means of equal numbers in single precision: a few roundings.
void expect_the_texture(const Image& picture) {
  const Image texture = noise().image;
  for_each_value([&](int x, int y, int c) {
    ASSERT_NEAR(picture.at(x, y)[c], texture.at(x, y)[c], 1e-5F) << x << " " << y;
  });
}

TEST(ScreenMapping, AWallThatFillsThePictureIsTheTextureHoweverBlurred) {
  for (const double distance : {0.5, 2.0, 8.0}) {
    for (const char* method : {"pinhole", "lens-sampling", "auto"}) {
      SCOPED_TRACE(std::string(method) + " at " + std::to_string(distance) + " m");
      expect_the_texture(photograph(shot(method), scene_of(wall(-distance), true)).color);
    }
  }
}

// The cookie cutter: the share of each pixel that the object covers, as its white twin shows it,
// times the texture there. Sharp and blurred, by the same samples.
TEST(ScreenMapping, TheObjectCutsOutItsShape) {
  const Image texture = noise().image;
  for (const double distance : {0.8, 2.0}) {
    SimulationSpec spec = shot("lens-sampling");
    spec.quality.samples = 64;
    const Image cut = photograph(spec, scene_of(ball(distance, 0.12 * distance), true)).color;
    const Image white = photograph(spec, scene_of(ball(distance, 0.12 * distance), false)).color;
    int inside = 0;
    int partly = 0;
    for_each_value([&](int x, int y, int c) {
      const float share = white.at(x, y)[c];
      ASSERT_NEAR(cut.at(x, y)[c], share * texture.at(x, y)[c], 1e-5F) << x << " " << y;
      inside += share > 0.9999F ? 1 : 0;
      partly += share > 0.01F && share < 0.99F ? 1 : 0;
    });
    EXPECT_GT(inside, 300);
    EXPECT_GT(partly, 30);
  }
}

TEST(ScreenMapping, AMirrorShowsItInPlaceAndUnmirrored) {
  Scene scene = scene_of(wall(3.0), true);
  scene.objects.push_back(wall(-1.5));
  scene.objects[1].material = 1;
  expect_the_texture(photograph(shot("lens-sampling"), scene).color);
}

// Splats carry the film's colour of the place where they land: the ratio of a pixel's channels is
// its texel's, whatever light it gets.
TEST(ScreenMapping, SplattedLightHasTheColourOfWhereItLands) {
  const Image texture = noise().image;
  SimulationSpec spec = shot("bokeh-splatting");
  spec.quality.max_error = 0.05;
  const Photograph result = photograph(spec, scene_of(ball(0.4, 0.0005), true, 500.0F));
  EXPECT_EQ(result.report.method, "bokeh-splatting");
  int lit = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const float* p = result.color.at(x, y);
      const float* t = texture.at(x, y);
      if (!(p[0] > 1e-3F)) continue;
      ++lit;
      EXPECT_NEAR(p[1] / p[0], t[1] / t[0], 1e-3F * t[1] / t[0]) << x << " " << y;
      EXPECT_NEAR(p[2] / p[0], t[2] / t[0], 1e-3F * t[2] / t[0]) << x << " " << y;
    }
  }
  EXPECT_GT(lit, 50);
}

TEST(ScreenMapping, MethodsThatBlurPicturesRefuseIt) {
  const Scene scene = scene_of(wall(-1.0), true);
  for (const char* method : {"wave", "gather"}) {
    try {
      photograph(shot(method), scene);
      FAIL() << method;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::no_valid_method);
      EXPECT_NE(std::string(error.what()).find("fixed to the picture"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace fstop
