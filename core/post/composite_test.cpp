#include "core/post/composite.h"

#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

// Values that single precision adds and multiplies without rounding: alpha a multiple of 1/8,
// colours of 1/64, so that products of three alphas and a colour need 9 + 6 bits.
Image exact_layer(std::uint32_t seed) {
  std::mt19937 random(seed);
  Image layer(16, 8, 4);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 16; ++x) {
      float* pixel = layer.at(x, y);
      pixel[3] = static_cast<float>(random() % 9U) / 8.0F;
      for (int c = 0; c < 3; ++c) pixel[c] = static_cast<float>(random() % 65U) / 64.0F;
    }
  }
  return layer;
}

TEST(Composite, OverIsAssociativeAndTheEmptyLayerIsItsIdentity) {
  const Image a = exact_layer(1), b = exact_layer(2), c = exact_layer(3);
  EXPECT_EQ(over(over(a, b), c), over(a, over(b, c)));
  EXPECT_FALSE(over(a, b) == over(b, a));
  const Image empty(16, 8, 4);
  EXPECT_EQ(over(a, empty), a);
  EXPECT_EQ(over(empty, a), a);
}

// The table of Porter & Duff: c = cA + (1 - alphaA) cB, and so for alpha.
TEST(Composite, OverAddsWhatTheFrontLetsThrough) {
  Image front(1, 1, 4), back(1, 1, 4);
  front.pixels() = {0.25F, 0.5F, 0.0F, 0.5F};
  back.pixels() = {1.0F, 0.0F, 0.5F, 0.5F};
  EXPECT_EQ(over(front, back).pixels(), (std::vector<float>{0.75F, 0.5F, 0.25F, 0.75F}));
}

TEST(Composite, AnOpaqueFrontHidesAll) {
  const Image a = color_of(exact_layer(1));
  EXPECT_EQ(color_of(over(opaque_layer(a), exact_layer(2))), a);
}

TEST(Composite, StraightColourIsMultipliedByItsAlphaOnce) {
  Image color(2, 1, 3), alpha(2, 1, 1);
  color.pixels() = {0.5F, 1.0F, 2.0F, 0.5F, 1.0F, 2.0F};
  alpha.pixels() = {0.25F, 1.5F};  // clipped to 1
  EXPECT_EQ(layer_of(color, alpha, false).pixels(),
            (std::vector<float>{0.125F, 0.25F, 0.5F, 0.25F, 0.5F, 1.0F, 2.0F, 1.0F}));
  EXPECT_EQ(layer_of(color, alpha, true).pixels(),
            (std::vector<float>{0.5F, 1.0F, 2.0F, 0.25F, 0.5F, 1.0F, 2.0F, 1.0F}));
  EXPECT_EQ(alpha_of(layer_of(color, alpha, true)).pixels(), (std::vector<float>{0.25F, 1.0F}));
}

TEST(Composite, OverlayTakesWhatIsNotZero) {
  Image top(4, 1, 4), bottom(4, 1, 4);
  top.pixels() = {0, 0, 0, 1, 0, 0.125F, 0, 0, 1, 1, 1, 0.5F, 0, 0, 0.25F, 1};
  for (float& value : bottom.pixels()) value = 0.75F;
  EXPECT_EQ(overlay_where_not_zero(top, bottom).pixels(),
            (std::vector<float>{0.75F, 0.75F, 0.75F, 0.75F, 0, 0.125F, 0, 0, 1, 1, 1, 0.5F, 0, 0,
                                0.25F, 1}));
  const Image a = exact_layer(4);
  EXPECT_EQ(overlay_where_not_zero(Image(16, 8, 4), a), a);
}

