#include "core/optics/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/circular_psf.h"
#include "core/optics/transfer.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

std::vector<double> radii_up_to(double largest, int count) {
  std::vector<double> radii;
  for (int i = 0; i < count; ++i) radii.push_back(largest * i / (count - 1));
  return radii;
}

// The observer's own landmarks: y peaks at 1 near 555 nm; equal energy is white, x = y = z = 1/3.
TEST(Spectrum, ObserverHasItsLandmarks) {
  std::array<double, 3> sum = {};
  double brightest = 0.0;
  double at = 0.0;
  for (double nm = 360.0; nm <= 780.0; nm += 0.5) {
    const std::array<double, 3> xyz = colour_matching(Length::si(nm * 1e-9));
    for (std::size_t c = 0; c < 3; ++c) sum[c] += 0.5 * xyz[c];
    if (xyz[1] > brightest) {
      brightest = xyz[1];
      at = nm;
    }
  }
  // The fit's stated deviations are below 1 % of the integral; CIE's is 106.857 each.
  for (const double integral : sum) EXPECT_NEAR(integral, 106.857, 1.1);
  EXPECT_NEAR(brightest, 1.0, 0.01);
  EXPECT_NEAR(at, 555.0, 5.0);
}

TEST(Spectrum, WeightsAddUpToOneInEveryChannel) {
  for (const SpectralBands bands : {SpectralBands::sensor, SpectralBands::cie_1931}) {
    for (const int intervals : {4, 7, 32, 400}) {
      const std::vector<SpectralSample> samples = spectral_samples(bands, intervals);
      ASSERT_EQ(samples.size(), static_cast<std::size_t>(intervals) + 1U);
      std::array<double, 3> total = {};
      for (const SpectralSample& sample : samples) {
        for (std::size_t c = 0; c < 3; ++c) {
          total[c] += sample.weight[c];
          const double least = bands == SpectralBands::sensor ? 0.0 : -1.0;
          EXPECT_GE(sample.weight[c], least);
        }
      }
      for (const double t : total) EXPECT_NEAR(t, 1.0, 1e-14);
    }
  }
}

TEST(Spectrum, ChannelsPeakWhereTheBandsAreSaid) {
  EXPECT_EQ(channel_response(SpectralBands::sensor, 600.0_nm)[0], 1.0);
  EXPECT_NEAR(channel_response(SpectralBands::sensor, 640.0_nm)[0], 0.5, 1e-12);
  EXPECT_NEAR(channel_response(SpectralBands::sensor, 497.5_nm)[1], 0.5, 1e-12);
  EXPECT_NEAR(channel_response(SpectralBands::sensor, 435.0_nm)[2], 0.5, 1e-12);
  EXPECT_LT(channel_response(SpectralBands::cie_1931, 500.0_nm)[0], 0.0);
  EXPECT_EQ(channel_response(SpectralBands::sensor, 800.0_nm)[0], 0.0);
  EXPECT_EQ(channel_response(SpectralBands::sensor, 300.0_nm)[2], 0.0);
}

// White light fills the axis where green light alone leaves it black: the map's photopic column.
// Its band is not ours to the last digit: 0.002 of the largest value, 4.
TEST(Spectrum, PhotopicAxisFollowsTheMap) {
  const nlohmann::json table = oracle::fixture("maps/polychromatic");
  ASSERT_GE(table.at("rows").size(), 6U);
  for (const nlohmann::json& row : table.at("rows")) {
    const std::string name = row.at("case");
    const double c = std::stod(name.substr(name.find('=') + 1));
    double sum = 0.0;
    double weight = 0.0;
    double otf_error = 0.0;
    for (double nm = 380.0; nm <= 780.0; nm += 2.0) {
      const double y = colour_matching(Length::si(nm * 1e-9))[1];
      const double zones = 0.25 * c * c * 550.0 / nm;
      sum += y * 4.0 * std::pow(std::sin(0.5 * std::numbers::pi * zones), 2);
      weight += y;
    }
    EXPECT_NEAR(sum / weight, oracle::number(row.at("on_axis_over_incident_photopic")), 0.002)
        << name;
    // 550 nm alone against the band, on a fixed grid of frequencies up to 2/sqrt(550 nm f'), where
    // the map's figures end.
    const double step = std::min(2.0, 4.0 / c) / 60.0;
    const DefocusOtf green(0.5 * std::numbers::pi * c * c);
    const int count = 60;
    std::vector<double> band(count, 0.0);
    for (double nm = 400.0; nm <= 720.0; nm += 4.0) {
      const double y = colour_matching(Length::si(nm * 1e-9))[1];
      const DefocusOtf otf(0.5 * std::numbers::pi * c * c * 550.0 / nm);
      for (int i = 0; i < count; ++i) {
        band[static_cast<std::size_t>(i)] += y * otf(step * i * nm / 550.0);
      }
    }
    for (int i = 0; i < count; ++i) {
      const double mean = band[static_cast<std::size_t>(i)] / band[0];
      otf_error = std::max(otf_error, std::abs(mean - green(step * i)));
    }
    EXPECT_NEAR(otf_error, oracle::number(row.at("max_otf_err_550")), 0.001) << name;
  }
}

