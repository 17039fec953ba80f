#include "core/render/gather_blur.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace fstop {
namespace {

// A black picture of one depth, `side` pixels a side after blurring.
SharpPicture dark(int side, double blur_px, const Aperture& aperture) {
  const int margin = gather_margin(aperture, std::abs(blur_px));
  const int wide = side + 2 * margin;
  SharpPicture sharp{.color = Image(wide, wide, 3), .coc = Image(wide, wide, 1), .margin = margin};
  std::ranges::fill(sharp.coc.pixels(), static_cast<float>(blur_px));
  return sharp;
}

// One white pixel in the middle, blurred.
Image point(int side, double blur_px, const Aperture& aperture) {
  SharpPicture sharp = dark(side, blur_px, aperture);
  const int middle = sharp.color.width() / 2;
  for (int c = 0; c < 3; ++c) sharp.color.at(middle, middle)[c] = 1.0F;
  return gathered(sharp, aperture, {});
}

struct Moments {
  double energy = 0.0;
  double square_x = 0.0;  // mean of x^2, from the middle pixel
  double cube_x = 0.0;
  double cube_y = 0.0;
};

Moments moments_of(const Image& image) {
  Moments m;
  const int middle = image.width() / 2;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const auto value = static_cast<double>(image.at(x, y)[1]);
      m.energy += value;
      m.square_x += value * std::pow(x - middle, 2);
      m.cube_x += value * std::pow(x - middle, 3);
      m.cube_y += value * std::pow(y - middle, 3);
    }
  }
  m.square_x /= m.energy;
  return m;
}

TEST(GatherBlur, APointBecomesADiscOfItsEnergyAndSecondMoment) {
  for (const double radius : {0.0, 0.3, 0.7, 1.0, 1.5, 2.0, 3.0, 5.5, 8.0, 14.0}) {
    const Moments m = moments_of(point(41, 2.0 * radius, {}));
    // Every pixel divides by the same sum; 1,700 values rounded to 2^-24 each.
    EXPECT_NEAR(m.energy, 1.0, 1e-4) << radius;
    // A disc has r^2/4. Up to 1 px it is built in; a soft disc on a lattice is off by some per cent
    // of it near 1 px (measured on the disc's area: Gauss's circle problem), less where larger.
    EXPECT_NEAR(m.square_x, radius * radius / 4.0, 1e-5 + (radius >= 1.0 ? 0.06 * radius : 0.0))
        << radius;
  }
}

TEST(GatherBlur, TapsStandForAllPixelsOfADisc) {
  for (const int blades : {0, 3, 6}) {
    for (const double radius : {10.0, 40.0, 127.0}) {
      double area = 0.0;
      const std::vector<GatherTap> taps = gather_taps({.blades = blades}, radius);
      for (const GatherTap& tap : taps) area += tap.far < radius ? tap.area : 0.0;
      // Cells on the outline are in or out as a whole: 2 pi r/(r/8) = 50 of them, (r/16)^2..(r/8)^2
      // large, their errors of either sign: sqrt(50)/2 cells, 5.5 % r^2; three deviations of 16.6 %
      // r^2 are 5 % of the area.
      EXPECT_NEAR(area / (std::numbers::pi * radius * radius), 1.0, 0.05)
          << blades << " blades, " << radius;
      // Work is bounded: 804 pixels within 16, then at most 800 cells each time the radius doubles.
      EXPECT_LT(taps.size(), 804U * (blades == 0 ? 4U : 8U));
    }
  }
}

// A triangle's third moment has a sign: its corner points to +x as in the pupil from behind the
// focused plane, to -x from before it.
TEST(GatherBlur, DiscsLieLikeThePupilBehindFocusAndTurnedBeforeIt) {
  const Aperture triangle{.blades = 3};
  EXPECT_GT(moments_of(point(61, 16.0, triangle)).cube_x, 10.0);
  EXPECT_LT(moments_of(point(61, -16.0, triangle)).cube_x, -10.0);
  const Aperture down{.blades = 3, .rotation = 0.5 * std::numbers::pi};
  EXPECT_GT(moments_of(point(61, 16.0, down)).cube_y, 10.0);
  EXPECT_LT(moments_of(point(61, -16.0, down)).cube_y, -10.0);
}

TEST(GatherBlur, BlurredBackgroundsDoNotRunOverASharpForeground) {
  SharpPicture sharp = dark(40, 12.0, {});  // behind, blurred
  const int wide = sharp.color.width();
  for (int y = 0; y < wide; ++y) {
    for (int x = 0; x < wide; ++x) {
      const bool front = x < wide / 2;
      if (front) *sharp.coc.at(x, y) = 0.0F;
      for (int c = 0; c < 3; ++c) sharp.color.at(x, y)[c] = front ? 0.25F : 1.0F;
    }
  }
  const Image image = gathered(sharp, {}, {});
  for (int x = 0; x < 40; ++x) {
    // And none of the sharp foreground runs over the background.
    EXPECT_FLOAT_EQ(image.at(x, 20)[0], x < 20 ? 0.25F : 1.0F) << x;
  }
}

TEST(GatherBlur, BlurredForegroundsRunOverWhatIsSharp) {
  constexpr int margin = 8;
  SharpPicture sharp{.color = Image(40 + 2 * margin, 40 + 2 * margin, 3),
                     .coc = Image(40 + 2 * margin, 40 + 2 * margin, 1),
                     .margin = margin};
  for (int y = 0; y < sharp.color.height(); ++y) {
    for (int x = 0; x < 20 + margin; ++x) {
      *sharp.coc.at(x, y) = -12.0F;  // before focus
      for (int c = 0; c < 3; ++c) sharp.color.at(x, y)[c] = 1.0F;
    }
  }
  const Image image = gathered(sharp, {}, {});
  EXPECT_GT(image.at(21, 20)[0], 0.2F);
  EXPECT_GT(image.at(24, 20)[0], 0.01F);
  EXPECT_EQ(image.at(28, 20)[0], 0.0F);  // 8 px from the edge: beyond 6 px and the soft edge
}

}  // namespace
}  // namespace fstop
