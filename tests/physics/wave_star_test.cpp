// Point lights through the wave method: their profiles, energies and places against theory.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>

#include "core/optics/circular_psf.h"
#include "core/optics/oblique_pinhole.h"
#include "core/optics/polygon_psf.h"
#include "core/optics/quadrature.h"
#include "core/optics/spectrum.h"
#include "tests/physics/test_scenes.h"

namespace fstop {
namespace {

constexpr double kStarDistance = 1000.0;  // metres
constexpr double kNear = 60.0;

// A square star seen at raster (x, y), `side_px` wide, at `distance` along the axis.
Object star(const SimulationSpec& shot, double x, double y, double side_px,
            double distance = kStarDistance) {
  const double pitch = (shot.camera.sensor_width / shot.width).si();
  const double scale = pitch * distance / sensor_distance(shot.camera).si();
  const double side = side_px * scale;
  const Vec3 centre{(x - 0.5 * shot.width) * scale, -(y - 0.5 * shot.height) * scale, -distance};
  return glowing_quad(centre - Vec3{side / 2, side / 2, 0.0}, {side, 0, 0}, {0, side, 0});
}

SimulationSpec wave_shot(SimulationSpec shot, int samples, bool monochromatic = true) {
  shot.quality.method = "wave";
  shot.quality.samples = samples;
  shot.effects.diffraction = EffectChoice::on;
  shot.camera.monochromatic = monochromatic;
  return shot;
}

// Where a star stands and how large it is, in pixels of the frame.
struct StarPlace {
  double x = 0.0;
  double y = 0.0;
  double side = 1.0;
};

struct Comparison {
  double worst = 0.0;   // largest difference over the theory's largest value
  double energy = 0.0;  // of the picture over the theory's inside the window
};

// `density(dx, dy)`: energy per square pixel at (dx, dy) pixels from the star. Theory averages it
// over the pixel's and the star's boxes by Gauss-Legendre's `points` within kNear pixels,
// where it is above a thousandth of the peak. Only pixels within `window` of the star are compared.
Comparison compared(const Image& image, int channel, const StarPlace& place, double window,
                    const std::function<double(double, double)>& density, int points = 4) {
  Comparison result;
  double theory_sum = 0.0;
  double sum = 0.0;
  double peak = 0.0;
  const QuadratureRule rule = gauss_legendre(points);
  const auto average = [&](int x, int y) {
    double theory = 0.0;
    for (int n = 0; n < points * points * points * points; ++n) {
      double weight = place.side * place.side;
      std::array<double, 4> at = {};
      int rest = n;
      for (double& node : at) {
        const auto k = static_cast<std::size_t>(rest % points);
        node = 0.5 * rule.nodes[k];
        weight *= 0.5 * rule.weights[k];
        rest /= points;
      }
      theory += weight * density(x + 0.5 + at[0] - place.x - at[2] * place.side,
                                 y + 0.5 + at[1] - place.y - at[3] * place.side);
    }
    return theory;
  };
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double dx = x + 0.5 - place.x;
      const double dy = y + 0.5 - place.y;
      if (std::max(std::abs(dx), std::abs(dy)) > window) continue;
      const double theory =
          std::hypot(dx, dy) < kNear ? average(x, y) : density(dx, dy) * place.side * place.side;
      const double value = static_cast<double>(image.at(x, y)[channel]);
      peak = std::max(peak, theory);
      result.worst = std::max(result.worst, std::abs(value - theory));
      theory_sum += theory;
      sum += value;
    }
  }
  result.worst /= peak;
  result.energy = sum / theory_sum;
  return result;
}

// Tolerances: 1 % of the peak and 0.2 % of the energy as promised; the star's own energy, from
// samples that fall on four square pixels, errs by under 0.1 %.
void expect_agreement(const Comparison& c, const char* what, double parameter) {
  std::printf("%s %g: worst %.4f of the peak, energy %.5f\n", what, parameter, c.worst, c.energy);
  EXPECT_LT(c.worst, 0.01) << what << " " << parameter;
  EXPECT_NEAR(c.energy, 1.0, 0.002) << what << " " << parameter;
}

