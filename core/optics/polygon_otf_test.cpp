#include "core/optics/polygon_otf.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/polygon_psf.h"
#include "core/optics/quadrature.h"
#include "core/optics/transfer.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;

double dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }
double cross(Vec2 a, Vec2 b) { return a.x * b.y - a.y * b.x; }

// The part of a convex polygon to the left of the line through a and b.
std::vector<Vec2> left_of(const std::vector<Vec2>& polygon, Vec2 a, Vec2 b) {
  std::vector<Vec2> result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 p = polygon[i];
    const Vec2 q = polygon[(i + 1) % polygon.size()];
    const double at_p = cross(b - a, p - a);
    const double at_q = cross(b - a, q - a);
    if (at_p >= 0.0) result.push_back(p);
    if ((at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0)) {
      result.push_back(p + (q - p) * (at_p / (at_p - at_q)));
    }
  }
  return result;
}

// The defining integral: one copy clipped by the edges of the other, a fan of triangles, a product
// rule in each.
std::complex<double> overlap_integral(const Aperture& aperture, double U, Vec2 s) {
  const std::vector<Vec2> corners = aperture_vertices(aperture);
  std::vector<Vec2> overlap;
  for (const Vec2 c : corners) overlap.push_back(c + s * 0.5);
  for (std::size_t i = 0; i < corners.size() && !overlap.empty(); ++i) {
    overlap = left_of(overlap, corners[i] - s * 0.5, corners[(i + 1) % corners.size()] - s * 0.5);
  }
  const QuadratureRule rule = gauss_legendre(30 + static_cast<int>(2.0 * std::abs(U)));
  std::complex<double> sum = 0.0;
  for (std::size_t i = 1; i + 1 < overlap.size(); ++i) {
    const Vec2 a = overlap[i] - overlap[0];
    const Vec2 b = overlap[i + 1] - overlap[0];
    for (std::size_t j = 0; j < rule.nodes.size(); ++j) {
      for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
        const double t = 0.5 * (1.0 + rule.nodes[j]);
        const double u = 0.5 * (1.0 + rule.nodes[k]);
        const Vec2 x = overlap[0] + (a * (1.0 - u) + b * u) * t;
        sum += 0.25 * rule.weights[j] * rule.weights[k] * t * cross(a, b) *
               std::polar(1.0, -U * dot(s, x));
      }
    }
  }
  return sum / kPi;
}

// Rounding of a sum over some hundred nodes of order 1: 1e-13.
TEST(PolygonOtf, IsTheIntegralOverTheOverlap) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  double largest_imaginary = 0.0;
  for (const int blades : {3, 4, 5, 6, 7, 9}) {
    for (const double U : {0.0, 1e-9, 0.3, -7.0, 40.0}) {
      const Aperture aperture{.blades = blades, .rotation = 3.0 * uniform(random)};
      const PolygonOtf otf(aperture, U);
      for (int i = 0; i < 12; ++i) {
        const Vec2 s{1.8 * uniform(random), 1.8 * uniform(random)};
        EXPECT_LE(std::abs(otf(s) - overlap_integral(aperture, U, s)), 1e-13)
            << blades << " blades, U " << U << ", s " << s.x << " " << s.y;
        largest_imaginary = std::max(largest_imaginary, std::abs(otf(s).imag()));
      }
    }
  }
  EXPECT_GT(largest_imaginary, 0.05) << "odd blades out of focus: the phase was not tested";
}

// The transform of the point spread, for its sign: sum of |A(q)|^2 exp(-i s.q) over a grid, whose
// step below 2 pi/(2R + |s|) keeps the copies of H away from s. Beyond the square of half side Q
// lies less than 1.5/(Q - U R) of the light: PolygonPupil's own test finds less than 1.5/Q.
TEST(PolygonOtf, IsTheTransformOfThePointSpread) {
  const Aperture aperture{.blades = 3, .rotation = 0.3};
  const double U = 12.0;
  const PolygonOtf otf(aperture, U);
  const PolygonPupil pupil(aperture);
  const double reach = 60.0;
  const double step = 1.2;
  const double outside = 1.5 / (reach - U * aperture_circumradius(aperture));
  for (const Vec2 s : {Vec2{0.35, 0.1}, Vec2{-0.15, -0.35}, Vec2{-0.3, 0.25}}) {
    std::complex<double> sum = 0.0;
    for (double x = -reach; x <= reach; x += step) {
      for (double y = -reach; y <= reach; y += step) {
        sum += pupil.intensity({x, y}, U) * std::polar(1.0, -dot(s, {x, y}));
      }
    }
    sum *= step * step * pupil.energy_scale();
    EXPECT_LE(std::abs(sum - otf(s)), outside) << s.x << " " << s.y;
    EXPECT_GT(std::abs(sum - std::conj(otf(s))), 2.0 * outside) << "the test is blind to the sign";
  }
}

