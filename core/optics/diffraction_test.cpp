#include "core/optics/diffraction.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/circular_psf.h"
#include "core/optics/pinhole.h"
#include "core/optics/quadrature.h"
#include "core/optics/rayleigh_sommerfeld.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

// The fixture's own statement: 1e-12 absolute.
TEST(Airy, AgreesWithEveryRowOfTheFixture) {
  const nlohmann::json table = oracle::fixture("airy");
  ASSERT_FALSE(table.at("rows").empty());
  for (const nlohmann::json& row : table.at("rows")) {
    const double v = row.at("v");
    EXPECT_NEAR(airy_intensity(v), oracle::number(row.at("intensity")), 1e-12) << row.dump();
    EXPECT_NEAR(airy_encircled_energy(v), oracle::number(row.at("encircled_energy")), 1e-12);
    EXPECT_EQ(row.size(), 5U);  // s and mtf are read in transfer_test
  }
  EXPECT_EQ(airy_intensity(0.0), 1.0);
  EXPECT_EQ(airy_encircled_energy(0.0), 0.0);
}

std::string refusal_of(const CircularPupil& pupil, Length wavelength) {
  try {
    const CircularPsf psf(pupil, wavelength);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::outside_domain);
    return error.what();
  }
  return "";
}

TEST(WaveModel, RefusesBelowItsDomainWithTheReason) {
  EXPECT_EQ(refusal_of(pinhole_pupil(0.35_mm, 50.0_mm), 550.0_nm), "");
  EXPECT_NE(refusal_of(pinhole_pupil(5.4_um, 50.0_mm), 550.0_nm).find("5 wavelengths, got 4.91"),
            std::string::npos);
  EXPECT_EQ(refusal_of(pinhole_pupil(5.6_um, 50.0_mm), 550.0_nm), "");
  EXPECT_NE(refusal_of(pinhole_pupil(2.0_mm, 10.0_mm), 550.0_nm).find("too close behind the hole"),
            std::string::npos);
  // A point close before the hole bends the wave as a close screen does.
  EXPECT_NE(refusal_of(pinhole_pupil(2.0_mm, 50.0_mm, 10.0_mm), 550.0_nm).find("too close"),
            std::string::npos);
  const ThinLens fast{.focal_length = 50.0_mm, .f_number = 0.9};
  EXPECT_NE(refusal_of(lens_pupil(fast, kInfinitelyFar, 2.0_m), 550.0_nm).find("f-number"),
            std::string::npos);
  const ThinLens wide{.focal_length = 50.0_mm, .f_number = 1.4};
  EXPECT_NE(refusal_of(lens_pupil(wide, kInfinitelyFar, 0.3_m), 550.0_nm).find("defocus |U|"),
            std::string::npos);
}

TEST(WaveModel, RefusesWhatIsNoLength) {
  const Length nan = Length::si(std::numeric_limits<double>::quiet_NaN());
  for (const Length bad : {Length{}, -(1.0_mm), nan}) {
    EXPECT_THROW(pinhole_pupil(bad, 50.0_mm), Error);
    EXPECT_THROW(pinhole_pupil(0.3_mm, bad), Error);
    EXPECT_THROW(pinhole_pupil(0.3_mm, 50.0_mm, bad), Error);
    EXPECT_THROW(reduced_defocus(pinhole_pupil(0.3_mm, 50.0_mm), bad), Error);
    EXPECT_THROW(CircularPsf(pinhole_pupil(0.3_mm, 50.0_mm), bad), Error);
    EXPECT_THROW(lens_pupil({.focal_length = 50.0_mm, .f_number = 8.0}, 1.0_m, bad), Error);
    EXPECT_THROW(lens_pupil({.focal_length = 50.0_mm, .f_number = 8.0}, bad, 1.0_m), Error);
    EXPECT_NE(refusal_of(CircularPupil{.diameter = bad, .image_distance = 50.0_mm}, 550.0_nm), "");
    EXPECT_NE(refusal_of(CircularPupil{.diameter = 1.0_mm, .image_distance = bad}, 550.0_nm), "");
  }
  EXPECT_THROW(pinhole_pupil(kInfinitelyFar, 50.0_mm), Error);
  EXPECT_THROW(pinhole_pupil(0.3_mm, kInfinitelyFar), Error);
}

