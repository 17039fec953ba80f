#include "core/optics/encircled_energy.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/bessel.h"
#include "core/optics/diffraction.h"
#include "core/optics/quadrature.h"
#include "core/optics/transfer.h"

namespace fstop {
namespace {

TEST(EncircledEnergy, IsRayleighsFormInFocus) {
  const DefocusField field(0.0);
  for (double v = 0.01; v < 3000.0; v *= 1.7) {
    EXPECT_NEAR(encircled_energy(field, v), airy_encircled_energy(v), 2e-14) << v;
  }
}

// Parseval: E(v) = v integral from 0 to 2 of H(s) J_1(s v) ds. The OTF knows nothing of G.
// Substituting s = 2 sin^2(t) smooths both ends of H.
TEST(EncircledEnergy, IsTheTransformOfTheOtf) {
  for (const double U : {0.3, 6.283, 18.85, 62.8, 209.4}) {
    const DefocusField field(U);
    const DefocusOtf otf(U);
    for (const double v : {0.5, 3.0, 0.7 * U, U, 1.5 * U + 4.0}) {
      const int panels = 20 + static_cast<int>(0.5 * (U + v));
      const auto integrand = [&](double t) {
        const double sine = std::sin(t);
        const double s = 2.0 * sine * sine;
        return otf(s) * bessel_j0_j1(s * v).j1 * 4.0 * sine * std::cos(t);
      };
      double sum = 0.0;
      for (int i = 0; i < panels; ++i) {
        const double width = 0.5 * std::numbers::pi / panels;
        sum += gauss16(i * width, (i + 1) * width, integrand);
      }
      // v multiplies a sum of cancelling halves of size 1/v: roundings of 1, times v.
      EXPECT_NEAR(encircled_energy(field, v), v * sum, 1e-15 * v + 1e-12)
          << "U " << U << " v " << v;
    }
  }
}

// All light arrives: the rest is the tail 2/(pi v), whose next terms fall as v^-2 (fringes of the
// sharp edge) and U^2 v^-3.
TEST(EncircledEnergy, ConservesEnergy) {
  for (const double U : {0.0, 1.0, 12.5, 62.8, 400.0, 1000.0}) {
    const DefocusField field(U);
    for (const double v : {20.0 * U + 500.0, 40.0 * U + 3000.0}) {
      const double outside = 1.0 - encircled_energy(field, v);
      const double tail = 2.0 / (std::numbers::pi * v);
      EXPECT_NEAR(outside / tail, 1.0, 2.0 / v + 3.0 * U * U / (v * v)) << "U " << U << " v " << v;
    }
    const double beyond = 1.5e5 + 20.0 * U;
    EXPECT_NEAR(encircled_energy(field, beyond), 1.0 - 2.0 / (std::numbers::pi * beyond), 1e-12);
  }
}

TEST(EncircledRadius, InvertsTheEnergy) {
  for (const double U : {0.0, 1.2, 6.283, 52.4, 209.4, 1000.0}) {
    const DefocusField field(U);
    double last = 0.0;
    for (const double fraction : {1e-6, 0.01, 0.2, 0.5, 0.8, 0.84, 0.95, 0.99}) {
      const double v = encircled_radius(field, fraction);
      EXPECT_NEAR(encircled_energy(field, v), fraction, 1e-13) << "U " << U;
      EXPECT_GT(v, last);
      last = v;
    }
  }
  // An even number of zones darkens the axis itself: Newton has no slope to start from.
  const DefocusField dark(4.0 * std::numbers::pi);
  EXPECT_NEAR(encircled_energy(dark, encircled_radius(dark, 1e-9)), 1e-9, 1e-15);
}

TEST(EncircledRadius, RefusesImpossibleFractions) {
  const DefocusField field(1.0);
  for (const double bad : {0.0, -0.1, 0.999991, 1.0, 2.0, std::nan("")}) {
    EXPECT_THROW(encircled_radius(field, bad), Error) << bad;
  }
  for (const double bad : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(encircled_energy(field, bad), Error) << bad;
  }
}

TEST(HalfMaximum, IsWhereAirysPatternHalves) {
  const double v = half_maximum_radius(DefocusField(0.0));
  EXPECT_NEAR(airy_intensity(v), 0.5, 1e-14);
  // The full width is the familiar 1.029 lambda N: v = pi rho / (lambda N).
  EXPECT_NEAR(2.0 * v / std::numbers::pi, 1.029, 5e-4);
}

TEST(HalfMaximum, RefusesADarkAxis) {
  EXPECT_THROW(half_maximum_radius(DefocusField(4.0 * std::numbers::pi)), Error);
}

}  // namespace
}  // namespace fstop
