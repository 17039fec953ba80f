#include "core/optics/polygon_psf.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/defocus_field.h"
#include "core/optics/quadrature.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;

// The fixture's own statement: 1e-12 absolute.
TEST(PolygonPupil, AgreesWithEveryRowOfTheFixture) {
  const nlohmann::json table = oracle::fixture("polygon_pupil");
  ASSERT_FALSE(table.at("rows").empty());
  for (const nlohmann::json& row : table.at("rows")) {
    const PolygonPupil pupil(row.at("blades"), row.at("rotation_rad"), 1.0);
    EXPECT_NEAR(pupil.area(), oracle::number(row.at("area")), 1e-13);
    for (const nlohmann::json& point : row.at("points")) {
      const Vec2 q{point.at("qx"), point.at("qy")};
      const double expected = oracle::number(point.at("intensity"));
      EXPECT_NEAR(pupil.intensity(q), expected, 1e-12) << point.dump();
      // The edges' quadrature answers for a defocus that is none.
      EXPECT_NEAR(pupil.intensity(q, 1e-14), expected, 1e-12) << point.dump();
      EXPECT_EQ(point.size(), 3U);
    }
    EXPECT_EQ(row.size(), 4U);
  }
}

// The defining integral over the fan of triangles about the centre: corner c_i, c_(i+1).
std::complex<double> fan_integral(int blades, double rotation, double R, Vec2 q, double U) {
  const QuadratureRule rule =
      gauss_legendre(60 + static_cast<int>(std::abs(U) + std::hypot(q.x, q.y)));
  std::complex<double> sum = 0.0;
  double area = 0.0;
  for (int i = 0; i < blades; ++i) {
    const double first = rotation + 2.0 * kPi * i / blades;
    const double second = rotation + 2.0 * kPi * (i + 1) / blades;
    const Vec2 a{R * std::cos(first), R * std::sin(first)};
    const Vec2 b{R * std::cos(second), R * std::sin(second)};
    const double twice = a.x * b.y - a.y * b.x;
    area += 0.5 * twice;
    for (std::size_t j = 0; j < rule.nodes.size(); ++j) {
      const double t = 0.5 * (1.0 + rule.nodes[j]);  // from the centre to the edge
      for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
        const double s = 0.5 * (1.0 + rule.nodes[k]);  // along the edge
        const Vec2 p = (a * (1.0 - s) + b * s) * t;
        const double phase = 0.5 * U * (p.x * p.x + p.y * p.y) - q.x * p.x - q.y * p.y;
        sum += 0.25 * rule.weights[j] * rule.weights[k] * t * twice * std::polar(1.0, phase);
      }
    }
  }
  return sum / area;
}

TEST(PolygonPupil, IsTheIntegralOverThePolygon) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const int blades : {3, 4, 5, 6, 8}) {
    for (const double U : {0.0, 1e-6, 0.4, -7.0, 63.0}) {
      const double R = 1.1;
      const PolygonPupil pupil(blades, 0.4, R);
      const double reach = 1.5 * std::abs(U) + 6.0;
      for (int i = 0; i < 6; ++i) {
        const Vec2 q{reach * uniform(random), reach * uniform(random)};
        const std::complex<double> truth = fan_integral(blades, 0.4, R, q, U);
        EXPECT_LE(std::abs(pupil.field(q, U) - truth), 2e-14 * (10.0 + std::abs(U)))
            << blades << " blades, U " << U << ", q " << q.x << " " << q.y;
      }
    }
  }
}

// Where the stationary point lies on a corner, on an edge, at the centre, and on the circle of two
// circumradii where the phase of reference changes.
TEST(PolygonPupil, IsSmoothWhereDenominatorsVanish) {
  const double U = 20.0;
  const PolygonPupil pupil(6, 0.0, 1.0);
  const double apothem = std::cos(kPi / 6.0);
  for (const Vec2 rest : {Vec2{}, Vec2{1.0, 0.0}, Vec2{apothem * apothem, 0.5 * apothem},
                          Vec2{2.0, 0.0}, Vec2{0.0, 2.0}, Vec2{1.3, 1.5198684153570664}}) {
    for (const double scale : {1.0 - 1e-9, 1.0, 1.0 + 1e-9}) {
      const Vec2 q = rest * (U * scale);
      EXPECT_LE(std::abs(pupil.field(q, U) - fan_integral(6, 0.0, 1.0, q, U)), 1e-13)
          << rest.x << " " << rest.y << " times " << scale;
    }
  }
}

