#include "core/post/point_spread.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/circular_psf.h"
#include "core/optics/oblique_pinhole.h"
#include "core/post/point_spread_energy.h"
#include "core/post/point_spread_image.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;

CircularPupil f8_lens(Length object_distance) {
  return lens_pupil({.focal_length = 50.0_mm, .f_number = 8.0}, 2.0_m, object_distance);
}

PointSpread spread_of(const PointSpreadSpec& spec) { return PointSpread(spec, 1.0_mm); }

// A pupil whose U is pi W20 4 exactly, as a fixture's row asks.
PointSpreadSpec fixture_lens(const nlohmann::json& row) {
  const Length z = 50.0_mm;
  const Length a = z / (2.0 * row.at("working_f_number").get<double>());
  const Length wavelength = oracle::millimetres(row.at("lambda_mm"));
  const double U = oracle::number(row.at("U"));
  return {.pupil = {.diameter = 2.0 * a,
                    .image_distance = z,
                    .defocus = U * (wavelength / (2.0 * kPi * a * a)),
                    .has_lens = true},
          .wavelength = wavelength};
}

double peak_of(const nlohmann::json& profile) {
  double peak = 0.0;
  for (const auto& at : profile) peak = std::max(peak, oracle::number(at.at("psf_per_mm2")));
  return peak;
}

// The fixture's tolerances: 1e-11 of the profile's peak, 1e-12 of the OTF.
TEST(PointSpread, AgreesWithTheFixtureOfDefocusedLenses) {
  const nlohmann::json table = oracle::fixture("defocused_lens");
  ASSERT_GE(table.at("rows").size(), 5U);
  for (const auto& row : table.at("rows")) {
    const PointSpread spread = spread_of(fixture_lens(row));
    EXPECT_TRUE(spread.is_round());
    EXPECT_NEAR(2.0 * geometric_radius(spread.spec()).si() * 1e3,
                std::abs(oracle::number(row.at("coc_diameter_mm"))), 1e-12);
    const double peak = peak_of(row.at("profile"));
    for (const auto& at : row.at("profile")) {
      const Length radius = oracle::millimetres(at.at("rho_mm"));
      EXPECT_NEAR(spread.density({0.0, -radius.si()})[0] / 1e6,
                  oracle::number(at.at("psf_per_mm2")), 1e-11 * peak);
    }
    for (const auto& at : row.at("otf")) {
      const double nu = oracle::number(at.at("nu_cyc_per_mm")) * 1e3;
      const auto otf = spread.otf({0.6 * nu, 0.8 * nu});
      EXPECT_NEAR(otf[0].real(), oracle::number(at.at("otf")), 1e-12);
      EXPECT_EQ(otf[0].imag(), 0.0);
    }
  }
}

// The fixture's tolerances: 1e-11 of the peak, 1e-9 of the radii.
TEST(PointSpread, AgreesWithTheFixtureOfPinholes) {
  const nlohmann::json table = oracle::fixture("pinhole_psf");
  ASSERT_GE(table.at("rows").size(), 5U);
  for (const auto& row : table.at("rows")) {
    const PointSpread spread =
        spread_of({.pupil = pinhole_pupil(oracle::millimetres(row.at("d_mm")),
                                          oracle::millimetres(row.at("f_prime_mm")),
                                          oracle::millimetres(row.at("object_distance_mm"))),
                   .wavelength = oracle::millimetres(row.at("lambda_mm"))});
    EXPECT_NEAR(spread.fresnel_number(), oracle::number(row.at("N_F")),
                1e-12 * oracle::number(row.at("N_F")));
    const double peak = peak_of(row.at("profile"));
    for (const auto& at : row.at("profile")) {
      const Length radius = oracle::millimetres(at.at("rho_mm"));
      EXPECT_NEAR(spread.density({radius.si(), 0.0})[0] / 1e6, oracle::number(at.at("psf_per_mm2")),
                  1e-11 * peak);
    }
    const auto radii = encircled_radii(spread, std::vector{0.5, 0.8});
    EXPECT_LE(oracle::relative_difference(radii[0][0] * 1e3, row.at("ee50_radius_mm")), 1e-9);
    EXPECT_LE(oracle::relative_difference(radii[1][0] * 1e3, row.at("ee80_radius_mm")), 1e-9);
  }
}

// A point behind the focused plane: the rays' triangle stands upright, its corner of rotation 0 on
// +x; before it, turned round. Between the side (apothem R/2) and the corner lies light on one side
// alone. Signs from the rays of a pixel: q = v p (1/s - 1/d).
TEST(PointSpread, TrianglesStandUprightBehindTheFocusedPlane) {
  for (const auto& [distance, side] : {std::pair{kInfinitelyFar, 1.0}, {1.0_m, -1.0}}) {
    const PointSpread spread =
        spread_of({.pupil = lens_pupil({.focal_length = 50.0_mm, .f_number = 4.0}, 2.0_m, distance),
                   .aperture = {.blades = 3}});
    EXPECT_EQ(spread.regime(), DiffractionRegime::geometric_shadow);
    const double disc = 1.0 / (kPi * std::pow(geometric_radius(spread.spec()).si(), 2));
    double bright = 0.0;
    double dark = 0.0;
    for (double share = 0.8; share < 1.0; share += 0.02) {
      const double x = side * share * geometric_radius(spread.spec()).si();
      bright += spread.density({x, 0.0})[0] / 11.0;
      dark += spread.density({-x, 0.0})[0] / 11.0;
    }
    EXPECT_GT(bright, 0.5 * disc);
    EXPECT_LT(dark, 0.1 * disc);
  }
}

