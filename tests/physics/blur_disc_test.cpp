// A point's blur disc, measured by second moments in the finished EXR.
#include <cmath>
#include <cstdio>
#include <numbers>

#include <gtest/gtest.h>

#include "core/optics/pinhole.h"
#include "core/optics/thin_lens.h"
#include "tests/physics/test_scenes.h"

namespace fstop {
namespace {

constexpr Length kPitch = Length::si(37.5e-6);  // 960 pixels on 36 mm
constexpr double kSourcePx = 6.0;               // width of the square that stands for a point

struct Moments {
  double energy = 0.0;       // sum of the red channel, pixels
  double mean_square = 0.0;  // of the distance from the centroid, px^2
};

Moments moments_of(const Image& image) {
  double sum = 0.0, x1 = 0.0, y1 = 0.0, r2 = 0.0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double value = image.at(x, y)[0];
      sum += value;
      x1 += value * (x + 0.5);
      y1 += value * (y + 0.5);
      r2 += value * (std::pow(x + 0.5, 2) + std::pow(y + 0.5, 2));
    }
  }
  return {.energy = sum, .mean_square = r2 / sum - std::pow(x1 / sum, 2) - std::pow(y1 / sum, 2)};
}

// What the disc or polygon alone has: the source's square and the pixel's box taken off.
double disc_mean_square(const Moments& moments) {
  return moments.mean_square - kSourcePx * kSourcePx / 6.0 - 1.0 / 6.0;
}

// Diameter of the disc with the pupil's area, from the mean square radius of its outline as the
// literature gives it: R^2/2 for a disc, R^2 (2 + cos(2 pi/n))/6 for an n-gon of circumradius R
// with the disc's area, pi r^2 = (n/2) R^2 sin(2 pi/n).
double diameter_from(double mean_square, int blades) {
  if (blades == 0) return 2.0 * std::sqrt(2.0 * mean_square);
  const double sector = 2.0 * std::numbers::pi / blades;
  const double circumradius = std::sqrt(6.0 * mean_square / (2.0 + std::cos(sector)));
  return 2.0 * circumradius * std::sqrt(std::sin(sector) / sector);
}

struct DiscCase {
  double coc_px;
  Length depth;
  int blades;
  bool breathing;
};

// The f-number that blurs `depth` to `coc_px`, by similar triangles.
SimulationSpec shot_with_disc(const DiscCase& disc) {
  const int size = 2 * static_cast<int>(0.75 * disc.coc_px + 12.0);
  SimulationSpec shot = lens_shot(1.0, kPitch, size, size);
  shot.camera.breathing = disc.breathing;
  auto& lens = std::get<LensSpec>(shot.camera.optics);
  const double v = disc.breathing ? 1.0 / (1.0 / 0.050 - 1.0 / 2.0) : 0.050;
  const double blur = std::abs(1.0 / 2.0 - 1.0 / disc.depth.si()) * v;  // per metre of pupil
  lens.lens.f_number = 0.050 * blur / (disc.coc_px * kPitch.si());
  lens.aperture = {.blades = disc.blades, .rotation = 0.3};
  shot.quality.samples = 2048;
  shot.effects.defocus = EffectChoice::on;
  shot.effects.diffraction = EffectChoice::off;  // its moments grow with the window
  return shot;
}

// Tolerance 0.5 %, as promised. Its parts: a pixel in the disc is an average of 2,048 scrambled net
// points whose own error is below 1 % of the peak; the moment sums over 50 to 5,000 such pixels,
// which leaves under 0.2 % of the mean square, half of that in the diameter.
TEST(BlurDisc, DiameterIsTheCircleOfConfusion) {
  double worst = 0.0;
  for (const double coc_px : {8.0, 20.0, 45.0, 80.0}) {
    for (const Length depth : {1.2_m, 5.0_m}) {
      for (const int blades : {0, 5, 8}) {
        for (const bool breathing : {true, false}) {
          const SimulationSpec shot = shot_with_disc({coc_px, depth, blades, breathing});
          const RayScene scene(glowing_scene({glowing_square(shot, depth, kSourcePx)}));
          const Moments moments = moments_of(finished_exr(shot, scene));
          const double diameter = diameter_from(disc_mean_square(moments), blades);
          worst = std::max(worst, std::abs(diameter / coc_px - 1.0));
          EXPECT_NEAR(diameter / coc_px, 1.0, 0.005)
              << coc_px << " px, depth " << depth.si() << " m, blades " << blades
              << (breathing ? ", breathing" : ", fixed sensor");
        }
      }
    }
  }
  std::printf("worst relative error of a disc's diameter: %.5f\n", worst);
}