TEST(PolygonPupil, KeepsEveryDigitForSmallQ) {
  const PolygonPupil pupil(5, 0.2, 1.0);
  // 1 - q^2 m/4 + O(q^4), m the mean square radius (2 + cos(2 pi/n))/6.
  const double mean_square = (2.0 + std::cos(2.0 * kPi / 5.0)) / 6.0;
  for (const double q : {0.0, 1e-300, 1e-120, 1e-99, 1e-30, 1e-12, 1e-8, 1e-5, 1e-4}) {
    for (const double U : {0.0, 1e-200, 1e-50}) {
      const std::complex<double> value = pupil.field({0.6 * q, 0.8 * q}, U);
      EXPECT_NEAR(value.real(), 1.0 - 0.25 * q * q * mean_square, 1e-14) << q << " " << U;
      EXPECT_NEAR(value.imag(), 0.0, 1e-14) << q << " " << U;
    }
  }
}

// A square's field is a product of two slits; rotated by a quarter of pi its sides lie on the axes.
TEST(PolygonPupil, SquareIsTheProductOfTwoSlits) {
  const PolygonPupil pupil(4, kPi / 4.0, std::numbers::sqrt2);  // [-1, 1]^2
  const auto slit = [](double q, double U) {
    const int panels = 4 + static_cast<int>(std::abs(U) + std::abs(q));
    std::complex<double> sum = 0.0;
    for (int i = 0; i < panels; ++i) {
      sum += gauss16(-1.0 + 2.0 * i / panels, -1.0 + 2.0 * (i + 1) / panels,
                     [&](double x) { return std::polar(0.5, 0.5 * U * x * x - q * x); });
    }
    return sum;
  };
  for (const double U : {0.0, 3.0, 209.0, -1000.0}) {
    for (const Vec2 q : {Vec2{0.0, 0.0}, Vec2{1.0, 0.0}, Vec2{30.0, -170.0}, Vec2{900.0, 1100.0}}) {
      EXPECT_LE(std::abs(pupil.field(q, U) - slit(q.x, U) * slit(q.y, U)), 1e-13)
          << U << " " << q.x;
    }
  }
}

// Many blades of the disc's area approach the disc as 1/n^2: doubling n quarters the difference.
TEST(PolygonPupil, TendsToTheDisc) {
  for (const double U : {0.0, 6.28, 100.0}) {
    for (const double v : {0.0, 2.0, 0.9 * U, 1.2 * U + 5.0}) {
      const std::complex<double> disc = 2.0 * defocus_field(v, U);
      const auto difference = [&](int blades) {
        return std::abs(PolygonPupil({.blades = blades, .rotation = 0.1}).field({v, 0.0}, U) -
                        disc);
      };
      EXPECT_LE(difference(256), 1e-3);
      EXPECT_LE(difference(512), difference(256) / 3.5 + 1e-12) << "U " << U << ", v " << v;
    }
  }
}

// Parseval over the plane of q: inside the radius Q the share 1 - O(1/Q) is found.
TEST(PolygonPupil, EnergyScaleMakesOneOfAllLight) {
  const PolygonPupil pupil({.blades = 6, .rotation = 0.0});
  const double reach = 40.0;
  double energy = 0.0;
  // The transform of |A|^2 ends at 2R: any step below 2 pi/(2R) = 2.9 samples it exactly.
  const double step = 1.0;
  for (double x = -reach; x <= reach; x += step) {
    for (double y = -reach; y <= reach; y += step) energy += pupil.intensity({x, y}, 4.0);
  }
  energy *= step * step * pupil.energy_scale();
  EXPECT_LT(energy, 1.0);
  EXPECT_GT(energy, 1.0 - 1.5 / reach);
}

TEST(PolygonPupil, IsNeverNan) {
  const PolygonPupil pupil(7, 0.3, 1.0);
  for (const double U : {0.0, 1e-308, 1e-101, 1e-99, -1e4}) {
    for (const double q : {0.0, 1e-308, 1e-200, 1e-3, 1e3, 1e160, 1e300}) {
      EXPECT_TRUE(pupil.intensity({q, -q}, U) <= 1.0 + 1e-12) << q << " " << U;
    }
  }
}

TEST(PolygonPupil, RefusesWhatIsNoPolygon) {
  EXPECT_THROW(PolygonPupil(2, 0.0, 1.0), Error);
  EXPECT_THROW(PolygonPupil(5, 0.0, 0.0), Error);
  EXPECT_THROW(PolygonPupil(5, std::numeric_limits<double>::quiet_NaN(), 1.0), Error);
  EXPECT_THROW(PolygonPupil(Aperture{.blades = 0}), Error);
}

}  // namespace
}  // namespace fstop
