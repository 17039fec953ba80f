// Diffraction at an edge in depth: a straight occluder before a bright wall, point by point through
// the part of the pupil that each point sees.
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/optics/quadrature.h"
#include "core/optics/thin_lens.h"
#include "tests/physics/test_scenes.h"

namespace fstop {
namespace {

constexpr double kWavelength = 550e-9;

struct Case {
  double f_number = 22.0;
  double pitch = 10e-6;
  double occluder = 2.0;  // metres
  double wall = 6.0;
  double grey = 0.2;  // the occluder's radiance; the wall's is 1
};

// The image of a line of points along the occluder's edge through the pupil where x > cut (in
// units of its radius a), U and the upright picture's v along x, per unit of v and for unit light
// through the whole pupil:
//
//     1/(2 pi pi) integral over y of |integral over the chord, x > cut, of exp(i [U x^2/2 + v x])
//     dx|^2
//
// (Parseval across the edge). Gauss-Legendre: 48 chords, and points enough for the phase.
double line_spread(double v, double defocus, double cut) {
  static const QuadratureRule chords = gauss_legendre(48);
  const int count = 20 + static_cast<int>(1.2 * (std::abs(defocus) + std::abs(v)));
  static std::vector<QuadratureRule> rules(4096);
  QuadratureRule& rule = rules[static_cast<std::size_t>(count)];
  if (rule.nodes.empty()) rule = gauss_legendre(count);
  double sum = 0.0;
  for (std::size_t j = 0; j < chords.nodes.size(); ++j) {
    // y = sin(theta): chords end smoothly.
    const double theta = 0.5 * std::numbers::pi * chords.nodes[j];
    const double half = std::cos(theta);
    const double from = std::max(-half, cut);
    if (from >= half) continue;
    std::complex<double> amplitude = 0.0;
    for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
      const double x = 0.5 * (from + half) + 0.5 * (half - from) * rule.nodes[i];
      amplitude += rule.weights[i] * std::polar(1.0, 0.5 * defocus * x * x + v * x);
    }
    amplitude *= 0.5 * (half - from);
    sum += chords.weights[j] * 0.5 * std::numbers::pi * half * std::norm(amplitude);
  }
  return sum / (2.0 * std::numbers::pi * std::numbers::pi);
}

// The picture across the edge at pixels from -reach to reach, the edge on a pixel's border at 0.
std::vector<double> theory(const Case& c, int reach) {
  const double a = 0.050 / c.f_number / 2.0;
  const double z = image_distance(50.0_mm, 2.0_m).si();
  const double k = 2.0 * std::numbers::pi / kWavelength;
  const double wall_defocus = k * a * a * (1.0 / c.wall - 0.5);
  const double own_defocus = k * a * a * (1.0 / c.occluder - 0.5);
  const double v_per_px = k * a * c.pitch / z;
  // A wall point seen at x px sees the pupil from -x / hidden on.
  const double hidden = a * z * (1.0 / c.occluder - 1.0 / c.wall) / c.pitch;
  const int fine = 8;  // points of light and of the picture a pixel, midpoints
  const int halo = reach + 60;
  const auto spread = [&](double x, double source, double defocus, double cut) {
    return line_spread((x - source) * v_per_px, defocus, cut) * v_per_px;
  };
  std::vector<double> picture(static_cast<std::size_t>(2 * reach));
  // The whole pupil's spread depends on the distance alone: tabled at the midpoints' differences.
  const int span = (halo + reach + 1) * fine;
  std::vector<double> open_wall(static_cast<std::size_t>(2 * span + 1));
  std::vector<double> open_own(open_wall.size());
  for (int i = -span; i <= span; ++i) {
    const double x = static_cast<double>(i) / fine;
    open_wall[static_cast<std::size_t>(i + span)] = spread(x, 0.0, wall_defocus, -1.0);
    open_own[static_cast<std::size_t>(i + span)] = spread(x, 0.0, own_defocus, -1.0);
  }
  for (int s = -halo * fine; s < halo * fine; ++s) {
    const double source = (s + 0.5) / fine;
    const double cut = -source / hidden;
    for (int p = -reach * fine; p < reach * fine; ++p) {
      const auto entry = static_cast<std::size_t>(p - s + span);
      double value = source < 0.0 ? c.grey * open_own[entry] : 0.0;
      if (cut <= -1.0) {
        value += open_wall[entry];
      } else if (cut < 1.0) {
        value += spread((p + 0.5) / fine, source, wall_defocus, cut);
      }
      picture[static_cast<std::size_t>(p / fine + reach - (p < 0 && p % fine != 0 ? 1 : 0))] +=
          value / (fine * fine);
    }
  }
  return picture;
}

// Both planes far wider than the frame; the occluder covers x < 0.
Scene occluded_wall(const Case& c) {
  Scene scene = glowing_scene({glowing_quad({-1, -1, -c.wall}, {2, 0, 0}, {0, 2, 0}),
                               glowing_quad({-1, -1, -c.occluder}, {1, 0, 0}, {0, 2, 0})});
  const auto grey = static_cast<float>(c.grey);
  scene.materials.push_back(Material{.name = "grey", .emission = {.value = {grey, grey, grey}}});
  scene.objects[1].material = 1;
  return scene;
}

struct Outcome {
  double rmse = 0.0;   // of a row across the edge
  double bound = 0.0;  // the report's
};

Outcome outcome_of(SimulationSpec shot, const RayScene& scene, const char* method,
                   const std::vector<double>& exact) {
  shot.quality.method = method;
  WorkerPool workers(2);
  const Photograph photograph = simulate(shot, scene, {.workers = &workers});
  double squares = 0.0;
  for (int x = 0; x < shot.width; ++x) {
    const double off = static_cast<double>(photograph.color.at(x, shot.height / 2)[1]) -
                       exact[static_cast<std::size_t>(x)];
    squares += off * off / shot.width;
  }
  return {.rmse = std::sqrt(squares), .bound = photograph.report.error.upper_95};
}

TEST(WaveOcclusion, EdgeInDepthStaysWithinItsBound) {
  const int reach = 24;
  double wave_squares = 0.0;
  double ray_squares = 0.0;
  for (const Case& c : {Case{}, Case{.occluder = 1.0, .wall = 2.0}, Case{.pitch = 25e-6},
                        Case{.f_number = 16.0, .occluder = 1.4, .wall = 3.0},
                        Case{.f_number = 32.0, .occluder = 2.0, .wall = 20.0, .grey = 0.0}}) {
    SimulationSpec shot = lens_shot(c.f_number, Length::si(c.pitch), 2 * reach, 16);
    shot.quality.samples = 2048;
    shot.camera.monochromatic = true;
    const RayScene scene(occluded_wall(c));
    const std::vector<double> exact = theory(c, reach);
    const Outcome wave = outcome_of(shot, scene, "wave", exact);
    const Outcome rays = outcome_of(shot, scene, "lens-sampling", exact);
    std::printf("f/%.0f, %.0f um, %.1f m before %.1f m: wave %.4f (bound %.4f), rays %.4f\n",
                c.f_number, c.pitch * 1e6, c.occluder, c.wall, wave.rmse, wave.bound, rays.rmse);
    EXPECT_LT(wave.rmse, wave.bound);
    wave_squares += wave.rmse * wave.rmse;
    ray_squares += rays.rmse * rays.rmse;
  }
  // Over these cases, of which some are the worst there are, waves are nearer than rays.
  EXPECT_LT(wave_squares, ray_squares);
}

}  // namespace
}  // namespace fstop