TEST(BlurDisc, PinholeImagesAFarPointToADiscOfItsOwnDiameter) {
  for (const double diameter_mm : {0.4, 1.0, 2.5}) {
    const Length hole = Length::si(diameter_mm / 1e3);
    const double expected_px = hole / kPitch;
    const int size = 2 * static_cast<int>(0.75 * expected_px + 12.0);
    SimulationSpec shot = pinhole_shot(hole, kPitch, size, size);
    shot.effects.diffraction = EffectChoice::off;  // the shadow that rays give
    shot.quality.samples = 2048;
    shot.effects.diffraction = EffectChoice::off;
    const Length far = 1000.0_m;  // the disc is D (1 + 50 mm / 1 km)
    const RayScene scene(glowing_scene({glowing_square(shot, far, kSourcePx)}));
    const double diameter =
        diameter_from(disc_mean_square(moments_of(finished_exr(shot, scene))), 0);
    std::printf("hole of %.1f mm: disc %.3f px, expected %.3f px\n", diameter_mm, diameter,
                expected_px);
    EXPECT_NEAR(diameter / expected_px, 1.0, 0.005) << diameter_mm << " mm";
  }
}

// The disc's energy is the source's radiance times its area, whatever the pupil.
// Tolerance 0.2 %, as promised: 4,096 net points in each of the disc's pixels.
TEST(BlurDisc, EnergyIsConstantUnderRelativeExposure) {
  const Length depth = 4.0_m;
  for (const double f_number : {1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0}) {
    SimulationSpec shot = lens_shot(f_number, kPitch, 96, 96);
    shot.quality.samples = 4096;
    const RayScene scene(glowing_scene({glowing_square(shot, depth, kSourcePx)}));
    const double energy = moments_of(finished_exr(shot, scene)).energy;
    std::printf("f/%.1f: energy %.5f of %.5f px\n", f_number, energy, kSourcePx * kSourcePx);
    EXPECT_NEAR(energy / (kSourcePx * kSourcePx), 1.0, 0.002) << "f/" << f_number;
  }
}

TEST(BlurDisc, EnergyFollowsTheWorkingFNumberUnderIsoExposure) {
  const Length depth = 4.0_m;
  for (const double f_number : {1.4, 2.8, 5.6, 11.0, 22.0}) {
    SimulationSpec shot = lens_shot(f_number, kPitch, 96, 96);
    shot.quality.samples = 4096;
    shot.camera.exposure = IsoExposure{.iso = 200.0};
    shot.camera.shutter_seconds = 1.0 / 60.0;
    const RayScene scene(glowing_scene({glowing_square(shot, depth, kSourcePx)}));
    const double energy = moments_of(finished_exr(shot, scene)).energy;
    // N_w = N s/(s - f); the factor is 8000 t (ISO/100)/N_w^2.
    const double working = f_number * 2.0 / (2.0 - 0.050);
    const double expected = kSourcePx * kSourcePx * 8000.0 / 60.0 * 2.0 / (working * working);
    EXPECT_NEAR(energy / expected, 1.0, 0.002) << "f/" << f_number;
  }
}

TEST(BlurDisc, FarDiscShowsItsFirstVertexWhereTheRotationSays) {
  // A triangle, first vertex at 0 rad: towards +x, so the disc of a far point reaches furthest
  // to the right; in front of the focused plane it is turned round.
  for (const bool far : {true, false}) {
    DiscCase disc{.coc_px = 40.0, .depth = far ? 5.0_m : 1.2_m, .blades = 3, .breathing = true};
    SimulationSpec shot = shot_with_disc(disc);
    std::get<LensSpec>(shot.camera.optics).aperture.rotation = 0.0;
    const RayScene scene(glowing_scene({glowing_square(shot, disc.depth, kSourcePx)}));
    const Image image = finished_exr(shot, scene);
    int left = image.width(), right = 0;
    for (int x = 0; x < image.width(); ++x) {
      for (int y = 0; y < image.height(); ++y) {
        if (image.at(x, y)[0] == 0.0F) continue;
        left = std::min(left, x);
        right = std::max(right, x);
      }
    }
    const double to_right = right + 1 - image.width() / 2.0;
    const double to_left = image.width() / 2.0 - left;
    EXPECT_GT(far ? to_right : to_left, 1.4 * (far ? to_left : to_right));
  }
}

}  // namespace
}  // namespace fstop
