#include "core/optics/rayleigh_sommerfeld.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/defocus_field.h"
#include "core/optics/quadrature.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;

RoundHole hole_of(double radius, double distance) {  // in wavelengths
  return {.radius = Length::si(radius), .distance = Length::si(distance), .wavelength = 1.0_m};
}

TEST(RayleighSommerfeld, AgreesWithEveryRowOfTheFixture) {
  const nlohmann::json table = oracle::fixture("rayleigh_sommerfeld");
  ASSERT_FALSE(table.at("rows").empty());
  for (const nlohmann::json& row : table.at("rows")) {
    const double a = row.at("a_over_lambda");
    const double zones = row.at("N_F");
    const double z = a * a / zones;
    EXPECT_NEAR(z, oracle::number(row.at("z_over_lambda")), 1e-12 * z);
    double peak = 0.0;
    double fresnel_peak = 0.0;
    for (const nlohmann::json& point : row.at("profile")) {
      peak = std::max(peak, point.at("intensity_over_incident").get<double>());
      fresnel_peak = std::max(fresnel_peak, point.at("fresnel").get<double>());
    }
    const double U = 2.0 * kPi * zones;
    for (const nlohmann::json& point : row.at("profile")) {
      const double rho = point.at("rho_over_lambda");
      const IntensityEstimate exact = rayleigh_sommerfeld_intensity(hole_of(a, z), Length::si(rho));
      // The fixture's statement: 1e-10 of the profile's peak.
      EXPECT_NEAR(exact.value, oracle::number(point.at("intensity_over_incident")), 1e-10 * peak);
      EXPECT_LE(exact.error, 1e-12);
      const double fresnel = U * U * std::norm(defocus_field(2.0 * kPi * a * rho / z, U));
      EXPECT_NEAR(fresnel, oracle::number(point.at("fresnel")), 1e-10 * fresnel_peak);
      EXPECT_EQ(point.size(), 3U);
    }
  }
}

// The surface integral itself, over both dimensions of the hole.
double surface_integral(double a, double z, double rho) {
  const double k = 2.0 * kPi;
  const int turns = 64 + static_cast<int>(2.5 * k * a * std::min(1.0, rho / z));
  const QuadratureRule radial =
      gauss_legendre(30 + static_cast<int>(k * a * std::min(1.0, (a + rho) / z)));
  std::complex<double> sum = 0.0;
  for (std::size_t i = 0; i < radial.nodes.size(); ++i) {
    const double r = 0.5 * a * (1.0 + radial.nodes[i]);
    std::complex<double> ring = 0.0;
    for (int j = 0; j < turns; ++j) {
      const double theta = 2.0 * kPi * (j + 0.5) / turns;
      const double square = r * r + rho * rho - 2.0 * r * rho * std::cos(theta);
      const double R = std::sqrt(z * z + square);
      const double phase = k * square / (R + z);
      ring += std::complex<double>(std::cos(phase), std::sin(phase)) * (z / (R * R)) *
              std::complex<double>(1.0 / R, -k);
    }
    sum += radial.weights[i] * r * ring / static_cast<double>(turns);
  }
  return std::norm(0.5 * a * sum);
}

TEST(RayleighSommerfeld, RimIntegralIsTheSurfaceIntegral) {
  for (const auto& [a, z] :
       {std::pair{1.0, 1.0}, {2.0, 13.0}, {5.0, 25.0}, {10.0, 20.0}, {30.0, 300.0}}) {
    for (const double share : {0.0, 0.3, 0.999999, 1.0, 1.000001, 1.4, 3.0}) {
      const double rho = share * a;
      const double rim = rayleigh_sommerfeld_intensity(hole_of(a, z), Length::si(rho)).value;
      EXPECT_NEAR(rim, surface_integral(a, z, rho), 1e-11) << "a " << a << ", rho " << rho;
    }
  }
}

// On the axis there is a closed form, and for a near point source a radial integral.
TEST(RayleighSommerfeld, AxisHasItsClosedForm) {
  for (const auto& [a, z] :
       {std::pair{1.0, 1.0}, {5.0, 25.0}, {288.7, 83333.3}, {50.0, 5.0}, {1000.0, 3000.0}}) {
    const RoundHole hole = hole_of(a, z);
    const double axis = rayleigh_sommerfeld_on_axis(hole);
    EXPECT_NEAR(rayleigh_sommerfeld_intensity(hole, Length{}).value, axis, 1e-11);
    // A source at 1e13 wavelengths bends the wave by the phase pi a^2/u at the rim; |E| <= 2.
    const double bend = kPi * a * a / 1e13;
    EXPECT_NEAR(rayleigh_sommerfeld_on_axis(hole, Length::si(1e13)), axis, 4.0 * bend + 1e-11);
  }
}

// A point at u before the hole: Fresnel's zones number a^2/lambda (1/z + 1/u).
TEST(RayleighSommerfeld, NearPointSourceFollowsItsZones) {
  const double a = 100.0;
  for (const double u : {20000.0, 50000.0}) {
    const double z = 40000.0;
    const double zones = a * a * (1.0 / z + 1.0 / u);
    const double fresnel = 4.0 * std::pow(std::sin(0.5 * kPi * zones) * u / (u + z), 2);
    const double exact = rayleigh_sommerfeld_on_axis(hole_of(a, z), Length::si(u));
    EXPECT_NEAR(exact, fresnel,
                4.0 * (0.25 / (a * a) + 1.2 * std::pow(a, 4) / std::pow(u, 3)) + 1e-4);
  }
}

TEST(RayleighSommerfeld, RefusesWhatItCannotCompute) {
  const Length nan = Length::si(std::numeric_limits<double>::quiet_NaN());
  for (const Length bad : {Length{}, -(1.0_m), nan}) {
    EXPECT_THROW(rayleigh_sommerfeld_intensity({bad, 1.0_m, 1.0_m}, Length{}), Error);
    EXPECT_THROW(rayleigh_sommerfeld_intensity({1.0_m, bad, 1.0_m}, Length{}), Error);
    EXPECT_THROW(rayleigh_sommerfeld_intensity({1.0_m, 1.0_m, bad}, Length{}), Error);
    EXPECT_THROW(rayleigh_sommerfeld_on_axis({1.0_m, 1.0_m, 1.0_m}, bad), Error);
  }
  EXPECT_THROW(rayleigh_sommerfeld_intensity(hole_of(1.0, 1.0), nan), Error);
  EXPECT_THROW(rayleigh_sommerfeld_intensity(hole_of(1.1e5, 1e9), Length{}), Error);
  EXPECT_THROW(rayleigh_sommerfeld_intensity(hole_of(5000.0, 4.0), Length{}), Error);
}

}  // namespace
}  // namespace fstop
