// Edges and sinusoids through the wave method: measured transfer against Hopkins' integral.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <gtest/gtest.h>

#include "core/measure/slanted_edge.h"
#include "core/measure/star_contrast.h"
#include "core/optics/diffraction.h"
#include "core/optics/transfer.h"
#include "tests/physics/test_scenes.h"

namespace fstop {
namespace {

constexpr double kFNumber = 16.0;
constexpr double kPupilRadius = 0.050 / kFNumber / 2.0;
constexpr double kWavelength = 550e-9;

// Where a point has W20 waves of defocus for a lens focused at 2 m: W20 = a^2 (1/u - 1/s)/(2
// lambda).
double distance_of(double waves) {
  return 1.0 / (0.5 + waves * 2.0 * kWavelength / (kPupilRadius * kPupilRadius));
}

SimulationSpec wave_shot(double pitch, int size, int samples) {
  SimulationSpec shot = lens_shot(kFNumber, Length::si(pitch), size, size);
  shot.quality.method = "wave";
  shot.quality.max_error = 0.002;
  shot.quality.samples = samples;
  shot.effects.diffraction = EffectChoice::on;
  shot.camera.monochromatic = true;
  return shot;
}

// H at `frequency` cycles per pixel.
double hopkins(double waves, double frequency, double pitch) {
  const DefocusOtf otf(4.0 * std::numbers::pi * waves);
  const double z = image_distance(50.0_mm, 2.0_m).si();
  return otf(frequency / pitch * kWavelength * z / kPupilRadius);
}

double box(double x) {
  const double t = std::numbers::pi * x;
  return std::abs(t) < 1e-9 ? 1.0 : std::sin(t) / t;
}

// Bright where x cos + y sin > 0 (raster, y down), far over the frame.
Scene slanted_edge(double depth, double slant) {
  const Vec3 along{-std::sin(slant), -std::cos(slant), 0.0};
  const Vec3 across{std::cos(slant), -std::sin(slant), 0.0};
  const Vec3 corner = Vec3{0.0, 0.0, -depth} - along * 0.5;
  return glowing_scene({glowing_quad(corner, along * 1.0, across * 0.5)});
}

// Tolerance 0.01 as promised; the slanted edge itself measures to 5e-4.
TEST(WaveTransfer, SlantedEdgeHasHopkinsTransferUpToNyquist) {
  const double slant = 5.0 * std::numbers::pi / 180.0;
  for (const double pitch : {3e-6, 6e-6}) {
    for (const double waves : {0.0, 0.35, 1.0, 5.0}) {
      const SimulationSpec shot = wave_shot(pitch, 224, 64);
      const double depth = waves == 0.0 ? 2.0 : distance_of(waves);
      const RayScene scene(slanted_edge(depth, slant));
      const Image image = finished_exr(shot, scene);
      const SlantedEdge edge = measured_slanted_edge(
          image.view(), {.region = {.x = 8, .y = 8, .width = 208, .height = 208},
                         .channel = 1,
                         .levels = EdgeLevels{.dark = 0.0, .bright = 1.0}});
      double worst = 0.0;
      for (int i = 2; i <= 50; ++i) {
        const double nu = i / 100.0;
        const double theory =
            hopkins(waves, nu, pitch) * box(nu * std::cos(slant)) * box(nu * std::sin(slant));
        const double measured = transfer(edge.line_spread, nu).real();
        worst = std::max(worst, std::abs(measured - theory));
      }
      std::printf("edge, %.0f um, %.2f waves: worst %.4f of the transfer\n", pitch * 1e6, waves,
                  worst);
      EXPECT_LT(worst, 0.01) << pitch << " m, " << waves << " waves";
    }
  }
}

// A sinusoidal star of 36 cycles as a texture on a card that fills the frame and its surroundings.
constexpr int kCycles = 36;
constexpr double kMean = 0.5;
constexpr double kAmplitude = 0.4;

Scene star_card(const SimulationSpec& shot, double depth) {
  constexpr int kTexels = 2048;
  Scene scene;
  TextureSource texture{
      .name = "star", .filter = TextureFilter::bilinear, .image = Image(kTexels, kTexels, 3)};
  for (int y = 0; y < kTexels; ++y) {
    for (int x = 0; x < kTexels; ++x) {
      const double phi = std::atan2(-(y + 0.5 - kTexels / 2), x + 0.5 - kTexels / 2);
      const double value = kMean + kAmplitude * std::cos(kCycles * phi);
      for (int c = 0; c < 3; ++c) texture.image.at(x, y)[c] = static_cast<float>(value);
    }
  }
  scene.textures = {std::move(texture)};
  scene.materials = {Material{.emission = {.value = {1, 1, 1}, .texture = 0}}};
  const double pitch = (shot.camera.sensor_width / shot.width).si();
  // Twice the frame: its guard is card too.
  const double side = 2.0 * shot.width * pitch * depth / sensor_distance(shot.camera).si();
  scene.objects = {{.shape = QuadObject{.corner = {-side / 2, -side / 2, -depth},
                                        .edge_u = {side, 0, 0},
                                        .edge_v = {0, side, 0}}}};
  return scene;
}

// Spurious resolution: behind a defocused lens the star's contrast is reversed where H is negative.
// Tolerance 0.01 as promised: 2,048 texels over twice the frame, bilinear, and rings of 2 px cost
// under 0.002.
TEST(WaveTransfer, SinusoidalStarReversesWhereHopkinsSays) {
  const double pitch = 6e-6;
  for (const double waves : {1.5, 2.5, 5.0}) {
    const SimulationSpec shot = wave_shot(pitch, 256, 64);
    const double depth = distance_of(waves);
    const RayScene scene(star_card(shot, depth));
    const Image image = finished_exr(shot, scene);
    double worst = 0.0;
    double lowest = 1.0;
    for (const double radius : {24.0, 32.0, 40.0, 50.0, 60.0, 70.0, 80.0, 100.0, 120.0}) {
      const StarContrast ring = star_contrast(
          image.view(), 1,
          {.centre = {128.0, 128.0}, .cycles = kCycles, .mean = kMean, .amplitude = kAmplitude},
          radius);
      const double theory =
          hopkins(waves, ring.frequency, pitch) * std::pow(box(ring.frequency / std::sqrt(2.0)), 2);
      lowest = std::min(lowest, ring.modulation);
      worst = std::max(worst, std::abs(ring.modulation - theory));
      EXPECT_NEAR(ring.modulation, theory, 0.01) << waves << " waves, " << radius << " px";
    }
    std::printf("star, %.2f waves: worst %.4f of the contrast, lowest %.4f\n", waves, worst,
                lowest);
    // Twice the tolerance, so that the sign is shown.
    EXPECT_LT(lowest, -0.02) << "no contrast is reversed at " << waves << " waves";
  }
}

}  // namespace
}  // namespace fstop