std::function<double(double, double)> radial(const CircularPsf& psf, double pitch) {
  return [psf, pitch](double dx, double dy) {
    return psf.density(Length::si(std::hypot(dx, dy) * pitch)).si() * pitch * pitch;
  };
}

TEST(WaveStar, PinholeHasFresnelsProfile) {
  for (const double pitch_um : {10.0, 25.0}) {
    const double pitch = pitch_um / 1e6;
    const SimulationSpec shot = wave_shot(pinhole_shot(0.35_mm, Length::si(pitch), 160, 160), 1024);
    const StarPlace place{.x = 80.3, .y = 79.8, .side = 2.0};
    const RayScene scene(glowing_scene({star(shot, place.x, place.y, place.side)}));
    const CircularPsf psf(pinhole_pupil(0.35_mm, 50.0_mm, Length::si(kStarDistance)), 550.0_nm);
    expect_agreement(compared(finished_exr(shot, scene), 1, place, 160.0, radial(psf, pitch)),
                     "pinhole, um a pixel:", pitch_um);
  }
}

TEST(WaveStar, EveryChannelOfAPinholeHasItsBandsProfile) {
  const double pitch = 15e-6;
  const SimulationSpec shot =
      wave_shot(pinhole_shot(0.35_mm, Length::si(pitch), 128, 128), 1024, false);
  const StarPlace place{.x = 64.0, .y = 64.0, .side = 2.0};
  const RayScene scene(glowing_scene({star(shot, place.x, place.y, place.side)}));
  const Image image = finished_exr(shot, scene);
  std::vector<double> radii;
  for (int i = 0; i <= 2000; ++i) radii.push_back(i * 0.05 * pitch);
  const PolychromaticProfile profile =
      polychromatic_profile(pinhole_pupil(0.35_mm, 50.0_mm, Length::si(kStarDistance)),
                            SpectralBands::sensor, radii, 1e-4);
  for (std::size_t c = 0; c < 3; ++c) {
    const auto density = [&](double dx, double dy) {
      const double at = std::min(std::hypot(dx, dy) / 0.05, 1999.0);
      const auto i = static_cast<std::size_t>(at);
      const double share = at - static_cast<double>(i);
      return (profile.density[i][c] * (1.0 - share) + profile.density[i + 1][c] * share) * pitch *
             pitch;
    };
    expect_agreement(compared(image, static_cast<int>(c), place, 60.0, density), "channel",
                     static_cast<double>(c));
  }
}

TEST(WaveStar, ObliquePinholeIsAstigmatic) {
  // 20 degrees to the right of the axis: 18.2 mm off the centre of a wide screen.
  const double pitch = 25e-6;
  const double angle = 20.0 * std::numbers::pi / 180.0;
  const double offset = 0.050 * std::tan(angle) / pitch;
  const SimulationSpec shot = wave_shot(pinhole_shot(0.35_mm, Length::si(pitch), 1600, 96), 256);
  const StarPlace place{.x = 800.0 + std::round(offset), .y = 48.0, .side = 2.0};
  const RayScene scene(glowing_scene({star(shot, place.x, place.y, place.side)}));
  const double exact_angle = std::atan(std::round(offset) * pitch / 0.050);
  const ObliquePinholePsf psf(pinhole_pupil(0.35_mm, 50.0_mm, Length::si(kStarDistance)), 550.0_nm,
                              exact_angle, Length::si(80.0 * pitch));
  const Comparison c = compared(
      finished_exr(shot, scene), 1, place, 30.0,
      [&](double dx, double dy) {
        return psf.density(Length::si(dx * pitch), Length::si(dy * pitch)).si() * pitch * pitch;
      },
      3);  // the point spread is 12 pixels wide
  expect_agreement(c, "degrees off axis:", 20.0);
}

