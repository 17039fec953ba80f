// Texture lookups as wide as a share of the blur disc.
#include <algorithm>
#include <cmath>
#include <string_view>

#include <gtest/gtest.h>

#include "core/render/simulation.h"
#include "core/render/texture_detail.h"

namespace fstop {
namespace {

constexpr int kWidth = 192;
constexpr int kHeight = 128;
constexpr double kSensor = 36e-3;
constexpr double kFocal = 0.05;
constexpr double kFocus = 1.0;
constexpr double kFar = 20.0;

// A board with squares of 16 texels and grain, upright at `distance`, a pixel 1.6 texels wide.
Scene board(double distance) {
  constexpr int kSide = 1024;
  TextureSource source{.name = "board", .filter = TextureFilter::mipmap};
  source.image = Image(kSide, kSide, 3);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const float grain = static_cast<float>((x * 7919 + y * 104729) % 64) / 256.0F;
      std::fill_n(source.image.at(x, y), 3, ((x / 16 + y / 16) % 2 == 0 ? 0.7F : 0.05F) + grain);
    }
  }
  const double v = 1.0 / (1.0 / kFocal - 1.0 / kFocus);
  const double side = 1024.0 / 1.6 * (kSensor / kWidth) * distance / v;
  Scene scene;
  scene.textures = {std::move(source)};
  scene.materials = {Material{.emission = {.value = {1, 1, 1}, .texture = 0}}};
  scene.objects = {{.shape = QuadObject{.corner = {-side / 2, -side / 2, -distance},
                                        .edge_u = {side, 0, 0},
                                        .edge_v = {0, side, 0}}}};
  return scene;
}

// Blurs what is at kFar to discs of `coc_px`: c = (f/N) v (1/s - 1/d).
SimulationSpec picture(double coc_px, int samples) {
  const double v = 1.0 / (1.0 / kFocal - 1.0 / kFocus);
  const double f_number = kFocal * v * (1.0 / kFocus - 1.0 / kFar) / (coc_px * kSensor / kWidth);
  SimulationSpec spec;
  spec.camera.optics = LensSpec{.lens = {.focal_length = Length::si(kFocal), .f_number = f_number},
                                .focus_distance = Length::si(kFocus)};
  spec.width = kWidth;
  spec.height = kHeight;
  spec.effects.diffraction = EffectChoice::off;
  spec.quality.method = "lens-sampling";
  spec.quality.samples = samples;
  spec.quality.texture_width_px = 0.125;
  return spec;
}

Photograph made(const SimulationSpec& spec, const RayScene& scene) {
  return simulate(spec, scene, {});
}
double difference(const Photograph& a, const Photograph& b) {
  double sum = 0.0;
  const auto pixels = a.color.pixels();
  for (std::size_t i = 0; i < pixels.size(); ++i)
    sum += std::pow(static_cast<double>(pixels[i]) - static_cast<double>(b.color.pixels()[i]), 2);
  return std::sqrt(sum / static_cast<double>(pixels.size()));
}

double detail_bound(const Photograph& photograph) {
  for (const ModelledEffect& effect : photograph.report.model)
    if (effect.effect == "texture detail") return effect.bound;
  return 0.0;
}

// A checkerboard averaged over many squares is grey: the picture shows nothing of what it has lost.
TEST(TextureDetail, WhatIsBlurredAwayIsTold) {
  Image grey(8, 8, 3);
  for (float& value : grey.pixels()) value = 0.5F;
  EXPECT_EQ(texture_detail_rmse(grey, 16.0, {}), 0.5);
  EXPECT_EQ(texture_detail_rmse(grey, 1.0, {}), 0.0);
}

// On one plane across the axis the disc has one width: in pixels, what the optics say.
TEST(TextureDisc, OnOnePlaneItIsSoManyPixels) {
  const RayScene scene(board(kFar));
  SimulationSpec discs = picture(16.0, 16);
  discs.quality.texture_disc_share = 0.25;
  SimulationSpec pixels = picture(16.0, 16);
  pixels.quality.texture_width_px = 4.0;
  const Photograph by_discs = made(discs, scene);
  // Path lengths go for depths in widths given in pixels: up to 1/cos = 1.09 in the corners, an
  // eighth of a level of the pyramid. A lookup of twice the width differs by ten times as much.
  EXPECT_LT(difference(by_discs, made(pixels, scene)), 0.004);
  pixels.quality.texture_width_px = 8.0;
  EXPECT_GT(difference(by_discs, made(pixels, scene)), 0.01);
}

