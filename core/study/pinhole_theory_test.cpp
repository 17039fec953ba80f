#include "core/study/pinhole_theory.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/oblique_pinhole.h"
#include "core/optics/pinhole_figures.h"
#include "core/optics/spectrum.h"
#include "core/optics/transfer.h"

namespace fstop {
namespace {

constexpr Length kScreen = Length::si(0.050);

// One wavelength without a pixel: the dimensionless figures of pinhole_figures.h, which know the
// hole by c alone. With f_e = f'u/(f' + u), d = c sqrt(lambda f_e) and nu = figure
// sqrt(f_e/lambda)/f'. Tolerance: both search to 1e-9 of the frequency or better.
TEST(ChannelOtf, OneWavelengthIsThePinholeFigure) {
  for (const Length object : {0.4_m, 2.0_m, kInfinitelyFar}) {
    for (const double nanometres : {450.0, 550.0, 650.0}) {
      const Length wavelength = Length::si(nanometres / 1e9);
      const double screen = 1.0 / (1.0 / kScreen + 1.0 / object).si();
      for (const double c : {0.4, 1.0, 1.377, 1.778, 2.0, 3.0, 8.0}) {
        const Length diameter = Length::si(c * std::sqrt(wavelength.si() * screen));
        const ChannelOtf otf(pinhole_pupil(diameter, kScreen, object), {.wavelength = wavelength},
                             Length{});
        const double scale = std::sqrt(screen / wavelength.si()) / kScreen.si();
        for (const auto& [figure, contrast] :
             {std::pair{PinholeFigure::mtf50, 0.5}, {PinholeFigure::mtf10, 0.1}}) {
          const double expected = scale * figure_value(figure, c);
          EXPECT_NEAR(otf.frequency_of_contrast(contrast).si(), expected, 1e-7 * expected)
              << "c " << c << ", contrast " << contrast;
        }
      }
    }
  }
}

// The pixel's box multiplies: sinc(nu pitch), 0.9003 at a quarter of a cycle per pixel.
TEST(ChannelOtf, PixelsBoxMultiplies) {
  const CircularPupil pupil = pinhole_pupil(0.3_mm, kScreen);
  const ChannelOtf bare(pupil, {.wavelength = 550.0_nm}, Length{});
  const ChannelOtf boxed(pupil, {.wavelength = 550.0_nm}, 50.0_um);
  const Vec2 quarter{0.25 / 50e-6, 0.0};
  EXPECT_NEAR(boxed(quarter) / bare(quarter),
              std::sin(std::numbers::pi / 4) / (std::numbers::pi / 4), 1e-12);
  EXPECT_NEAR(boxed({}), 1.0, 1e-12);
}

// A channel is the mean of its wavelengths: against another rule, 600 intervals of the same bands.
// Tolerance: weights under 1e-9 are left out, 96 of them at most.
TEST(ChannelOtf, ChannelIsTheMeanOfItsWavelengths) {
  for (const Length diameter : {0.1_mm, 0.35_mm, 1.0_mm}) {
    const CircularPupil pupil = pinhole_pupil(diameter, kScreen, 2.0_m);
    for (int channel = 0; channel < 3; ++channel) {
      const ChannelOtf otf(pupil, {.channel = channel}, Length{});
      for (const double per_mm : {0.3, 1.0, 2.0, 4.0}) {
        double expected = 0.0;
        for (const SpectralSample& sample : spectral_samples(SpectralBands::sensor, 600)) {
          const double s = per_mm * 1e3 * sample.wavelength.si() * 0.1 / diameter.si();
          expected += sample.weight[static_cast<std::size_t>(channel)] *
                      DefocusOtf(reduced_defocus(pupil, sample.wavelength))(s);
        }
        EXPECT_NEAR(otf({0.0, per_mm * 1e3}), expected, 1e-6) << channel;
      }
    }
  }
}

// Large holes: the disc of rays, 2 J1(x)/x, x = pi nu D (1 + f'/u), whose contrast is 50 % at
// x = 2.2150. Tolerance: 0.165 W^(-3/4) of the OTF at W = N_F/2 = 18 waves, over the slope
// d(2 J1/x)/d ln x = -0.85 there: 2.3 %.
TEST(ChannelOtf, LargeHolesHaveTheDiscOfRays) {
  const ChannelOtf otf(pinhole_pupil(2.0_mm, kScreen, 2.0_m), {.channel = 1}, Length{});
  const double expected = 2.2150 / (std::numbers::pi * 2e-3 * 1.025);
  EXPECT_NEAR(otf.frequency_of_contrast(0.5).si(), expected, 0.023 * expected);
}

// Off axis: the transfer is the transform of the oblique point spread itself, summed over a square
// of 2.4 mm. Tolerance: beyond the square lies a share 2/(pi v) of the light, v = k a X/z = 47 at
// its nearest: 0.014, of which a wave of four periods and more across the square shows a tenth.
TEST(ChannelOtf, ObliqueTransferIsTheTransformOfTheObliqueSpread) {
  const CircularPupil pupil = pinhole_pupil(0.35_mm, kScreen);
  const Length wavelength = 550.0_nm;
  constexpr double kAngle = 0.35;  // radians
  const Vec2 direction{0.6, -0.8};
  const ChannelOtf otf(pupil, {.wavelength = wavelength}, Length{}, direction * std::tan(kAngle));
  const ObliquePinholePsf psf(pupil, wavelength, kAngle, 1.8_mm);
  constexpr double kHalf = 1.2e-3, kStep = 2e-5;  // metres
  for (const Vec2 nu : {Vec2{1500.0, 0.0}, Vec2{0.0, 1500.0}, Vec2{1800.0, 1800.0}}) {
    const double radial = nu.x * direction.x + nu.y * direction.y;
    const double across = nu.y * direction.x - nu.x * direction.y;
    double sum = 0.0;
    for (double x = -kHalf + kStep / 2; x < kHalf; x += kStep) {
      for (double y = -kHalf + kStep / 2; y < kHalf; y += kStep) {
        sum += psf.density(Length::si(x), Length::si(y)).si() *
               std::cos(2.0 * std::numbers::pi * (radial * x + across * y));
      }
    }
    EXPECT_NEAR(otf(nu), sum * kStep * kStep, 2e-3) << nu.x << ", " << nu.y;
  }
}

TEST(ChannelOtf, RefusesWhatIsOutside) {
  const CircularPupil pupil = pinhole_pupil(0.3_mm, kScreen);
  EXPECT_THROW(ChannelOtf(pupil, {.channel = 3}, Length{}), Error);
  EXPECT_THROW(ChannelOtf(pupil, {.channel = -1}, Length{}), Error);
  EXPECT_THROW(ChannelOtf(pupil, {}, Length::si(-1e-6)), Error);
  const CircularPupil lens = lens_pupil({.focal_length = 50.0_mm, .f_number = 8.0}, 2.0_m, 2.0_m);
  EXPECT_THROW(ChannelOtf(lens, {}, Length{}, {0.1, 0.0}), Error);
  EXPECT_THROW(ChannelOtf(pinhole_pupil(1.0_um, kScreen), {}, Length{}), Error);
  EXPECT_THROW(ChannelOtf(pupil, {}, Length{}).frequency_of_contrast(1.0), Error);
}

}  // namespace
}  // namespace fstop
