#include "core/render/coverage.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/optics/thin_lens.h"

namespace fstop {
namespace {

constexpr int kWidth = 128;
constexpr int kHeight = 32;
constexpr Length kPitch = Length::si(36e-3 / kWidth);
constexpr double kImageDistance = 1.0 / (1.0 / 0.050 - 1.0 / 2.0);  // metres, focused at 2 m

SimulationSpec shot(double f_number) {
  SimulationSpec spec;
  spec.camera.sensor_width = kPitch * double{kWidth};
  spec.camera.sensor_height = kPitch * double{kHeight};
  spec.camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = f_number}, .focus_distance = 2.0_m};
  spec.width = kWidth;
  spec.height = kHeight;
  spec.effects.diffraction = EffectChoice::off;
  spec.quality.method = "lens-sampling";
  spec.quality.samples = 1024;
  spec.outputs = {Output::color, Output::alpha};
  return spec;
}

// A black half plane right of `left` at `depth`: its colour tells nothing.
Scene half_plane(double depth, double left) {
  Scene scene;
  scene.materials = {Material{}};
  scene.objects = {
      {.shape = QuadObject{
           .corner = {left, -40.0, -depth}, .edge_u = {80.0, 0, 0}, .edge_v = {0, 80.0, 0}}}};
  scene.background = {0.2F, 0.5F, 0.1F};
  return scene;
}

Photograph photograph(const SimulationSpec& spec, const Scene& scene) {
  WorkerPool workers(2);
  RunControl run;
  run.workers = &workers;
  return simulate(spec, RayScene(scene), run);
}

double column_mean(const Image& image, int x) {
  double sum = 0.0;
  for (int y = 0; y < image.height(); ++y) sum += double{*image.at(x, y)};
  return sum / image.height();
}

// The share of a unit disc left of t is 1/2 + (t sqrt(1 - t^2) + asin t)/pi; this is its integral
// from -1: (segment areas, Zwillinger, CRC Standard Mathematical Tables).
double segment_integral(double t) {
  if (t <= -1.0) return 0.0;
  if (t >= 1.0) return t;
  const double root = std::sqrt(1.0 - t * t);
  return 0.5 * t + (root - root * root * root / 3.0 + t * std::asin(t)) / std::numbers::pi;
}

// Mean over the pixel [x, x + 1] of the coverage right of an edge at e, blurred by a disc of radius
// r, all in pixels.
double disc_coverage(double x, double e, double r) {
  return r * (segment_integral((x + 1.0 - e) / r) - segment_integral((x - e) / r));
}

// Defocused edges of foreground and background: columns' means of 32 x 1024 samples. Of each pixel
// the variance of samples is at most 1/4, so that three standard errors are 3 * 0.5/181 = 0.0083;
// nets do much better.
TEST(Coverage, ADefocusedEdgeIsTheDiscsSegment) {
  for (const double depth : {1.2, 8.0}) {
    const double radius =
        0.5 * (0.050 / 0.7) * kImageDistance * std::abs(1.0 / 2.0 - 1.0 / depth) / kPitch.si();
    const Photograph made = photograph(shot(0.7), half_plane(depth, 0.03));
    const double edge = kWidth / 2.0 + 0.03 * kImageDistance / depth / kPitch.si();
    ASSERT_GT(radius, 2.0);
    const Image& alpha = made.layers.at(Output::alpha);
    double worst = 0.0;
    for (int x = 0; x < kWidth; ++x) {
      worst = std::max(worst, std::abs(column_mean(alpha, x) - disc_coverage(x, edge, radius)));
    }
    std::printf("coverage of a defocused edge at %.1f m, radius %.2f px: worst %.5f\n", depth,
                radius, worst);
    EXPECT_LT(worst, 0.0083);
    // Black before a hidden background: no light, and all the same coverage.
    EXPECT_EQ(*std::ranges::max_element(made.color.pixels()), 0.0F);
  }
}

// An edge that moves by l px while the shutter is open: a ramp, by a pinhole and by a lens in
// focus.
TEST(Coverage, AMovingEdgeIsARamp) {
  constexpr double kSpeed = 1.0;
  constexpr double kShutter = 0.1;
  Scene scene = half_plane(2.0, -0.1);
  scene.objects[0].velocity = {kSpeed, 0, 0};
  for (const char* method : {"pinhole", "lens-sampling"}) {
    SimulationSpec spec = shot(1.4);
    spec.camera.shutter_seconds = kShutter;
    spec.quality.method = method;
    const Image alpha = photograph(spec, scene).layers.at(Output::alpha);
    const double px = kImageDistance / 2.0 / kPitch.si();
    const double edge = kWidth / 2.0 - 0.1 * px;
    const double length = kSpeed * kShutter * px;
    const auto ramp = [](double z) { return z > 0.0 ? 0.5 * z * z : 0.0; };
    double worst = 0.0;
    for (int x = 0; x < kWidth; ++x) {
      const double wanted = (ramp(x + 1.0 - edge) - ramp(x - edge) - ramp(x + 1.0 - edge - length) +
                             ramp(x - edge - length)) /
                            length;
      worst = std::max(worst, std::abs(column_mean(alpha, x) - wanted));
    }
    std::printf("coverage of a moving edge, %s: worst %.5f over %.1f px\n", method, worst, length);
    EXPECT_LT(worst, 0.0083);
  }
}

