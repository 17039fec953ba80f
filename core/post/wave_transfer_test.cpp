#include "core/post/wave_transfer.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/astigmatic_otf.h"
#include "core/optics/polygon_otf.h"
#include "core/optics/transfer.h"

namespace fstop {
namespace {

constexpr Length kWavelength = Length::si(550e-9);
const ThinLens kLens{.focal_length = 50.0_mm, .f_number = 16.0};

WaveTransferSpec lens_spec(Length object_distance) {
  return {.pupil = lens_pupil(kLens, 2.0_m, object_distance),
          .light = {.monochromatic = true, .wavelength = kWavelength},
          .highest_frequency = 2e5,
          .tolerance = 1e-3};
}

double reduced(const CircularPupil& pupil, double frequency) {
  return frequency * kWavelength.si() * pupil.image_distance.si() / (0.5 * pupil.diameter.si());
}

// Linear interpolation of the table errs by 1e-4, single precision by less.
TEST(WaveTransfer, MonochromaticTableIsHopkinsIntegral) {
  for (const double distance : {2.0, 1.0, 0.4, 30.0}) {
    const WaveTransferSpec spec = lens_spec(Length::si(distance));
    const WaveTransfer transfer = wave_transfer(spec);
    ASSERT_EQ(transfer.terms.size(), 1U);
    EXPECT_EQ(transfer.wavelengths, 1);
    const DefocusOtf otf(reduced_defocus(spec.pupil, kWavelength));
    for (double nu = 0.0; nu < 1.5e5; nu += 731.0) {
      EXPECT_NEAR(transfer.tables[0][1](static_cast<float>(nu)), otf(reduced(spec.pupil, nu)),
                  1.5e-4)
          << distance << " m, " << nu << " per metre";
    }
  }
}

TEST(WaveTransfer, ScaleStretchesThePicture) {
  WaveTransferSpec spec = lens_spec(1.0_m);
  const WaveTransfer one = wave_transfer(spec);
  spec.scale = 0.8;
  const WaveTransfer smaller = wave_transfer(spec);
  EXPECT_NEAR(one.tables[0][0](8e3F), smaller.tables[0][0](1e4F), 3e-4);
}

TEST(WaveTransfer, BandsAreSumsOverWavelengthsWithinTheTolerance) {
  WaveTransferSpec spec = lens_spec(1.0_m);
  spec.light = {};
  const WaveTransfer transfer = wave_transfer(spec);
  EXPECT_LE(transfer.spectral_error, spec.tolerance);
  for (std::size_t c = 0; c < 3; ++c) {
    for (const double nu : {5e3, 2e4, 5e4}) {
      double sum = 0.0;
      for (const SpectralSample& sample : spectral_samples(SpectralBands::sensor, 256)) {
        const DefocusOtf otf(reduced_defocus(spec.pupil, sample.wavelength));
        const double s = nu * sample.wavelength.si() * spec.pupil.image_distance.si() /
                         (0.5 * spec.pupil.diameter.si());
        sum += sample.weight[c] * otf(s);
      }
      EXPECT_NEAR(transfer.tables[0][c](static_cast<float>(nu)), sum, spec.tolerance);
    }
  }
  const std::array<double, 3> mean = mean_wavelengths({});
  EXPECT_NEAR(mean[0], 600e-9, 1e-10);
  EXPECT_NEAR(mean[1], 540e-9, 1e-10);
  EXPECT_NEAR(mean[2], 465e-9, 1e-10);
}

// The fitted field terms against the oblique integral between the nodes they were fitted at.
TEST(WaveTransfer, FieldTermsAreThoseOfTheObliquePinhole) {
  for (const double diameter : {0.15e-3, 0.35e-3, 1e-3}) {
    WaveTransferSpec spec{.pupil = pinhole_pupil(Length::si(diameter), 50.0_mm),
                          .light = {.monochromatic = true, .wavelength = kWavelength},
                          .highest_frequency = 2e4,
                          .field_limit = 0.19,
                          .tolerance = 0.005};
    const WaveTransfer transfer = wave_transfer(spec);
    const double U = reduced_defocus(spec.pupil, kWavelength);
    double worst = 0.0;
    for (const double t : {0.02, 0.07, 0.13, 0.18}) {
      const double cosine = 1.0 / std::sqrt(1.0 + t);
      const AstigmaticOtf exact(U * std::pow(cosine, 3), U * cosine);
      for (const double psi : {0.0, 0.5, 1.1, 1.57}) {
        for (double nu = 100.0; nu < 1.5e4; nu += 531.0) {
          const double s = reduced(spec.pupil, nu);
          const double expected =
              exact({s * std::cos(psi) / std::pow(cosine, 3), s * std::sin(psi) / cosine});
          double found = 0.0;
          for (std::size_t k = 0; k < transfer.terms.size(); ++k) {
            const FieldTerm& term = transfer.terms[k];
            found += static_cast<double>(transfer.tables[k][1](static_cast<float>(nu))) *
                     std::pow(t, term.power) * std::cos(2.0 * term.harmonic * psi);
          }
          worst = std::max(worst, std::abs(found - expected));
        }
      }
    }
    std::printf("%.2f mm: %zu terms, error %.4f, stated %.4f\n", diameter * 1e3,
                transfer.terms.size(), worst, transfer.field_error);
    EXPECT_LE(worst, 1.5 * transfer.field_error + 1e-3);
    EXPECT_LE(transfer.field_error, 0.01);
  }
}

// 65 angles and linear interpolation; the upright picture has the conjugate.
TEST(WaveTransfer, BladedTableIsThePolygonsTransferTurnedRound) {
  WaveTransferSpec spec = lens_spec(1.2_m);
  spec.aperture = {.blades = 5, .rotation = 0.4};
  const WaveTransfer transfer = wave_transfer(spec);
  ASSERT_EQ(transfer.polygon.size(), 3U);
  const PolygonOtf exact(spec.aperture, reduced_defocus(spec.pupil, kWavelength));
  for (double angle = -3.0; angle < 3.2; angle += 0.37) {
    for (const double nu : {3e3, 1.1e4, 4e4, 9e4}) {
      const double s = reduced(spec.pupil, nu);
      const std::complex<double> expected =
          std::conj(exact({s * std::cos(angle), s * std::sin(angle)}));
      const std::complex<float> found = transfer.polygon[0](
          static_cast<float>(nu * std::cos(angle)), static_cast<float>(nu * std::sin(angle)));
      EXPECT_NEAR(found.real(), expected.real(), 1e-3) << angle << " rad, " << nu;
      EXPECT_NEAR(found.imag(), expected.imag(), 1e-3) << angle << " rad, " << nu;
    }
  }
}

TEST(WaveTransfer, RefusesWhatWavesAreNotValidFor) {
  WaveTransferSpec spec = lens_spec(1.0_m);
  spec.pupil = pinhole_pupil(Length::si(4e-6), 50.0_mm);
  EXPECT_THROW(wave_transfer(spec), Error);
}

}  // namespace
}  // namespace fstop