// A subject F in front of a backing K with a soft edge, alpha F + (1 - alpha) K, all in multiples
// of 1/64: keyed out and set before another picture B it is alpha F + (1 - alpha) B. The chroma's
// coefficients are no such numbers: alpha is right to double rounding, then to one of single.
TEST(Composite, KeyOfASyntheticPlateGivesTheSubjectBack) {
  constexpr std::array<float, 3> kBacking = {0.0F, 0.75F, 0.125F};
  constexpr std::array<float, 3> kSubject = {0.5F, 0.25F, 0.375F};
  constexpr std::array<float, 3> kOther = {0.25F, 0.5F, 1.0F};
  Image plate(65, 1, 3), behind(65, 1, 3);
  const auto mixed = [](float share, const auto& a, const auto& b, std::size_t c) {
    return share * a[c] + (1.0F - share) * b[c];
  };
  for (int x = 0; x < 65; ++x) {
    const float share = static_cast<float>(x) / 64.0F;
    for (std::size_t c = 0; c < 3; ++c) {
      plate.at(x, 0)[c] = mixed(share, kSubject, kBacking, c);
      behind.at(x, 0)[c] = kOther[c];
    }
  }
  // |chroma F - chroma K| by hand: differences (0.5, -0.5, 0.25), luma 0.2126/2 - 0.7152/2 +
  // 0.0722/4 = -0.23325; Cb = 0.48325/1.8556 = 0.260428, Cr = 0.73325/1.5748 = 0.465615.
  EXPECT_NEAR(chroma_distance(kSubject.data(), kBacking.data()), 0.533497, 1e-6);
  const ChromaKey key{.color = kBacking,
                      .tolerance = 0.0,
                      .softness = chroma_distance(kSubject.data(), kBacking.data())};
  const Image layer = keyed(plate, key);
  const Image result = over(layer, opaque_layer(behind));
  for (int x = 0; x < 65; ++x) {
    const float share = static_cast<float>(x) / 64.0F;
    EXPECT_NEAR(layer.at(x, 0)[3], share, 1e-7F);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(result.at(x, 0)[c], mixed(share, kSubject, kOther, c), 3e-7F) << x;
    }
  }
}

TEST(Composite, KeyHasToleranceAndAHardOrSoftEdge) {
  Image plate(3, 1, 3);
  plate.pixels() = {0, 1, 0, 0.05F, 0.9F, 0.05F, 0.5F, 0.5F, 0.5F};
  const Image hard = keyed(plate, {.tolerance = 0.2, .softness = 0.0});
  EXPECT_EQ(alpha_of(hard).pixels(), (std::vector<float>{0, 0, 1}));
  EXPECT_EQ(color_of(hard).at(2, 0)[1], 0.5F);
  const Image soft = keyed(plate, {.tolerance = 0.0, .softness = 1.0});
  EXPECT_GT(soft.at(1, 0)[3], 0.0F);
  EXPECT_LT(soft.at(1, 0)[3], soft.at(2, 0)[3]);
}

TEST(Composite, ABackingInShadowIsBacking) {
  Image plate(1, 1, 3);
  plate.pixels() = {0.0F, 0.8F, 0.0F};
  // The chroma of 0.8 of pure green differs from green's by a fifth of green's own,
  // 0.2 * hypot(0.7152/1.8556, 0.7152/1.5748) = 0.119.
  EXPECT_EQ(keyed(plate, {.tolerance = 0.12, .softness = 0.1}).at(0, 0)[3], 0.0F);
  EXPECT_GT(keyed(plate, {.tolerance = 0.118, .softness = 0.1}).at(0, 0)[3], 0.0F);
}

TEST(Composite, LayersOfDifferentSizesAreRefused) {
  EXPECT_THROW(over(Image(2, 2, 4), Image(2, 3, 4)), Error);
  EXPECT_THROW(over(Image(2, 2, 3), Image(2, 2, 3)), Error);
  EXPECT_THROW(layer_of(Image(2, 2, 3), Image(2, 1, 1), true), Error);
  EXPECT_THROW(keyed(Image(2, 2, 4), {}), Error);
}

}  // namespace
}  // namespace fstop