// The reported change bounds what a far finer sum still changes.
TEST(Spectrum, ErrorBudgetIsKept) {
  const std::vector<double> radii = radii_up_to(1.2e-3, 200);
  for (const Length diameter : {0.07_mm, 0.35_mm, 1.0_mm, 2.0_mm}) {
    const CircularPupil hole = pinhole_pupil(diameter, 50.0_mm);
    for (const SpectralBands bands : {SpectralBands::sensor, SpectralBands::cie_1931}) {
      const PolychromaticProfile fine = polychromatic_profile(hole, bands, radii, 1e-6);
      int wavelengths = 0;
      for (const double tolerance : {0.05, 0.003, 1e-4}) {
        const PolychromaticProfile profile = polychromatic_profile(hole, bands, radii, tolerance);
        EXPECT_LE(profile.spectral_error, tolerance);
        EXPECT_GE(profile.wavelengths, wavelengths);
        wavelengths = profile.wavelengths;
        for (std::size_t c = 0; c < 3; ++c) {
          double peak = 0.0;
          double error = 0.0;
          for (std::size_t i = 0; i < radii.size(); ++i) {
            peak = std::max(peak, std::abs(fine.density[i][c]));
            error = std::max(error, std::abs(fine.density[i][c] - profile.density[i][c]));
          }
          EXPECT_LE(error / peak, profile.spectral_error + 1e-6)
              << diameter.si() << " channel " << c;
        }
      }
    }
  }
}

// Every wavelength carries the same light: the encircled energy of the sum tends to 1 as the single
// wavelengths' does.
TEST(Spectrum, ChannelsHaveUnitEnergy) {
  const CircularPupil hole = pinhole_pupil(0.35_mm, 50.0_mm);
  const double reach = 4e-3;
  const int count = 8001;
  const std::vector<double> radii = radii_up_to(reach, count);
  const PolychromaticProfile profile =
      polychromatic_profile(hole, SpectralBands::sensor, radii, 1e-4);
  const double step = reach / (count - 1);
  const std::array<double, 3> centre = {600e-9, 540e-9, 465e-9};
  for (std::size_t c = 0; c < 3; ++c) {
    double energy = 0.0;
    for (std::size_t i = 0; i < radii.size(); ++i) {
      energy += 2.0 * std::numbers::pi * radii[i] * profile.density[i][c] * step *
                (i + 1 == radii.size() ? 0.5 : 1.0);
    }
    // The tail 2/(pi v) is proportional to the wavelength: its mean is the band's centre.
    const CircularPsf psf(hole, Length::si(centre[c]));
    EXPECT_NEAR(energy, psf.encircled_energy(Length::si(reach)), 2e-4) << c;
  }
}

TEST(Spectrum, RefusesWhatItCannotCompute) {
  const CircularPupil hole = pinhole_pupil(0.35_mm, 50.0_mm);
  const std::vector<double> radii = {0.0, 1e-4};
  const std::vector<double> negative = {0.0, -1e-4};
  for (const double bad : {0.0, -1.0, 1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(polychromatic_profile(hole, SpectralBands::sensor, radii, bad), Error);
  }
  EXPECT_THROW(polychromatic_profile(hole, SpectralBands::sensor, negative, 0.01), Error);
  EXPECT_THROW(polychromatic_profile(hole, SpectralBands::sensor, {}, 0.01), Error);
  EXPECT_THROW(spectral_samples(SpectralBands::sensor, 3), Error);
  EXPECT_THROW(spectral_samples(SpectralBands::sensor, 5000), Error);
  // 5 wavelengths of 360 nm are 3.6 um across, of 780 nm 7.8 um: the longest decides.
  EXPECT_THROW(
      polychromatic_profile(pinhole_pupil(7.0_um, 50.0_mm), SpectralBands::sensor, radii, 0.01),
      Error);
}

}  // namespace
}  // namespace fstop