// Polygons of the disc's area: corners lie (pi/n)^2/3 outside the disc and sides half as much
// inside it, along 2 pi of rim, in both copies; over an area of pi a phase changes no more than
// that.
TEST(PolygonOtf, TendsToTheDisc) {
  for (const double U : {0.0, 1.0, -6.28, 60.0}) {
    const DefocusOtf disc(U);
    for (const int blades : {32, 64}) {
      const PolygonOtf otf({.blades = blades, .rotation = 0.1}, U);
      const double bound = 4.0 / 3.0 * std::pow(kPi / blades, 2);
      for (double s = 0.0; s < 2.2; s += 0.05) {
        for (const double angle : {0.0, 0.7, 2.0}) {
          const Vec2 at{s * std::cos(angle), s * std::sin(angle)};
          EXPECT_LE(std::abs(otf(at) - disc(s)), bound) << blades << " U " << U << " s " << s;
        }
      }
    }
  }
}

// A square [-b, b]^2 of area pi: a product of two slits,
// (1 - |s|/2b) sinc(U s (b - |s|/2)) each.
TEST(PolygonOtf, SquareIsAProductOfSlits) {
  const double b = 0.5 * std::sqrt(kPi);
  const auto slit = [b](double s, double U) {
    const double left = b - 0.5 * std::abs(s);
    if (left <= 0.0) return 0.0;
    const double turn = U * s * left;
    return left / b * (turn == 0.0 ? 1.0 : std::sin(turn) / turn);
  };
  for (const double U : {0.0, 1e-120, 5.0, -300.0, 1e4}) {
    const PolygonOtf otf({.blades = 4, .rotation = 0.25 * kPi}, U);
    for (const Vec2 s : {Vec2{0.0, 0.0}, Vec2{0.3, 0.0}, Vec2{0.0, -1.1}, Vec2{1e-9, 1e-3},
                         Vec2{0.7, 0.8}, Vec2{1.7, 1.7}, Vec2{1.78, 0.1}, Vec2{-1e-5, 1.5}}) {
      EXPECT_LE(std::abs(otf(s) - slit(s.x, U) * slit(s.y, U)), 2e-13)
          << "U " << U << ", s " << s.x << " " << s.y;
    }
  }
}

// The fixture has intensities in focus; H is their transform, so that, the polygon scaled to the
// unit disc's area, |A(q)|^2 = 1/pi integral of H(s) exp(i s.q) ds. By the trapezoidal rule of step
// h the sum repeats |A|^2 at distances 2 pi/h = Q, where it is at most (perimeter/(pi Q))^2; four
// such copies are nearest.
TEST(PolygonOtf, GivesTheFixturesIntensities) {
  const nlohmann::json table = oracle::fixture("polygon_pupil");
  for (const nlohmann::json& row : table.at("rows")) {
    const Aperture aperture{.blades = row.at("blades"), .rotation = row.at("rotation_rad")};
    const double R = aperture_circumradius(aperture);
    const PolygonOtf otf(aperture, 0.0);
    const double h = 0.008;
    const double perimeter = 2.0 * aperture.blades * R * std::sin(kPi / aperture.blades);
    const double alias = 4.0 * std::pow(perimeter / kPi * h / (2.0 * kPi), 2);
    const int reach = static_cast<int>(2.0 * R / h) + 1;
    std::vector<double> sums(row.at("points").size());
    for (int i = -reach; i <= reach; ++i) {
      for (int j = -reach; j <= reach; ++j) {
        const Vec2 s{i * h, j * h};
        const std::complex<double> value = otf(s);
        for (std::size_t k = 0; k < sums.size(); ++k) {
          const nlohmann::json& point = row.at("points")[k];
          // The fixture's polygon has circumradius 1.
          const Vec2 q{point.at("qx").get<double>() / R, point.at("qy").get<double>() / R};
          sums[k] += value.real() * std::cos(dot(s, q)) - value.imag() * std::sin(dot(s, q));
        }
      }
    }
    for (std::size_t k = 0; k < sums.size(); ++k) {
      const double expected = oracle::number(row.at("points")[k].at("intensity"));
      EXPECT_NEAR(sums[k] * h * h / kPi, expected, alias) << row.at("points")[k].dump();
    }
  }
}

