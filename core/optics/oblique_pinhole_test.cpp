#include "core/optics/oblique_pinhole.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/circular_psf.h"
#include "core/optics/pinhole.h"
#include "core/optics/quadrature.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180.0;
const Length kScreen = 50.0_mm;
const Length kRed = 600.0_nm;

CircularPupil one_zone_hole() {
  return pinhole_pupil(optimal_pinhole_diameter(kScreen, kRed), kScreen);
}

// |A|^2 of the definition by the product rule in polar coordinates.
double disc_integral(double U_r, double U_t, double v_r, double v_t) {
  const QuadratureRule rule = gauss_legendre(80);
  const int turns = 400;
  std::complex<double> sum = 0.0;
  for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
    const double r = 0.5 * (1.0 + rule.nodes[i]);
    for (int j = 0; j < turns; ++j) {
      const double x = r * std::cos(2.0 * kPi * j / turns);
      const double y = r * std::sin(2.0 * kPi * j / turns);
      sum += 0.5 * rule.weights[i] * r * (2.0 * kPi / turns) *
             std::polar(1.0, 0.5 * (U_r * x * x + U_t * y * y) - v_r * x - v_t * y);
    }
  }
  return std::norm(sum);
}

TEST(ObliquePinhole, IsTheIntegralOverTheEllipticalPhase) {
  for (const Length diameter : {0.1_mm, 0.35_mm, 0.8_mm}) {
    const CircularPupil hole = pinhole_pupil(diameter, kScreen);
    for (const double degrees : {0.0, 20.0, -45.0, 70.0}) {
      const ObliquePinholePsf psf(hole, kRed, degrees * kDegree, 0.4_mm);
      const double c = std::cos(degrees * kDegree);
      const double v_per_metre = kPi * diameter.si() / (kRed.si() * kScreen.si());
      const double zones = fresnel_number(diameter, kScreen, kRed);
      EXPECT_NEAR(psf.radial_defocus(), 2.0 * kPi * zones * c * c * c, 1e-12);
      EXPECT_NEAR(psf.tangential_defocus(), 2.0 * kPi * zones * c, 1e-12);
      for (const auto& [x, y] : {std::pair{0.0, 0.0},
                                 {1e-4, 0.0},
                                 {0.0, 1e-4},
                                 {-7e-5, 1.3e-4},
                                 {2e-4, 2e-4},
                                 {1e-9, 1e-12}}) {
        const double truth = disc_integral(psf.radial_defocus(), psf.tangential_defocus(),
                                           x * v_per_metre * c * c * c, y * v_per_metre * c);
        const double scale = std::pow(v_per_metre * c * c, 2) / (4.0 * kPi * kPi * kPi);
        // Nothing exceeds the peak, |A| = pi; 1e-12 of it.
        EXPECT_NEAR(psf.density(Length::si(x), Length::si(y)).si(), scale * truth,
                    1e-12 * scale * kPi * kPi)
            << degrees << " degrees at " << x << ", " << y;
        EXPECT_EQ(psf.density(Length::si(x), Length::si(y)),
                  psf.density(Length::si(x), Length::si(-y)));
      }
    }
  }
}

TEST(ObliquePinhole, IsTheCircularPsfOnTheAxis) {
  const CircularPsf axis(one_zone_hole(), kRed);
  const ObliquePinholePsf psf(one_zone_hole(), kRed, 0.0, 0.5_mm);
  const double peak = axis.density(Length{}).si();
  for (double r = 0.0; r < 0.5e-3; r += 1.3e-5) {
    const Length x = Length::si(0.6 * r);
    const Length y = Length::si(-0.8 * r);
    EXPECT_NEAR(psf.density(x, y).si(), axis.density(Length::si(r)).si(), 1e-12 * peak);
    EXPECT_NEAR(psf.intensity_over_incident(x, y), axis.intensity_over_incident(Length::si(r)),
                4e-12);
  }
}

// Rayleigh and Sommerfeld's first integral over the hole for a plane wave at an angle.
double surface_integral(double angle, double x, double y) {
  const double a = 0.5 * optimal_pinhole_diameter(kScreen, kRed).si();
  const double z = kScreen.si();
  const double k = 2.0 * kPi / kRed.si();
  const double X = z * std::tan(angle) + x;
  const double reference = std::sqrt(z * z + X * X + y * y);
  static const QuadratureRule rule = gauss_legendre(28);
  const int turns = 64;
  std::complex<double> sum = 0.0;
  for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
    const double r = 0.5 * a * (1.0 + rule.nodes[i]);
    for (int j = 0; j < turns; ++j) {
      const double xi = r * std::cos(2.0 * kPi * j / turns);
      const double eta = r * std::sin(2.0 * kPi * j / turns);
      const double extra = xi * xi - 2.0 * X * xi + eta * eta - 2.0 * y * eta;
      const double R = std::sqrt(reference * reference + extra);
      const double phase = k * (xi * std::sin(angle) + extra / (R + reference));
      sum += rule.weights[i] * r / turns * std::polar(z / (R * R), phase) *
             std::complex<double>(1.0 / R, -k);
    }
  }
  return std::norm(0.5 * a * sum);
}