// Every channel holds the share that its own wavelengths have inside, weights apart.
TEST(PointSpread, RgbAddsWavelengths) {
  const PointSpread spread = spread_of({.pupil = f8_lens(2.2_m), .rgb = true});
  EXPECT_GE(spread.wavelengths(), 17);
  EXPECT_LE(spread.spectral_error(), 1e-3);
  EXPECT_GT(spread.spectral_error(), 0.0);
  const auto samples = spectral_samples(SpectralBands::sensor, 512);
  const std::vector<double> fractions = {0.5, 0.9};
  const auto radii = encircled_radii(spread, fractions);
  for (std::size_t i = 0; i < fractions.size(); ++i) {
    Channels energy = {};
    for (const SpectralSample& sample : samples) {
      const CircularPsf psf(f8_lens(2.2_m), sample.wavelength);
      for (std::size_t c = 0; c < 3; ++c) {
        energy[c] += sample.weight[c] * psf.encircled_energy(Length::si(radii[i][c]));
      }
    }
    for (const double share : energy) EXPECT_NEAR(share, fractions[i], 1e-3);
  }
  const double peak = spread.density({0.0, 0.0})[1];
  for (const double radius : {0.0, 3e-6, 1.1e-5}) {
    Channels sum = {};
    for (const SpectralSample& sample : samples) {
      const double density =
          CircularPsf(f8_lens(2.2_m), sample.wavelength).density(Length::si(radius)).si();
      for (std::size_t c = 0; c < 3; ++c) sum[c] += sample.weight[c] * density;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(spread.density({radius, 0.0})[c], sum[c], 2e-3 * peak);
    }
  }
  EXPECT_NEAR(std::abs(spread.otf({0.0, 0.0})[2] - 1.0), 0.0, 1e-12);
}

// Off the axis a pinhole's image is narrower across (N_F cos) than along (N_F cos^3); the lens's
// does not change.
TEST(PointSpread, FieldAngleChangesThePinholeAlone) {
  const CircularPupil hole = pinhole_pupil(0.15_mm, 50.0_mm);
  const PointSpread oblique = spread_of({.pupil = hole, .field_angle = 0.7});
  EXPECT_FALSE(oblique.is_round());
  const ObliquePinholePsf psf(hole, 550.0_nm, 0.7, 1.0_mm);
  for (const Vec2 p : {Vec2{0.0, 0.0}, Vec2{2e-4, 0.0}, Vec2{1e-4, -2e-4}}) {
    EXPECT_EQ(oblique.density(p)[0], psf.density(Length::si(p.x), Length::si(p.y)).si());
  }
  EXPECT_GT(oblique.density({2e-4, 0.0})[0], oblique.density({0.0, 2e-4})[0]);
  EXPECT_GT(oblique.otf({0.0, 1e3})[0].real(), oblique.otf({1e3, 0.0})[0].real());
  const PointSpread lens = spread_of({.pupil = f8_lens(1.5_m), .field_angle = 0.7});
  EXPECT_TRUE(lens.is_round());
}

TEST(PointSpread, RefusesWithTheModelsReason) {
  const auto refusal = [](const PointSpreadSpec& spec) -> std::string {
    try {
      const PointSpread spread = spread_of(spec);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::outside_domain);
      return error.what();
    }
    return "accepted";
  };
  EXPECT_NE(refusal({.pupil = pinhole_pupil(0.004_mm, 50.0_mm)}).find("5 wavelengths"),
            std::string::npos);
  EXPECT_NE(refusal({.pupil = pinhole_pupil(0.35_mm, 50.0_mm), .field_angle = 1.4}).find("75 deg"),
            std::string::npos);
  EXPECT_NE(refusal({.pupil = pinhole_pupil(0.35_mm, 50.0_mm), .aperture = {.blades = 5}})
                .find("no blades"),
            std::string::npos);
  EXPECT_NE(refusal({.pupil = f8_lens(2.0_m), .aperture = {.blades = 65}}).find("64 blades"),
            std::string::npos);
  const PointSpread spread = spread_of({.pupil = f8_lens(2.0_m)});
  EXPECT_THROW(encircled_radii(spread, std::vector{0.0}), Error);
  EXPECT_THROW(encircled_radii(spread, std::vector{0.995}), Error);
  EXPECT_THROW(point_spread_image(spread, {0, 4, 1.0_um}, {}), Error);
  EXPECT_THROW(point_spread_image(spread, {4, 4, Length{}}, {}), Error);
  EXPECT_THROW(point_spread_image(spread, {4, 4, 10.0_mm}, {}), Error);
}

}  // namespace
}  // namespace fstop