TEST(PolygonOtf, IsHermitianAndOneAtZero) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-2.0, 2.0);
  for (const int blades : {3, 5, 8, 64}) {
    for (const double U : {0.0, 3.0, -900.0}) {
      const PolygonOtf otf({.blades = blades, .rotation = 1.0}, U);
      EXPECT_EQ(otf({0.0, 0.0}), 1.0);
      EXPECT_NEAR(std::abs(otf({1e-9, 0.0}) - 1.0), 0.0, 2e-9 * (1.0 + 2.0 * std::abs(U)));
      for (int i = 0; i < 200; ++i) {
        const Vec2 s{uniform(random), uniform(random)};
        EXPECT_LE(std::abs(otf(s) - std::conj(otf(s * -1.0))), 1e-13);
        EXPECT_LE(std::abs(otf(s)), 1.0 + 1e-13);
      }
    }
  }
}

// P - P ends, towards a corner of an even polygon, at 2R; across an odd one's side at apothem + R.
TEST(PolygonOtf, EndsAtTheCutOff) {
  for (const int blades : {3, 4, 5, 6, 11, 64}) {
    const Aperture aperture{.blades = blades, .rotation = 0.4};
    const PolygonOtf otf(aperture, 2.0);
    const double R = aperture_circumradius(aperture);
    const Vec2 to_corner{std::cos(0.4), std::sin(0.4)};
    const double apothem = R * std::cos(kPi / blades);
    EXPECT_NEAR(otf.cut_off(to_corner), blades % 2 == 0 ? 2.0 * R : R + apothem, 1e-12);
    for (double angle = 0.0; angle < 7.0; angle += 0.37) {
      const Vec2 direction{std::cos(angle), std::sin(angle)};
      const double end = otf.cut_off(direction);
      EXPECT_EQ(otf(direction * (end * (1.0 + 1e-9))), 0.0);
      EXPECT_NE(otf(direction * (end * (1.0 - 1e-3))), 0.0);
      EXPECT_LE(end, 2.0 * R + 1e-12);
    }
  }
}

TEST(PolygonOtf, IsNeverNan) {
  for (const int blades : {3, 4, 6, 64}) {
    for (const double U : {0.0, 1e-308, 1e-99, -1e4}) {
      const PolygonOtf otf({.blades = blades, .rotation = 0.0}, U);
      for (const double s :
           {0.0, 1e-308, 1e-151, 1e-149, 1e-20, 1e-8, 0.5, 1.9999999, 1e10, 1e300}) {
        for (const Vec2 direction : {Vec2{1.0, 0.0}, Vec2{0.0, 1.0}, Vec2{-0.5, 0.8660254}}) {
          EXPECT_TRUE(std::abs(otf(direction * s)) <= 1.0 + 1e-13)
              << blades << " " << U << " " << s;
        }
      }
    }
  }
}

TEST(PolygonOtf, RefusesWhatIsNoPolygonOrTooFarOutOfFocus) {
  EXPECT_THROW(PolygonOtf(Aperture{.blades = 0}, 0.0), Error);
  EXPECT_THROW(PolygonOtf(Aperture{.blades = 65}, 0.0), Error);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(PolygonOtf(Aperture{.blades = 5, .rotation = nan}, 0.0), Error);
  EXPECT_THROW(PolygonOtf(Aperture{.blades = 5}, 1.01e4), Error);
  EXPECT_THROW(PolygonOtf(Aperture{.blades = 5}, nan), Error);
}

}  // namespace
}  // namespace fstop