TEST(Regime, FollowsTheFresnelZones) {
  const auto regime_at = [](double zones) {
    return diffraction_regime(zones * 2.0 * std::numbers::pi);
  };
  EXPECT_EQ(regime_at(0.0), DiffractionRegime::fraunhofer);
  EXPECT_EQ(regime_at(-0.09), DiffractionRegime::fraunhofer);
  EXPECT_EQ(regime_at(1.0), DiffractionRegime::fresnel);
  EXPECT_EQ(regime_at(-33.0), DiffractionRegime::geometric_shadow);
  EXPECT_EQ(name_of(regime_at(33.0)), "geometric-shadow");
  // The textbook's series of holes at 50 mm crosses all three.
  EXPECT_EQ(CircularPsf(pinhole_pupil(2.0_mm, 50.0_mm), 600.0_nm).regime(),
            DiffractionRegime::geometric_shadow);
  EXPECT_EQ(CircularPsf(pinhole_pupil(0.35_mm, 50.0_mm), 600.0_nm).regime(),
            DiffractionRegime::fresnel);
  EXPECT_EQ(CircularPsf(pinhole_pupil(0.07_mm, 50.0_mm), 600.0_nm).regime(),
            DiffractionRegime::fraunhofer);
}

// A lens's defocus and its circle of confusion are one: the shadow's rim v = |U|.
TEST(LensPupil, ShadowIsTheCircleOfConfusion) {
  const ThinLens lens{.focal_length = 50.0_mm, .f_number = 16.0};
  for (const Length focus : {0.5_m, 2.0_m, kInfinitelyFar}) {
    for (const Length object : {0.4_m, 0.5_m, 3.0_m, kInfinitelyFar}) {
      const CircularPsf psf(lens_pupil(lens, focus, object), 550.0_nm);
      EXPECT_NEAR(psf.geometric_diameter().si(), circle_of_confusion(lens, focus, object).si(),
                  1e-16);
    }
  }
  EXPECT_EQ(reduced_defocus(lens_pupil(lens, kInfinitelyFar, kInfinitelyFar), 550.0_nm), 0.0);
}

// Relative L2 difference of two intensity profiles, weight rho drho, on the map's range.
double fresnel_error(double a, double zones) {
  const double z = a * a / zones;
  const RoundHole hole{.radius = Length::si(a), .distance = Length::si(z), .wavelength = 1.0_m};
  const double U = 2.0 * std::numbers::pi * zones;
  const DefocusField field(U);
  const double reach = 2.0 * a + 1.5 * z * std::min(1.0, 1.0 / a);
  const int count = 400;
  double difference = 0.0;
  double norm = 0.0;
  for (int i = 0; i < count; ++i) {
    const double rho = (i + 0.5) * reach / count;
    const double truth = rayleigh_sommerfeld_intensity(hole, Length::si(rho)).value;
    const double model = U * U * field.intensity(2.0 * std::numbers::pi * a * rho / z);
    difference += (model - truth) * (model - truth) * rho;
    norm += truth * truth * rho;
  }
  return std::sqrt(difference / norm);
}

// The stated bound against the map of measured errors, and that map against our own integral.
TEST(WaveModel, PinholeBoundHoldsOverTheMap) {
  int inside = 0;
  const nlohmann::json table = oracle::fixture("maps/fresnel_vs_rs");
  for (const nlohmann::json& row : table.at("rows")) {
    const double a = row.at("a_over_lambda");
    const double z = a * row.at("z_over_a").get<double>();
    const double zones = row.at("N_F");
    const CircularPupil pupil = pinhole_pupil(Length::si(2.0 * a), Length::si(z));
    const WaveModelError bound = wave_model_error(pupil, 1.0_m);
    if (a < 5.0 || bound.aberration >= 0.1) continue;
    ++inside;
    const double listed = row.at("relL2_fresnel");
    EXPECT_LE(listed, bound.total()) << row.dump();
    if (a > 100.0) continue;
    EXPECT_NEAR(fresnel_error(a, zones), listed, 0.03 * listed) << row.dump();
  }
  EXPECT_GE(inside, 20);
}

