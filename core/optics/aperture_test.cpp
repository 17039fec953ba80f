#include "core/optics/aperture.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

// Sums of a dozen rounded terms of size 1.
constexpr double kTolerance = 5e-15;

struct Moments {
  double area = 0.0;
  double mean_square_radius = 0.0;
};

// Area and polar second moment of any polygon from its corners alone (Green's theorem).
Moments moments_of(const std::vector<Vec2>& corners) {
  double area = 0.0;
  double polar = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec2 a = corners[i];
    const Vec2 b = corners[(i + 1) % corners.size()];
    const double twice = a.x * b.y - b.x * a.y;
    area += twice / 2.0;
    polar += twice * (a.x * a.x + a.x * b.x + b.x * b.x + a.y * a.y + a.y * b.y + b.y * b.y) / 12.0;
  }
  return {.area = area, .mean_square_radius = polar / area};
}

TEST(Aperture, PolygonHasTheAreaOfTheUnitDisc) {
  for (int blades = 3; blades <= 20; ++blades) {
    for (const double rotation : {0.0, 0.3, -2.0}) {
      const Moments moments = moments_of(aperture_vertices({blades, rotation}));
      EXPECT_NEAR(moments.area, std::numbers::pi, kTolerance) << blades;  // > 0: from +x to +y
    }
  }
}

TEST(Aperture, MeanSquareRadiusIsThePolygonsSecondMoment) {
  for (int blades = 3; blades <= 20; ++blades) {
    const Aperture aperture{.blades = blades, .rotation = 0.7};
    EXPECT_NEAR(aperture_mean_square_radius(aperture),
                moments_of(aperture_vertices(aperture)).mean_square_radius, kTolerance)
        << blades;
  }
}

// A square of area pi has the side sqrt(pi) and the mean square radius side^2/6.
TEST(Aperture, SquareByHand) {
  EXPECT_NEAR(aperture_circumradius({4, 0.0}), std::sqrt(std::numbers::pi / 2), kTolerance);
  EXPECT_NEAR(aperture_mean_square_radius({4, 0.0}), std::numbers::pi / 6, kTolerance);
}

TEST(Aperture, VerticesLieOnTheCircumcircleInOrder) {
  for (const int blades : {3, 5, 6, 8}) {
    const Aperture aperture{.blades = blades, .rotation = 0.25};
    const auto vertices = aperture_vertices(aperture);
    ASSERT_EQ(vertices.size(), static_cast<std::size_t>(blades));
    for (int i = 0; i < blades; ++i) {
      const Vec2 v = vertices[static_cast<std::size_t>(i)];
      const double angle = 0.25 + 2.0 * std::numbers::pi * i / blades;
      const double radius = aperture_circumradius(aperture);
      EXPECT_NEAR(v.x, radius * std::cos(angle), kTolerance);
      EXPECT_NEAR(v.y, radius * std::sin(angle), kTolerance);
    }
  }
}

TEST(Aperture, FirstVertexTurnsFromXTowardsY) {
  const Vec2 unturned = aperture_vertices({6, 0.0}).front();
  EXPECT_GT(unturned.x, 1.0);
  EXPECT_EQ(unturned.y, 0.0);
  const Vec2 quarter_turn = aperture_vertices({6, std::numbers::pi / 2}).front();
  EXPECT_NEAR(quarter_turn.x, 0.0, kTolerance);
  EXPECT_GT(quarter_turn.y, 1.0);
}

TEST(Aperture, DiscHasNoVertices) {
  EXPECT_TRUE(aperture_vertices({0, 0.0}).empty());
  EXPECT_EQ(aperture_circumradius({0, 0.0}), 1.0);
  EXPECT_EQ(aperture_mean_square_radius({0, 0.0}), 0.5);
}

// R^2 (2 + cos x)/6 with R^2 = x/sin x and x = 2 pi/n is 1/2 + x^4/360 + ...
TEST(Aperture, ManyBladesApproachTheDisc) {
  for (const int blades : {100, 1000}) {
    const double x = 2.0 * std::numbers::pi / blades;
    EXPECT_NEAR(aperture_mean_square_radius({blades, 0.0}), 0.5 + std::pow(x, 4) / 360,
                std::pow(x, 6) + kTolerance);
    EXPECT_NEAR(aperture_circumradius({blades, 0.0}), 1.0 + x * x / 12, std::pow(x, 4));
  }
}

TEST(Aperture, RefusesOneTwoAndNegativeBlades) {
  for (const int blades : {1, 2, -1, -6}) {
    const Aperture aperture{.blades = blades};
    EXPECT_THROW(aperture_circumradius(aperture), Error) << blades;
    EXPECT_THROW(aperture_mean_square_radius(aperture), Error) << blades;
    EXPECT_THROW(aperture_vertices(aperture), Error) << blades;
  }
}

}  // namespace
}  // namespace fstop