// A wall with a hole, a mirror ball that shows the background, two thin sheets one behind the
// other, a glass ball.
Scene mixed_scene() {
  Scene scene;
  scene.materials = {Material{.emission = {.value = {0.8F, 0.4F, 0.2F}}},
                     Material{.emission = {.value = {0.1F, 0.1F, 0.1F}}, .reflection = 0.5},
                     Material{.emission = {.value = {0.0F, 0.2F, 0.1F}}, .transmission = 0.6},
                     Material{.transmission = 1.0, .ior = 1.5}};
  const auto quad = [](Vec3 corner, double width, double height, int material) {
    return Object{
        .shape = QuadObject{.corner = corner, .edge_u = {width, 0, 0}, .edge_v = {0, height, 0}},
        .material = material};
  };
  scene.objects = {quad({-3, -2, -5}, 2.6, 4, 0),
                   {.shape = SphereObject{.center = {0.25, 0, -2}, .radius = 0.15}, .material = 1},
                   quad({-0.5, -0.3, -1}, 0.7, 0.6, 2),
                   quad({-0.2, -0.3, -1.5}, 0.7, 0.6, 2),
                   {.shape = SphereObject{.center = {0.5, 0, -2}, .radius = 0.1}, .material = 3}};
  scene.background = {0.3F, 0.4F, 0.6F};
  return scene;
}

// The same samples in both: colour + (1 - alpha) background is the picture with its background, to
// roundings of single precision in sums of 64 values up to 1, at most 64 * 2^-24 = 4e-6 each way.
TEST(Coverage, ColourAndAlphaOverTheBackgroundAreThePicture) {
  const Scene scene = mixed_scene();
  for (const char* method : {"lens-sampling", "pinhole"}) {
    SimulationSpec spec = shot(1.4);
    spec.quality.samples = 64;
    spec.quality.method = method;
    const Photograph layer = photograph(spec, scene);
    spec.outputs = {Output::color};
    const Image whole = photograph(spec, scene).color;
    const Image& alpha = layer.layers.at(Output::alpha);
    double worst = 0.0;
    int partial = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const float a = *alpha.at(x, y);
        if (a > 0.0F && a < 1.0F) ++partial;
        for (std::size_t c = 0; c < 3; ++c) {
          const double sum =
              double{layer.color.at(x, y)[c]} + (1.0 - double{a}) * double{scene.background[c]};
          worst = std::max(worst, std::abs(sum - double{whole.at(x, y)[c]}));
        }
      }
    }
    EXPECT_LT(worst, 8e-6) << method;
    EXPECT_GT(partial, kWidth * kHeight / 10) << method;
  }
}

// What samples chose of themselves keeps max_error, of alpha too: against many samples, whose own
// error is far smaller.
TEST(Coverage, AlphaKeepsTheErrorThatWasAskedFor) {
  const Scene scene = mixed_scene();
  SimulationSpec spec = shot(1.4);
  spec.quality.samples = 4096;
  const Image truth = photograph(spec, scene).layers.at(Output::alpha);
  spec.quality.samples.reset();
  spec.quality.method = "auto";
  for (const double target : {0.02, 0.005}) {
    spec.quality.max_error = target;
    const Photograph made = photograph(spec, scene);
    ASSERT_TRUE(made.report.alpha_error);
    double squares = 0.0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double off =
            double{*made.layers.at(Output::alpha).at(x, y)} - double{*truth.at(x, y)};
        squares += off * off;
      }
    }
    const double error = std::sqrt(squares / (kWidth * kHeight));
    std::printf("alpha: error %.5f, bound %.5f, target %.3f\n", error,
                made.report.alpha_error->upper_95, target);
    EXPECT_LE(error, made.report.alpha_error->upper_95);
    EXPECT_LE(made.report.alpha_error->upper_95, target);
  }
}

TEST(Coverage, ExposureAndFalloffChangeNoCoverage) {
  const Scene scene = half_plane(8.0, 0.03);
  SimulationSpec spec = shot(1.4);
  spec.quality.samples = 16;
  const Image plain = photograph(spec, scene).layers.at(Output::alpha);
  spec.camera.exposure = IsoExposure{.iso = 3200};
  spec.camera.shutter_seconds = 1.0;
  spec.effects.falloff = EffectChoice::on;
  EXPECT_EQ(photograph(spec, scene).layers.at(Output::alpha), plain);
}

TEST(Coverage, WithoutItNothingIsHiddenAndNothingReported) {
  SimulationSpec spec = shot(1.4);
  spec.quality.samples = 16;
  spec.outputs = {Output::color};
  const Photograph made = photograph(spec, half_plane(8.0, 0.03));
  EXPECT_FALSE(made.report.alpha_error);
  EXPECT_FALSE(made.layers.contains(Output::alpha));
  EXPECT_NEAR(made.color.at(0, 0)[1], 0.5F, 1e-6F);
}

}  // namespace
}  // namespace fstop