// Rayleigh and Sommerfeld's first integral for the sphere that a perfect lens makes, converging at
// `focus` behind a pupil of radius a; lengths in wavelengths. Intensity over that at the pupil.
double converging_wave(double a, double focus, double z, double rho, const QuadratureRule& radial,
                       int turns) {
  const double reference = std::sqrt(z * z + rho * rho);
  std::complex<double> sum = 0.0;
  for (std::size_t i = 0; i < radial.nodes.size(); ++i) {
    const double r = 0.5 * a * (1.0 + radial.nodes[i]);
    const double sphere = r * r / (std::sqrt(focus * focus + r * r) + focus);
    std::complex<double> ring = 0.0;
    for (int j = 0; j < turns; ++j) {
      const double extra = r * r - 2.0 * rho * r * std::cos(std::numbers::pi * (j + 0.5) / turns);
      const double R = std::sqrt(reference * reference + extra);
      const double phase = 2.0 * std::numbers::pi * (extra / (R + reference) - sphere);
      ring +=
          std::polar(z / (R * R), phase) * std::complex<double>(1.0 / R, -2.0 * std::numbers::pi);
    }
    sum += radial.weights[i] * r / turns * ring;
  }
  return std::norm(0.5 * a * sum);
}

// Relative L2 difference of the lens's intensity over the disc of rays and the rings about it.
double lens_error(double a, double z, double U) {
  const double defocus = U / (2.0 * std::numbers::pi * a * a);  // 1/z - 1/focus
  const double focus = 1.0 / (1.0 / z - defocus);
  const double scale = std::pow(2.0 * std::numbers::pi * a * a / z, 2);
  const double reach = std::abs(U) + 12.0;
  const QuadratureRule radial = gauss_legendre(60 + static_cast<int>(0.5 * (std::abs(U) + reach)));
  const DefocusField field(U);
  double difference = 0.0;
  double norm = 0.0;
  for (int i = 0; i < 60; ++i) {
    const double v = (i + 0.5) * reach / 60.0;
    const double rho = v * z / (2.0 * std::numbers::pi * a);
    const double truth =
        converging_wave(a, focus, z, rho, radial, 60 + static_cast<int>(1.3 * reach));
    difference += v * std::pow(truth - scale * field.intensity(v), 2);
    norm += v * truth * truth;
  }
  return std::sqrt(difference / norm);
}

TEST(WaveModel, LensBoundHoldsAgainstTheSurfaceIntegral) {
  for (const double a : {20.0, 150.0}) {
    for (const double f_number : {1.2, 2.0, 5.6, 16.0}) {
      for (const double waves : {0.0, 0.35, 1.0, 5.0, -5.0}) {
        const double z = 2.0 * a * f_number;
        const double U = 4.0 * std::numbers::pi * waves;
        const Vergence defocus = Vergence::si(U / (2.0 * std::numbers::pi * a * a));
        if (z * defocus.si() > 0.8) continue;  // the sphere hardly converges: no lens does that
        const CircularPupil pupil{.diameter = Length::si(2.0 * a),
                                  .image_distance = Length::si(z),
                                  .defocus = defocus,
                                  .has_lens = true};
        const double bound = wave_model_error(pupil, 1.0_m).total();
        const double error = lens_error(a, z, U);
        EXPECT_LE(error, bound) << "a " << a << ", f/" << f_number << ", W20 " << waves;
        EXPECT_GE(error, bound / 6.0) << "a " << a << ", f/" << f_number << ", W20 " << waves;
      }
    }
  }
}

}  // namespace
}  // namespace fstop
