#include "core/optics/defocus_field.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

using Exact = std::complex<long double>;
constexpr long double kPi = std::numbers::pi_v<long double>;

// G by another derivation, in 64-bit mantissas: the double integral over the pupil's disc is turned
// into one around its rim (Green), where P = U r^2/2 - v x and g = grad P = (Ux - v, Uy):
//
//     2 pi G = -i closed integral of (exp(iP) - exp(iP0)) (g.n / g^2) dtheta
//
// with P0 = P at g = 0 where that point lies in or near the disc, else P0 = 0: then the bracket
// vanishes with g. Periodic and smooth: the midpoint rule converges exponentially.
Exact rim_integral(long double v, long double U, int extra_nodes = 0) {
  const bool stationary_near = v <= 2.0L * std::abs(U);
  if (v == 0.0L && U == 0.0L) return 0.5L;
  const long double at_rest = stationary_near ? -v * v / (2.0L * U) : 0.0L;
  const long double band = v + std::abs(U);
  const int count =
      static_cast<int>(1.2L * band + 30.0L * std::cbrt(band + 1.0L)) + 160 + extra_nodes;
  Exact sum = 0.0L;
  for (int i = 0; i < count; ++i) {
    const long double theta = (static_cast<long double>(i) + 0.5L) * 2.0L * kPi / count;
    const long double gx = U * std::cos(theta) - v;
    const long double gy = U * std::sin(theta);
    const long double normal = gx * std::cos(theta) + gy * std::sin(theta);
    const long double square = gx * gx + gy * gy;
    // exp(iP) - exp(iP0) = 2i sin(D/2) exp(i(P0 + D/2)), D = P - P0 = g^2/2U about the rest point.
    const long double D = stationary_near ? square / (2.0L * U) : U / 2.0L - v * std::cos(theta);
    const long double h = 0.5L * D;
    const long double sinc = std::abs(h) < 1e-10L ? 1.0L : std::sin(h) / h;
    const long double factor =
        stationary_near ? sinc * normal / (2.0L * U) : 2.0L * std::sin(h) * normal / square;
    sum += factor * Exact(std::cos(at_rest + h), std::sin(at_rest + h));
  }
  return sum / static_cast<long double>(count);
}

// The defining integral with the composite midpoint rule extrapolated would be slow; two-point
// Gauss on many panels is simple, and its error is known to fall by 16 for half the panels' width.
Exact defining_integral(double v, double U, int panels) {
  Exact sum = 0.0L;
  const long double width = 1.0L / panels;
  const long double node = 0.5L / std::sqrt(3.0L);
  for (int i = 0; i < panels; ++i) {
    for (const long double side : {-node, node}) {
      const long double t = (static_cast<long double>(i) + 0.5L + side) * width;
      const long double phase = 0.5L * U * t * t;
      sum += std::cyl_bessel_j(0.0L, v * t) * t * Exact(std::cos(phase), std::sin(phase));
    }
  }
  return sum * (0.5L * width);
}

double distance(std::complex<double> field, Exact truth) {
  const double error = static_cast<double>(std::abs(Exact(field) - truth));
  return std::isnan(error) ? std::numeric_limits<double>::infinity() : error;
}

TEST(DefocusFieldTruth, RimIntegralIsTheDefiningIntegral) {
  for (const auto& [v, U] : {std::pair{0.0, 3.0},
                             {2.0, 0.0},
                             {5.0, 5.0},
                             {17.0, 31.0},
                             {40.0, 12.0},
                             {63.0, -60.0},
                             {1e-3, 1e-3}}) {
    const Exact truth = rim_integral(v, U);
    const long double coarse = std::abs(defining_integral(v, U, 1000) - truth);
    const long double fine = std::abs(defining_integral(v, U, 2000) - truth);
    // Fourth order: the finer rule must be 16 times nearer, down to the rounding of J_0.
    EXPECT_LT(fine, std::max(coarse / 12.0L, 1e-17L)) << v << " " << U;
    EXPECT_LT(fine, 1e-8L) << v << " " << U;
  }
}

// The domain stated is |U| <= 1000, v <= 2000, 1e-12 absolute. Ours is held to 1e-15: a few
// roundings of the largest value, 1/2.
constexpr double kTolerance = 1e-15;

void expect_truth(double v, double U) {
  const Exact truth = rim_integral(v, U);
  EXPECT_LE(distance(defocus_field(v, U), truth), kTolerance) << "v " << v << ", U " << U;
  EXPECT_LE(distance(DefocusField(U)(v), truth), kTolerance) << "v " << v << ", U " << U;
}

TEST(DefocusField, AgreesAtRandomOverTheDomain) {
  std::mt19937_64 random(20260301);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int i = 0; i < 500; ++i) {
    const double sign = i % 2 == 0 ? 1.0 : -1.0;
    expect_truth(2000.0 * uniform(random), sign * 1000.0 * uniform(random));
    expect_truth(60.0 * uniform(random), sign * 50.0 * uniform(random));
    // Every order of magnitude alike, 1e-6 to 2000 and 1e-3 to 1000.
    expect_truth(1e-6 * std::pow(2e9, uniform(random)),
                 sign * 1e-3 * std::pow(1e6, uniform(random)));
  }
}

