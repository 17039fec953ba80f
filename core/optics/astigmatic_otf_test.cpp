#include "core/optics/astigmatic_otf.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/oblique_pinhole.h"
#include "core/optics/quadrature.h"
#include "core/optics/transfer.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;

// The defining integral in polar coordinates about the overlap's centre: in direction phi the rim
// is at the root of |r e + s/2| = 1 on the far side.
double overlap_integral(double U_x, double U_y, Vec2 s) {
  const double largest = std::max(std::abs(U_x), std::abs(U_y));
  const QuadratureRule rule = gauss_legendre(40 + static_cast<int>(2.0 * largest));
  const int directions = 4096 + 40 * static_cast<int>(largest);
  double sum = 0.0;
  for (int i = 0; i < directions; ++i) {
    const double phi = 2.0 * kPi * (i + 0.5) / directions;
    const Vec2 e{std::cos(phi), std::sin(phi)};
    const double b = 0.5 * std::abs(e.x * s.x + e.y * s.y);
    const double quarter = 0.25 * (s.x * s.x + s.y * s.y);
    const double rim = -b + std::sqrt(b * b + 1.0 - quarter);
    for (std::size_t j = 0; j < rule.nodes.size(); ++j) {
      const double r = 0.5 * rim * (1.0 + rule.nodes[j]);
      sum += 0.5 * rim * rule.weights[j] * r * std::cos(r * (U_x * s.x * e.x + U_y * s.y * e.y));
    }
  }
  return sum * 2.0 * kPi / directions / kPi;
}

// The rim has two kinks in phi, where the midpoint rule errs by the square of its step: 1e-6.
TEST(AstigmaticOtf, IsTheIntegralOverTheOverlap) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1.3, 1.3);
  for (const auto& [x, y] : {std::pair{3.0, 4.5}, {-8.0, 2.0}, {0.0, 12.0}, {20.0, 30.0}}) {
    const AstigmaticOtf otf(x, y);
    for (int i = 0; i < 10; ++i) {
      const Vec2 s{uniform(random), uniform(random)};
      EXPECT_NEAR(otf(s), overlap_integral(x, y, s), 2e-6)
          << "U " << x << " " << y << ", s " << s.x << " " << s.y;
    }
  }
}

// Equal defocus is Hopkins's integral; along an axis that axis's defocus alone counts.
TEST(AstigmaticOtf, IsHopkinsIntegralWhereItMustBe) {
  for (const double U : {0.0, 2.0, -30.0, 700.0}) {
    const DefocusOtf round(U);
    const AstigmaticOtf equal(U, U);
    const AstigmaticOtf along_x(U, 0.3 * U);
    const AstigmaticOtf along_y(-0.5 * U, U);
    for (double s = 0.0; s < 2.3; s += 0.0731) {
      EXPECT_NEAR(equal({0.6 * s, -0.8 * s}), round(s), 1e-13) << "U " << U << ", s " << s;
      EXPECT_NEAR(along_x({s, 0.0}), round(s), 1e-13) << "U " << U << ", s " << s;
      EXPECT_NEAR(along_y({0.0, -s}), round(s), 1e-13) << "U " << U << ", s " << s;
    }
  }
}

// The transform of the oblique pinhole's point spread, at s = nu lambda z/(a cos^3, a cos):
// sum of PSF cos(2 pi nu . r) over a grid finer than the transform's band. Beyond v = Q lies
// 2/(pi Q) of the light of a disc (A & S 9.2.1), less than that over a square of half side Q.
TEST(AstigmaticOtf, IsTheTransformOfTheObliquePinhole) {
  const CircularPupil hole = pinhole_pupil(0.35_mm, 50.0_mm);
  const Length wavelength = 550.0_nm;
  const double angle = 30.0 * kPi / 180.0;
  const double c = std::cos(angle);
  const double v_x = 2.0 * kPi / wavelength.si() * (0.175e-3 / 0.05) * c * c * c;
  const double v_y = v_x / (c * c);
  const double reach = 40.0;
  const double step = 1.2;
  const ObliquePinholePsf psf(hole, wavelength, angle, Length::si(1.5 * reach / v_x));
  const AstigmaticOtf otf(psf.radial_defocus(), psf.tangential_defocus());
  for (const Vec2 s : {Vec2{0.0, 0.0}, Vec2{0.5, 0.0}, Vec2{0.0, 0.5}, Vec2{0.4, 0.7}}) {
    double sum = 0.0;
    for (double x = -reach; x <= reach; x += step) {
      for (double y = -reach; y <= reach; y += step) {
        sum += psf.density(Length::si(x / v_x), Length::si(y / v_y)).si() *
               std::cos(s.x * x + s.y * y);
      }
    }
    EXPECT_NEAR(sum * step * step / (v_x * v_y), otf(s), 2.0 / (kPi * reach)) << s.x << " " << s.y;
  }
  EXPECT_GT(std::abs(otf({0.5, 0.0}) - otf({0.0, 0.5})), 2.5 * 2.0 / (kPi * reach))
      << "the axes could be exchanged unnoticed";
}

TEST(AstigmaticOtf, IsOneAtZeroAndNeverNan) {
  for (const double U : {0.0, 1e-300, 5.0, -1e4}) {
    const AstigmaticOtf otf(U, -0.5 * U);
    EXPECT_NEAR(otf({0.0, 0.0}), 1.0, 1e-13);
    for (const double s : {1e-308, 1e-20, 1e-8, 1.0, 1.9999999999, 2.0, 1e300}) {
      EXPECT_TRUE(std::abs(otf({s, 0.3 * s})) <= 1.0 + 1e-13) << U << " " << s;
    }
  }
  EXPECT_THROW(AstigmaticOtf(0.0, 1.1e4), Error);
  EXPECT_THROW(AstigmaticOtf(std::numeric_limits<double>::quiet_NaN(), 0.0), Error);
}

}  // namespace
}  // namespace fstop
