#include "core/optics/circular_psf.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/optics/pinhole.h"
#include "core/optics/rayleigh_sommerfeld.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr double kPerSquareMillimetre = 1e6;  // 1/m^2

double largest(const nlohmann::json& profile, const char* column) {
  double value = 0.0;
  for (const nlohmann::json& point : profile) {
    value = std::max(value, point.at(column).get<double>());
  }
  return value;
}

void expect_profile(const CircularPsf& psf, const nlohmann::json& profile) {
  // The fixture's statement: 1e-11 of the profile's peak.
  const double peak = largest(profile, "psf_per_mm2") * kPerSquareMillimetre;
  const double reduced_peak = largest(profile, "G_abs2");
  std::vector<double> radii;
  for (const nlohmann::json& point : profile) {
    const Length radius = oracle::millimetres(point.at("rho_mm"));
    radii.push_back(radius.si());
    const double v = point.at("v");
    EXPECT_NEAR(psf.reduced_radius(radius), v, 1e-12 * (1.0 + v));
    EXPECT_NEAR(psf.radius(v).si(), radius.si(), 1e-12 * radius.si());
    EXPECT_NEAR(psf.field().intensity(v), oracle::number(point.at("G_abs2")), 1e-11 * reduced_peak)
        << point.dump();
    EXPECT_NEAR(psf.density(radius).si(),
                oracle::number(point.at("psf_per_mm2")) * kPerSquareMillimetre, 1e-11 * peak)
        << point.dump();
  }
  std::vector<double> densities = radii;  // the same span in and out
  psf.densities(densities, densities);
  for (std::size_t i = 0; i < radii.size(); ++i) {
    EXPECT_NEAR(densities[i], psf.density(Length::si(radii[i])).si(), 1e-14 * peak);
  }
}

TEST(CircularPsf, AgreesWithEveryPinholeOfTheFixture) {
  const nlohmann::json table = oracle::fixture("pinhole_psf");
  ASSERT_FALSE(table.at("rows").empty());
  for (const nlohmann::json& row : table.at("rows")) {
    const Length screen = oracle::millimetres(row.at("f_prime_mm"));
    const Length wavelength = oracle::millimetres(row.at("lambda_mm"));
    const Length diameter = oracle::millimetres(row.at("d_mm"));
    const Length object = oracle::millimetres(row.at("object_distance_mm"));
    const CircularPsf psf(pinhole_pupil(diameter, screen, object), wavelength);
    EXPECT_LE(oracle::relative_difference(psf.defocus(), row.at("U")), 1e-13);
    EXPECT_LE(oracle::relative_difference(fresnel_number(diameter, screen, wavelength, object),
                                          row.at("N_F")),
              1e-13);
    const double c = diameter / optimal_pinhole_diameter(screen, wavelength, 1.0);
    EXPECT_LE(std::min(oracle::relative_difference(c, row.at("c")),
                       oracle::relative_difference(
                           2.0 * std::sqrt(psf.defocus() / 2.0 / std::numbers::pi), row.at("c"))),
              1e-13);
    expect_profile(psf, row.at("profile"));
    const double peak = largest(row.at("profile"), "intensity_over_incident");
    for (const nlohmann::json& point : row.at("profile")) {
      EXPECT_NEAR(psf.intensity_over_incident(oracle::millimetres(point.at("rho_mm"))),
                  oracle::number(point.at("intensity_over_incident")), 1e-11 * peak);
    }
    for (const auto& [fraction, column] :
         {std::pair{0.5, "ee50_radius_mm"}, {0.8, "ee80_radius_mm"}}) {
      const Length expected = oracle::millimetres(row.at(column));
      EXPECT_LE(oracle::relative_difference(psf.encircled_radius(fraction).si(), expected.si()),
                1e-9)
          << row.at("d_mm");
      EXPECT_NEAR(psf.encircled_energy(expected), fraction, 1e-9);
    }
    for (const nlohmann::json& point : row.at("mtf")) {
      const Vergence frequency = Vergence::si(oracle::number(point.at("nu_cyc_per_mm")) * 1e3);
      EXPECT_NEAR(psf.reduced_frequency(frequency), oracle::number(point.at("s")), 1e-13);
    }
    EXPECT_EQ(row.size(), 12U);
  }
}