TEST(WaveStar, DefocusedLensHasLommelsProfile) {
  const double f_number = 16.0;
  const double radius = 0.050 / f_number / 2.0;
  for (const double waves : {0.35, 1.0, 5.0, -0.35, -1.0}) {
    // W20 = a^2 (1/u - 1/s)/(2 lambda)
    const double distance = 1.0 / (0.5 + waves * 2.0 * 550e-9 / (radius * radius));
    const double pitch = 6e-6;
    const SimulationSpec shot = wave_shot(lens_shot(f_number, Length::si(pitch), 160, 160), 1024);
    const StarPlace place{.x = 80.3, .y = 79.8, .side = 2.0};
    const RayScene scene(glowing_scene({star(shot, place.x, place.y, place.side, distance)}));
    const CircularPsf psf(
        lens_pupil({.focal_length = 50.0_mm, .f_number = f_number}, 2.0_m, Length::si(distance)),
        550.0_nm);
    EXPECT_NEAR(defocus_waves(psf.defocus()), waves, 1e-9);
    expect_agreement(compared(finished_exr(shot, scene), 1, place, 160.0, radial(psf, pitch)),
                     "lens, waves:", waves);
  }
}

// Blades, in focus and out of it: the odd number tells the picture from its mirror image.
TEST(WaveStar, BladedPupilHasItsStarburst) {
  const double f_number = 16.0;
  const double radius = 0.050 / f_number / 2.0;
  const double z = image_distance(50.0_mm, 2.0_m).si();
  for (const double waves : {0.0, 1.0, -0.8}) {
    const double distance = 1.0 / (0.5 + waves * 2.0 * 550e-9 / (radius * radius));
    const double pitch = 6e-6;
    SimulationSpec shot = wave_shot(lens_shot(f_number, Length::si(pitch), 128, 128), 1024);
    shot.quality.max_error = 0.005;
    const Aperture blades{.blades = 5, .rotation = 0.3};
    std::get<LensSpec>(shot.camera.optics).aperture = blades;
    const StarPlace place{.x = 64.3, .y = 63.8, .side = 2.0};
    const RayScene scene(glowing_scene({star(shot, place.x, place.y, place.side, distance)}));
    const PolygonPupil pupil(blades);
    const double defocus = 4.0 * std::numbers::pi * waves;
    const double q_per_px = 2.0 * std::numbers::pi / 550e-9 * radius * pitch / z;
    const auto density = [&](double dx, double dy) {
      // The picture is upright: the sensor's own image is turned round.
      const Vec2 q{-dx * q_per_px, -dy * q_per_px};
      return pupil.energy_scale() * pupil.intensity(q, defocus) * q_per_px * q_per_px;
    };
    expect_agreement(compared(finished_exr(shot, scene), 1, place, 25.0, density, 3),
                     "five blades, waves:", waves);
  }
}

// Light from all over the frame and far beyond: what diffraction and blur take from a uniform wall
// they give back, up to the frame's border.
TEST(WaveStar, UniformWallStaysUniform) {
  for (const double f_number : {4.0, 22.0, 64.0}) {
    for (const int blades : {0, 6}) {
      SimulationSpec shot = wave_shot(lens_shot(f_number, Length::si(20e-6), 96, 64), 16, false);
      std::get<LensSpec>(shot.camera.optics).aperture.blades = blades;
      const RayScene scene(glowing_scene({glowing_quad({-5, -5, -4}, {10, 0, 0}, {0, 10, 0})}));
      const Image image = finished_exr(shot, scene);
      const auto [low, high] = std::ranges::minmax_element(image.pixels());
      std::printf("wall at f/%.0f, %d blades: %.5f to %.5f\n", f_number, blades, double{*low},
                  double{*high});
      // A pixel on the border lacks 2 Q/(pi^3 g) of its light, g about 13 Q: 0.50 %, of red (600
      // nm) through six blades (a rim 1.05 times a disc's) 0.57 %; in a corner twice that.
      EXPECT_GT(*low, 0.988F);
      EXPECT_LT(*high, 1.002F);
    }
  }
}

}  // namespace
}  // namespace fstop