struct ShapeErrors {
  double astigmatic = 0.0;
  double shift_invariant = 0.0;
};

// Relative L2 differences over a disc of 0.3 mm, every image scaled to the same energy there.
ShapeErrors shape_errors(double angle) {
  const CircularPupil hole = one_zone_hole();
  const ObliquePinholePsf oblique(hole, kRed, angle, 0.3_mm);
  const CircularPsf axis(hole, kRed);
  std::vector<std::array<double, 4>> values;  // weight, truth, oblique, axis
  for (double r = 0.01e-3; r < 0.3e-3; r += 0.02e-3) {
    for (int j = 0; j <= 8; ++j) {
      const double x = r * std::cos(kPi * j / 8.0);
      const double y = r * std::sin(kPi * j / 8.0);
      values.push_back({r * (j % 8 == 0 ? 0.5 : 1.0), surface_integral(angle, x, y),
                        oblique.density(Length::si(x), Length::si(y)).si(),
                        axis.density(Length::si(r)).si()});
    }
  }
  std::array<double, 4> energy = {};
  for (const auto& value : values) {
    for (std::size_t i = 1; i < 4; ++i) energy[i] += value[0] * value[i];
  }
  double norm = 0.0;
  ShapeErrors errors;
  for (const auto& [weight, truth, model, shifted] : values) {
    const double t = truth / energy[1];
    norm += weight * t * t;
    errors.astigmatic += weight * std::pow(model / energy[2] - t, 2);
    errors.shift_invariant += weight * std::pow(shifted / energy[3] - t, 2);
  }
  return {std::sqrt(errors.astigmatic / norm), std::sqrt(errors.shift_invariant / norm)};
}

TEST(ObliquePinhole, AgreesWithRayleighSommerfeldOffAxis) {
  const nlohmann::json table = oracle::fixture("maps/oblique");
  ASSERT_GE(table.at("rows").size(), 7U);
  for (const nlohmann::json& row : table.at("rows")) {
    const double angle = row.at("angle_deg").get<double>() * kDegree;
    const ObliquePinholePsf psf(one_zone_hole(), kRed, angle, 0.3_mm);
    const double axis = psf.intensity_over_incident(Length{}, Length{});
    // The map prints six digits.
    EXPECT_NEAR(axis, oracle::number(row.at("axis_chief_fresnel")), 6e-6) << row.dump();
    EXPECT_NEAR(surface_integral(angle, 0.0, 0.0), oracle::number(row.at("axis_over_incident_rs")),
                6e-6);
    const ShapeErrors errors = shape_errors(angle);
    EXPECT_LE(errors.astigmatic, psf.error()) << row.dump();
    EXPECT_LE(oracle::number(row.at("shape_err_astigmatic_fresnel")), psf.error());
    // Without the astigmatism the shape is off by percents: the map's figure to a quarter, since
    // its window is not ours.
    const double listed = row.at("shape_err_shift_invariant");
    EXPECT_NEAR(errors.shift_invariant, listed, 0.25 * listed + 1e-5) << row.dump();
  }
}

TEST(ObliquePinhole, RefusesWhatItCannotCompute) {
  const CircularPupil hole = one_zone_hole();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(ObliquePinholePsf(hole, kRed, 1.4, 1.0_mm), Error);
  EXPECT_THROW(ObliquePinholePsf(hole, kRed, nan, 1.0_mm), Error);
  EXPECT_THROW(ObliquePinholePsf(hole, kRed, 0.1, Length::si(nan)), Error);
  EXPECT_THROW(ObliquePinholePsf(hole, kRed, 0.1, 10.0_m), Error);
  EXPECT_THROW(ObliquePinholePsf(pinhole_pupil(5.0_um, kScreen), kRed, 0.1, 1.0_mm), Error);
  const ThinLens lens{.focal_length = 50.0_mm, .f_number = 16.0};
  EXPECT_THROW(ObliquePinholePsf(lens_pupil(lens, 2.0_m, 3.0_m), kRed, 0.1, 1.0_mm), Error);
}

}  // namespace
}  // namespace fstop
