#include "core/measure/disc_edge.h"

#include <cmath>
#include <cstdio>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/references/blurred_edge.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

DiscEdge fitted(const Image& image) {
  return fit_disc_radius(image.view(), {.region = {0, 0, image.width(), image.height()}});
}

// Tolerance: the fixture's own, 1e-12 on values of 15 digits; the box form divides differences of
// second integrals of up to (1/R)^2 by 1/R.
TEST(DiscEdge, ClosedFormsAgreeWithTheFixture) {
  const nlohmann::json fixture = oracle::fixture("disc_blur");
  ASSERT_GE(fixture.at("rows").size(), 6U);
  for (const auto& row : fixture.at("rows")) {
    const double radius = row.at("R_px").get<double>();
    for (const auto& point : row.at("edge")) {
      const double x = point.at("x").get<double>();
      EXPECT_NEAR(disc_edge(x / radius), point.at("esf").get<double>(), 1e-12);
      EXPECT_NEAR(disc_pixel_edge(x, radius, 0.0), point.at("esf_box").get<double>(), 1e-11);
    }
  }
}

// Against a quadrature over the pixel's square. Tolerance: 48 x 4 nodes miss the 3/2 powers at the
// disc's rim by up to 2e-6 where the disc is as small as a panel.
TEST(DiscEdge, PixelMeanIsTheQuadraturesAtAnySlant) {
  for (const double radius : {0.05, 0.25, 0.5, 1.0, 4.0, 20.0}) {
    for (const double degrees : {0.0, 1e-3, 0.1, 2.0, 5.0, 20.0, 44.9, 45.0}) {
      const double angle = degrees * kDegree;
      for (double x = -radius - 0.9; x < radius + 0.9; x += 0.11) {
        const double expected = oracle::pixel_mean(oracle::disc_profile(radius), x, angle);
        EXPECT_NEAR(disc_pixel_edge(x, radius, angle), expected, radius < 0.2 ? 3e-4 : 2e-5)
            << radius << " px at " << degrees << " degrees, " << x;
      }
    }
  }
}

// Without noise the radius is limited by float pixels and the quadrature that made them.
TEST(DiscEdge, RadiusIsFoundAtAnySlant) {
  for (const double degrees : {2.0, 5.0, 15.0, 26.565, 40.0, 95.0, 200.0, 310.0}) {
    for (const double radius : {0.25, 0.5, 1.0, 3.0, 8.0, 20.0}) {
      const oracle::EdgePicture picture{.angle = degrees * kDegree};
      const DiscEdge edge = fitted(oracle::edge_picture(picture, oracle::disc_profile(radius)));
      EXPECT_NEAR(edge.radius, radius, 1e-3) << degrees << " degrees";
      EXPECT_NEAR(edge.levels.dark, 0.1, 1e-4);
      EXPECT_NEAR(edge.levels.bright, 0.8, 1e-4);
      const Vec2 off = edge.point - picture.through;
      EXPECT_NEAR(off.x * edge.normal.x + off.y * edge.normal.y, 0.0, 1e-3);
      EXPECT_LT(edge.residual, 1e-4);
    }
  }
}

// The published bound of this measurement: 0.03 px root mean square for radii of 0.5 to 20 px
// through noise of up to 2 %. Bright to the left as well as to the right.
TEST(DiscEdge, RadiusKeepsItsBoundThroughNoise) {
  for (const double radius : {0.5, 1.0, 2.0, 4.0, 8.0, 14.0, 20.0}) {
    double squares = 0.0;
    constexpr int kPictures = 12;
    for (unsigned seed = 1; seed <= kPictures; ++seed) {
      const double angle = (3.0 + 27.5 * seed) * kDegree;
      const double error =
          fitted(oracle::edge_picture({.angle = angle, .noise = 0.02, .seed = seed},
                                      oracle::disc_profile(radius)))
              .radius -
          radius;
      squares += error * error / kPictures;
    }
    std::printf("radius by fit, 2 %% noise, R %.2f px: rms error %.4f px\n", radius,
                std::sqrt(squares));
    EXPECT_LT(std::sqrt(squares), 0.03) << radius << " px";
  }
}

// What is not a disc says so: a linear ramp of the same rise leaves a residual that noise-free
// discs do not.
TEST(DiscEdge, ResidualTellsOtherBlursFromDiscs) {
  const Image ramp = oracle::edge_picture(
      {.angle = 5.0 * kDegree}, [](double x) { return std::clamp(0.5 + x / 10.0, 0.0, 1.0); });
  EXPECT_GT(fitted(ramp).residual, 1e-3);
}

TEST(DiscEdge, RefusesWhereThereIsNoEdge) {
  const Image flat(64, 64, 1);
  EXPECT_THROW(fitted(flat), Error);
}

}  // namespace
}  // namespace fstop