// The exact axis value against the fixture, and the Fresnel axis within the bound it states. The
// aberration's share 4 pi |sin| dphi acts where 4 sin^2 is steep: compare by the profile's scale 4.
TEST(CircularPsf, AxisAgreesWithRayleighSommerfeld) {
  const nlohmann::json table = oracle::fixture("pinhole_psf");
  for (const nlohmann::json& row : table.at("rows")) {
    if (row.at("on_axis_rayleigh_sommerfeld").is_null()) continue;
    const Length screen = oracle::millimetres(row.at("f_prime_mm"));
    const Length wavelength = oracle::millimetres(row.at("lambda_mm"));
    const Length diameter = oracle::millimetres(row.at("d_mm"));
    const RoundHole hole{.radius = diameter / 2.0, .distance = screen, .wavelength = wavelength};
    const double exact = rayleigh_sommerfeld_on_axis(hole);
    // The fixture's column carries the rounding of k z and k R to 2^-53, on a slope of 4 at most:
    // 3e-10 for k z = 5e5 rad; decimal arithmetic of 50 digits agrees with ours to 1e-14.
    const double turns = 2.0 * std::numbers::pi * (screen / wavelength);
    EXPECT_NEAR(exact, oracle::number(row.at("on_axis_rayleigh_sommerfeld")),
                8.0 * turns * 0x1p-53 + 1e-14)
        << row.at("d_mm");
    const CircularPsf psf(pinhole_pupil(diameter, screen), wavelength);
    EXPECT_NEAR(psf.intensity_over_incident(Length{}), exact, 4.0 * psf.error().total());
  }
}

TEST(CircularPsf, AgreesWithEveryDefocusedLensOfTheFixture) {
  const nlohmann::json table = oracle::fixture("defocused_lens");
  ASSERT_FALSE(table.at("rows").empty());
  for (const nlohmann::json& row : table.at("rows")) {
    const double waves = row.at("W20_waves");
    const Length wavelength = oracle::millimetres(row.at("lambda_mm"));
    const Length screen = 50.0_mm;  // any: the PSF depends on z/a and U alone
    const Length radius = screen / (2.0 * row.at("working_f_number").get<double>());
    const CircularPupil pupil{.diameter = 2.0 * radius,
                              .image_distance = screen,
                              .defocus = 2.0 * waves * (wavelength / radius) / radius,
                              .has_lens = true};
    const CircularPsf psf(pupil, wavelength);
    const double scale = 1.0 + std::abs(waves);
    EXPECT_NEAR(psf.defocus(), oracle::number(row.at("U")), 1e-11 * scale);
    EXPECT_NEAR(defocus_waves(psf.defocus()), waves, 1e-14 * scale);
    EXPECT_NEAR(psf.geometric_diameter().si(), oracle::millimetres(row.at("coc_diameter_mm")).si(),
                1e-15);
    expect_profile(psf, row.at("profile"));
    EXPECT_EQ(row.size(), 7U);
  }
}

// Far from focus the light fills the disc of rays: its mean density, but for the rim and fringes.
TEST(CircularPsf, TendsToTheGeometricDisc) {
  const ThinLens lens{.focal_length = 50.0_mm, .f_number = 8.0};
  const CircularPsf psf(lens_pupil(lens, kInfinitelyFar, 1.0_m), 550.0_nm);
  ASSERT_EQ(psf.regime(), DiffractionRegime::geometric_shadow);
  const Length radius = psf.geometric_diameter() / 2.0;
  for (const double share : {0.3, 0.6, 0.9}) {
    // Fringes carry light to and fro over a third of their width, sqrt(pi/U) of the radius.
    EXPECT_NEAR(psf.encircled_energy(share * radius), share * share,
                2.0 * share * std::sqrt(std::numbers::pi / psf.defocus()) / 3.0)
        << share;
  }
  EXPECT_LT(1.0 - psf.encircled_energy(1.5 * radius), 0.01);
}

}  // namespace
}  // namespace fstop