TEST(DefocusField, AgreesAtTheRegimesBorders) {
  for (const double U :
       {1e-9, 1e-3, 0.1, 1.0, 2.0, 3.9, 12.5, 25.0, 50.0, 99.0, 100.0, 314.0, 777.0, 1000.0}) {
    // The shadow's rim |U| = v, half of it and twice it, from both sides.
    for (const double ratio : {0.5, 0.999, 1.0 - 1e-12, 1.0, 1.0 + 1e-12, 1.001, 2.0}) {
      expect_truth(ratio * U, U);
      expect_truth(ratio * U, -U);
    }
    for (const double v : {0.0, 1e-300, 1e-9, 0.99e-8, 1.01e-8, 1e-4, 3.83, 24.999, 25.0, 25.001}) {
      expect_truth(v, U);
    }
  }
}

TEST(DefocusField, AgreesBeyondTheStatedDomain) {
  for (const double U : {1500.0, 4000.0, -10000.0}) {
    for (const double v : {0.1, 900.0, 4000.0, 10000.0, 15000.0}) expect_truth(v, U);
  }
}

// The series goes upwards from where 2 terms <= v and v >= 25. Across that v the value may change
// by its slope, at most |dG/dv| <= 1/3, times the step, and by rounding.
TEST(DefocusField, IsContinuousAcrossTheSwitchOfRecurrences) {
  for (const double U : {0.0, 0.3, 5.0, 20.0, 50.0, 200.0, 1000.0}) {
    const DefocusField field(U);
    for (double v = 20.0; v < 800.0; v = 1.0 + std::floor(v)) {
      for (const double edge : {v, v + 0.5}) {
        const double below = std::nextafter(edge, 0.0);
        EXPECT_LE(std::abs(field(edge) - field(below)), 1e-15) << "U " << U << ", v " << edge;
      }
    }
  }
}

// U = 0 is Airy's amplitude, v = 0 a finite phase integral; both have closed forms.
TEST(DefocusField, HasTheClosedFormsOfItsAxes) {
  for (double x = 0.05; x < 1000.0; x *= 1.13) {
    EXPECT_NEAR(defocus_field(x, 0.0).real(), std::cyl_bessel_j(1.0, x) / x, 1e-15) << x;
    EXPECT_EQ(defocus_field(x, 0.0).imag(), 0.0);
    EXPECT_NEAR(DefocusField(x).intensity(0.0), std::pow(std::sin(x / 4.0) / (x / 2.0), 2), 1e-16);
  }
  EXPECT_EQ(defocus_field(0.0, 0.0), 0.5);
  EXPECT_EQ(DefocusField(0.0)(0.0), 0.5);
}

TEST(DefocusField, IsEvenInVAndConjugateInU) {
  for (const double v : {0.3, 7.0, 90.0}) {
    for (const double U : {0.2, 11.0, 300.0}) {
      EXPECT_EQ(defocus_field(-v, U), defocus_field(v, U));
      EXPECT_EQ(defocus_field(v, -U), std::conj(defocus_field(v, U)));
      EXPECT_EQ(DefocusField(-U)(v), std::conj(DefocusField(U)(v)));
    }
  }
}

TEST(DefocusField, IsNeverNanForFiniteArguments) {
  const double tiny = std::numeric_limits<double>::denorm_min();
  const double huge = std::numeric_limits<double>::max();
  for (const double U : {0.0, tiny, -tiny, 1e-200, 1e-13, 1e-12, 1.1e-12, 1e-8, 1.0, -50.0, 1e4}) {
    const DefocusField field(U);
    std::vector<double> radii = {0.0, tiny, 1e-300, 1e-9, 1e-8, 1.1e-8, 1e-5, 1.0,
                                 3.0, 24.9, 25.1,   1e3,  1e6,  1e15,   1e99, huge};
    std::vector<double> batch(radii.size());
    field.intensities(radii, batch);
    for (std::size_t i = 0; i < radii.size(); ++i) {
      const std::complex<double> value = defocus_field(radii[i], U);
      EXPECT_LE(std::norm(value), 0.25 * (1.0 + 1e-15)) << "v " << radii[i] << ", U " << U;
      EXPECT_NEAR(batch[i], std::norm(value), 1e-15) << "v " << radii[i] << ", U " << U;
      EXPECT_LE(std::norm(value), 1.0 / (1.0 + std::pow(radii[i], 3)) * (1.0 + U * U) + 1e-30);
    }
  }
}

// Eight at a time, ascending, shuffled, descending and in a remainder: the same numbers.
TEST(DefocusField, BatchesAgreeWithSingleValues) {
  std::mt19937_64 random(7);
  for (const double U : {0.0, 6.28, 50.0, 209.4, 1000.0}) {
    const DefocusField field(U);
    std::vector<double> radii(517);
    for (std::size_t i = 0; i < radii.size(); ++i) {
      radii[i] = static_cast<double>(i) * (1.4 * U + 80.0) / 516.0;
    }
    for (int order = 0; order < 3; ++order) {
      if (order == 1) std::ranges::shuffle(radii, random);
      if (order == 2) std::ranges::sort(radii, std::greater<>());
      std::vector<double> batch(radii.size());
      field.intensities(radii, batch);
      for (std::size_t i = 0; i < radii.size(); ++i) {
        EXPECT_NEAR(batch[i], field.intensity(radii[i]), 1e-15) << "U " << U << ", v " << radii[i];
      }
    }
  }
}

TEST(DefocusField, RefusesWhatItCannotCompute) {
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {nan, infinity, -infinity, 1.0001e4, -1.0001e4}) {
    EXPECT_THROW(defocus_field(1.0, bad), Error);
    EXPECT_THROW(DefocusField{bad}, Error);
  }
  for (const double bad : {nan, infinity, -infinity}) EXPECT_THROW(defocus_field(bad, 1.0), Error);
}

}  // namespace
}  // namespace fstop