TEST(TextureDisc, WhatIsInFocusIsReadAsBefore) {
  const RayScene scene(board(kFocus));
  SimulationSpec spec = picture(16.0, 8);
  const Photograph before = made(spec, scene);
  spec.quality.texture_disc_share = 0.5;
  const Photograph after = made(spec, scene);
  EXPECT_TRUE(std::ranges::equal(before.color.pixels(), after.color.pixels()));
}

// The same rays, read sharp and wide: what remains is what wide lookups blur.
TEST(TextureDisc, WhatItBlursIsWithinTheBoundThatIsTold) {
  const RayScene scene(board(kFar));
  for (const double coc_px : {4.0, 8.0, 16.0}) {
    for (const double share : {0.25, 0.5}) {
      SimulationSpec spec = picture(coc_px, 256);
      const Photograph sharp = made(spec, scene);
      spec.quality.texture_disc_share = share;
      const Photograph wide = made(spec, scene);
      const double off = difference(sharp, wide);
      EXPECT_LE(off, detail_bound(wide)) << coc_px << ' ' << share;
      EXPECT_GT(off, 0.0);
      EXPECT_GE(wide.report.error.upper_95, off) << coc_px << ' ' << share;
    }
  }
}

// The bound's search for the widest disc does not grow with the discs; no method but those that
// sample the pupil widens a lookup, or says so.
TEST(TextureDisc, WideDiscsAndMethodsWithoutAPupilAreTold) {
  const RayScene scene(board(kFar));
  SimulationSpec spec = picture(16.0, 4);
  spec.quality.texture_disc_share = 0.5;
  const double usual = detail_bound(made(spec, scene));
  SimulationSpec wide = picture(3000.0, 4);
  wide.quality.texture_disc_share = 0.5;
  EXPECT_GT(detail_bound(made(wide, scene)), 0.0);
  spec.quality.method = "pinhole";
  spec.effects.defocus = EffectChoice::off;
  const Photograph sharp = made(spec, scene);
  EXPECT_LT(detail_bound(sharp), usual);
  spec.quality.texture_disc_share = 0.0;
  EXPECT_EQ(detail_bound(sharp), detail_bound(made(spec, scene)));
}

// Every pixel within a disc's reach counts by it, and no other by more than twice that reach.
TEST(TextureDisc, TheWidestDiscThatReachesAPixelCounts) {
  constexpr int kSide = 512;
  Image flat(kSide, kSide, 1);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) *flat.at(x, y) = ((x + y) & 1) != 0 ? 0.6F : 0.4F;
  Image coc(kSide, kSide, 1);
  *coc.at(100, 200) = -80.0F;  // reaches 40 px
  // A checkerboard's Laplacian is 0.8: with a share of 1/80 a lookup of 1 px is off by 0.1.
  const double all = texture_detail_rmse(flat, 0.0, 1.0 / 80.0, coc);
  const double counted = std::pow(all / 0.1, 2) * (kSide - 2.0) * (kSide - 2.0);
  EXPECT_GE(counted, 80.0 * 80.0);
  // The power of two above 1 + 40/8 cells, to both sides of a cell.
  EXPECT_NEAR(counted, std::pow((2 * 8 + 1) * 8, 2), 1.0);
}

// Lookups a quarter of a disc wide hold less noise: 64 samples of a disc of 16 px are as good as
// twice as many sharp ones.
TEST(TextureDisc, ADefocusedTextureNeedsFewerSamples) {
  const RayScene scene(board(kFar));
  const Photograph truth = made(picture(16.0, 4096), scene);
  SimulationSpec spec = picture(16.0, 64);
  spec.seed = 1;  // none of the truth's rays
  spec.quality.texture_disc_share = 0.25;
  const double wide = difference(made(spec, scene), truth);
  spec.quality.texture_disc_share = 0.0;
  spec.quality.samples = 128;
  EXPECT_LT(wide, difference(made(spec, scene), truth));
}

}  // namespace
}  // namespace fstop
