// Two derivations of every number: those of verification against core/optics.
#include "core/study/expected_optics.h"

#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/aperture.h"
#include "core/optics/depth_of_field.h"
#include "core/optics/diffraction.h"
#include "core/optics/exposure.h"
#include "core/optics/transfer.h"

namespace fstop {
namespace {

CameraSpec lens_camera(double f_mm, double f_number, Length focus) {
  CameraSpec camera;
  camera.optics = LensSpec{.lens = {.focal_length = Length::si(f_mm / 1e3), .f_number = f_number},
                           .focus_distance = focus};
  return camera;
}

const LensSpec& lens_of(const CameraSpec& camera) { return std::get<LensSpec>(camera.optics); }

// Tolerance: differences of nearly equal cones lose 1e-16 c/A relative to the pupil.
TEST(ExpectedOptics, BlurIsTheCircleOfConfusion) {
  for (const double f_mm : {24.0, 50.0, 200.0}) {
    for (const Length focus : {0.5_m, 2.0_m, 30.0_m, kInfinitelyFar}) {
      CameraSpec camera = lens_camera(f_mm, 2.8, focus);
      for (const Length object : {0.3_m, 1.0_m, 2.0_m, 7.0_m, kInfinitelyFar}) {
        const ThinLens& lens = lens_of(camera).lens;
        const double pupil = lens.focal_length.si() / 2.8;
        EXPECT_NEAR(expected_blur_diameter(camera, object).si(),
                    circle_of_confusion(lens, focus, object).si(), 1e-13 * pupil);
        CameraSpec fixed = camera;
        fixed.breathing = false;
        EXPECT_NEAR(expected_blur_diameter(fixed, object).si(),
                    abs(signed_circle_of_confusion(lens, focus, object, lens.focal_length)).si(),
                    1e-13 * pupil);
      }
    }
  }
}

TEST(ExpectedOptics, DepthOfFieldIsWhereTheDiscReachesTheLimit) {
  for (const Length focus : {0.5_m, 2.0_m, 30.0_m}) {
    for (const double limit_um : {5.0, 30.0}) {
      const CameraSpec camera = lens_camera(50.0, 4.0, focus);
      const Length limit = Length::si(limit_um * 1e-6);
      const ExpectedDepthOfField ends = expected_depth_of_field(camera, limit);
      const DepthOfField other = depth_of_field(lens_of(camera).lens, focus, limit);
      EXPECT_NEAR(ends.near / other.near, 1.0, 1e-10);
      EXPECT_EQ(is_finite(ends.far), is_finite(other.far));
      if (!is_finite(ends.far)) continue;
      EXPECT_NEAR(ends.far / other.far, 1.0, 1e-9);
    }
  }
  EXPECT_THROW(expected_depth_of_field(lens_camera(50.0, 4.0, 2.0_m), 1.0_m), Error);
}

TEST(ExpectedOptics, MagnificationAndExposureAreThoseOfTheThinLens) {
  for (const Length focus : {0.3_m, 2.0_m, kInfinitelyFar}) {
    CameraSpec camera = lens_camera(50.0, 2.8, focus);
    camera.shutter_seconds = 1.0 / 60.0;
    camera.exposure = IsoExposure{.iso = 400.0};
    const ThinLens& lens = lens_of(camera).lens;
    EXPECT_NEAR(expected_magnification(camera), std::abs(magnification(lens.focal_length, focus)),
                1e-13);
    EXPECT_NEAR(expected_exposure(camera) /
                    exposure_factor(1.0 / 60.0, 400.0, working_f_number(lens, focus)),
                1.0, 1e-12);
  }
}

TEST(ExpectedOptics, DiffractionIsTheRoundPupilsTransfer) {
  const CameraSpec camera = lens_camera(50.0, 16.0, 2.0_m);
  const CircularPupil pupil = lens_pupil(lens_of(camera).lens, 2.0_m, 2.0_m);
  const TransferFunction transfer = diffraction_transfer(camera);
  const double cut_off = expected_cut_off(camera).si();
  for (const double share : {0.0, 0.1, 0.5, 0.9, 1.0, 1.2}) {
    const double nu = share * cut_off;
    const double s =
        nu * camera.wavelength.si() * pupil.image_distance.si() / (0.5 * pupil.diameter.si());
    EXPECT_NEAR(transfer(nu), diffraction_mtf(s), 1e-12) << share;
  }
}

// Simpson's rule against Gauss-Legendre in another variable; 1e-6 is what its steps leave at most.
TEST(ExpectedOptics, PinholeIsHopkinsTransfer) {
  for (const double diameter_mm : {0.1, 0.23, 0.4, 1.0}) {
    CameraSpec camera;
    const Length diameter = Length::si(diameter_mm / 1e3);
    camera.optics = PinholeSpec{.image_distance = 50.0_mm, .diameter = diameter};
    const CircularPupil pupil = pinhole_pupil(diameter, 50.0_mm, 2.0_m);
    const DefocusOtf otf(reduced_defocus(pupil, camera.wavelength));
    const TransferFunction transfer = pinhole_transfer(camera, 2.0_m);
    for (const double per_mm : {0.0, 0.5, 2.0, 5.0, 12.0}) {
      const double s = per_mm * 1e3 * camera.wavelength.si() * 0.050 / (0.5 * pupil.diameter.si());
      EXPECT_NEAR(transfer(per_mm * 1e3), otf(s), 1e-6) << diameter_mm << " mm, " << per_mm;
    }
  }
}

// The n-th moment of a polygon, summed over small squares, against 2 R^n/((n+1)(n+2)).
TEST(ExpectedOptics, CornersFollowFromThePolygonsHarmonic) {
  for (const int blades : {3, 5, 8}) {
    const Length circumradius = expected_circumradius(2.0_m, blades);
    EXPECT_NEAR(circumradius.si(), aperture_circumradius({.blades = blades}), 1e-12);
    const std::vector<Vec2> corners = aperture_vertices({.blades = blades, .rotation = 0.3});
    const auto inside = [&](double x, double y) {
      for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec2 a = corners[i];
        const Vec2 b = corners[(i + 1) % corners.size()];
        if ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) < 0.0) return false;
      }
      return true;
    };
    std::complex<double> sum = 0.0;
    int count = 0;
    constexpr double kStep = 2e-3;
    for (double y = -1.6 + 0.5 * kStep; y < 1.6; y += kStep) {
      for (double x = -1.6 + 0.5 * kStep; x < 1.6; x += kStep) {
        if (!inside(x, y)) continue;
        sum += std::pow(std::complex(x, y), blades);
        ++count;
      }
    }
    const std::complex<double> mean = sum / static_cast<double>(count);
    const double expected =
        2.0 * std::pow(circumradius.si(), blades) / ((blades + 1.0) * (blades + 2.0));
    EXPECT_NEAR(std::abs(mean) / expected, 1.0, 5e-3) << blades;
    EXPECT_NEAR(std::remainder(std::arg(mean) / blades - 0.3, 2.0 * std::numbers::pi / blades), 0.0,
                1e-3)
        << blades;
  }
}

}  // namespace
}  // namespace fstop
