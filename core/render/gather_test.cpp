#include "core/render/gather.h"

#include <cmath>
#include <cstdio>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/render/bar_scenes.h"

namespace fstop {
namespace {

Photograph photograph(SimulationSpec spec, const RayScene& scene, const std::string& method,
                      int threads = 2) {
  WorkerPool workers(threads);
  RunControl run;
  run.workers = &workers;
  spec.quality.method = method;
  return simulate(spec, scene, run);
}

double relative_mse(const Image& image, const Image& reference) {
  double sum = 0.0;
  for (std::size_t i = 0; i < image.pixels().size(); ++i) {
    const double r = reference.pixels()[i];
    sum += std::pow(image.pixels()[i] - r, 2) / (r * r + 1e-2);
  }
  return sum / static_cast<double>(image.pixels().size());
}

// Bars 6 mm wide whose blur is four times as wide: what they hide is in no pinhole picture.
Scene thin_bars() {
  Scene scene = wall_scene(6.0, 8);
  for (int i = 0; i < 6; ++i) {
    add_bar(scene, -0.15 + 0.05 * i, 0.006, 0.5, {0.9F, 0.3F, 0.05F});
  }
  return scene;
}

TEST(Gather, MissesWhatThinBarsHideAndItsCertificateSaysSo) {
  const RayScene scene(thin_bars());
  const SimulationSpec spec = lens_shot(1.4, 96, 64);
  const Image truth = truth_of(spec, scene, 2048);
  const Photograph picture = photograph(spec, scene, "gather");
  const double mse = mse_of(picture.color, truth);
  const double relative = relative_mse(picture.color, truth);
  const ImageError& error = picture.report.error;
  std::printf("relMSE %.3g, RMSE %.4g, estimate %.4g to %.4g\n", relative, std::sqrt(mse),
              error.estimate, error.upper_95);
  EXPECT_GT(relative, 1e-2);
  // The bound lies 1.645 standard errors above the estimate; the interval has 1.96 on both sides.
  const double estimate = error.estimate * error.estimate;
  const double half = (error.upper_95 * error.upper_95 - estimate) * 1.96 / 1.645;
  EXPECT_NEAR(estimate, mse, half);
  EXPECT_GE(error.upper_95, std::sqrt(mse));
  // A bound that is no use is no catch: within 1.3 of the squared error, or the budget was spent.
  EXPECT_LE(error.upper_95 * error.upper_95, 1.31 * estimate);
  // Told as modelled, with what the certificate says, and counted once.
  const ModelledEffect& defocus = picture.report.model.front();
  EXPECT_EQ(defocus.effect, "defocus");
  EXPECT_TRUE(defocus.modelled);
  EXPECT_NEAR(defocus.bound, error.upper_95, 1e-12);
  EXPECT_FALSE(picture.report.warnings.empty());  // above max_error
}

// A wall, bars and a camera by chance.
RayScene random_scene(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Scene scene = wall_scene(2.5 + 5.0 * unit(random), 2 + static_cast<int>(8.0 * unit(random)));
  const int bars = static_cast<int>(4.0 * unit(random));
  for (int i = 0; i < bars; ++i) {
    const double depth = 0.5 + 2.5 * unit(random);
    const auto color = [&] { return static_cast<float>(unit(random)); };
    add_bar(scene, (unit(random) - 0.5) * 0.6 * depth, 0.1 * depth * unit(random), depth,
            {color(), color(), color()});
  }
  return RayScene(scene);
}

TEST(Gather, BoundHoldsInRandomCases) {
  constexpr int kCases = 40;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int held = 0;
  double least = 1e9;
  double most = 0.0;
  for (int i = 0; i < kCases; ++i) {
    const RayScene scene = random_scene(random);
    SimulationSpec spec = lens_shot(1.2 * std::exp(1.5 * unit(random)), 48, 32);
    spec.seed = static_cast<std::uint32_t>(i);
    const double error =
        std::sqrt(mse_of(photograph(spec, scene, "gather").color, truth_of(spec, scene, 1024)));
    const ImageError stated = photograph(spec, scene, "gather").report.error;
    held += error <= stated.upper_95 ? 1 : 0;
    least = std::min(least, stated.estimate / error);
    most = std::max(most, stated.estimate / error);
  }
  std::printf("held %d of %d, estimate/true %.3f to %.3f\n", held, kCases, least, most);
  EXPECT_GE(held, 38);
}

TEST(Gather, AgreesWithLensSamplingOnAPlaneThatFacesTheCamera) {
  for (const int blades : {0, 3, 6}) {
    for (const double depth : {0.7, 5.0}) {
      const RayScene scene(wall_scene(depth, 16));
      SimulationSpec spec = lens_shot(1.4, 96, 64);
      std::get<LensSpec>(spec.camera.optics).aperture.blades = blades;
      spec.quality.max_error = 0.004;
      const Photograph gather = photograph(spec, scene, "gather");
      const Photograph lens = photograph(spec, scene, "lens-sampling");
      const double difference = std::sqrt(mse_of(gather.color, lens.color));
      std::printf("%d blades, %.1f m: difference %.4f, bounds %.4f and %.4f\n", blades, depth,
                  difference, gather.report.error.upper_95, lens.report.error.upper_95);
      EXPECT_LE(difference, gather.report.error.upper_95 + lens.report.error.upper_95);
      // Not by a large bound: no depth edge, no miss. Its blur has pixels instead of points.
      EXPECT_LE(gather.report.error.upper_95, 0.01);
    }
  }
}

TEST(Gather, SamePixelsForAnyNumberOfThreads) {
  const RayScene scene(thin_bars());
  SimulationSpec spec = lens_shot(1.4, 90, 60);
  spec.outputs = {Output::color, Output::variance};
  const Photograph one = photograph(spec, scene, "gather", 1);
  for (const int threads : {2, 3, 4}) {
    const Photograph many = photograph(spec, scene, "gather", threads);
    EXPECT_TRUE(one.color == many.color) << threads << " threads";
    EXPECT_TRUE(one.layers == many.layers) << threads << " threads";
    EXPECT_EQ(one.report.error.estimate, many.report.error.estimate);
    EXPECT_EQ(one.report.error.upper_95, many.report.error.upper_95);
    EXPECT_EQ(one.report.cost.rays, many.report.cost.rays);
  }
}

TEST(Gather, ForcedSamplesAreThoseOfThePicture) {
  const RayScene scene(thin_bars());
  SimulationSpec spec = lens_shot(1.4, 48, 32);
  for (const int samples : {1, 5}) {
    spec.quality.samples = samples;
    const Photograph picture = photograph(spec, scene, "gather");
    EXPECT_EQ(picture.report.cost.samples_max, samples);
    for (const float value : picture.color.pixels()) ASSERT_TRUE(std::isfinite(value));
  }
}

ErrorCode code_of(const SimulationSpec& spec, const RayScene& scene, const RunControl& run = {}) {
  try {
    SimulationSpec named = spec;
    named.quality.method = "gather";
    simulate(named, scene, run);
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::internal;
}

TEST(Gather, CancellationEndsItAtEveryStage) {
  const RayScene scene(thin_bars());
  const SimulationSpec spec = lens_shot(1.4, 192, 128);
  for (const double at : {0.01, 0.3, 0.6}) {
    std::stop_source stop;
    RunControl run;
    run.stop = stop.get_token();
    run.progress = [&](double fraction) {
      if (fraction >= at) stop.request_stop();
    };
    EXPECT_EQ(code_of(spec, scene, run), ErrorCode::cancelled) << at;
  }
}

TEST(Gather, ProgressNeverFallsAndEndsAtOne) {
  const RayScene scene(thin_bars());
  SimulationSpec spec = lens_shot(1.4, 96, 64);
  spec.quality.method = "gather";
  double last = 0.0;
  bool falls = false;
  RunControl run;
  run.progress = [&](double fraction) {
    falls = falls || fraction < last;
    last = fraction;
  };
  simulate(spec, scene, run);
  EXPECT_FALSE(falls);
  EXPECT_EQ(last, 1.0);
}

TEST(Gather, RefusesWhatItsDomainHasNot) {
  const RayScene scene(thin_bars());
  SimulationSpec spec = lens_shot(1.4, 96, 64);
  spec.effects.diffraction = EffectChoice::on;
  EXPECT_EQ(code_of(spec, scene), ErrorCode::no_valid_method);
  spec = lens_shot(1.4, 96, 64);
  spec.effects.defocus = EffectChoice::off;
  EXPECT_EQ(code_of(spec, scene), ErrorCode::no_valid_method);
  spec = lens_shot(1.4, 96, 64);
  spec.camera.optics = PinholeSpec{.image_distance = 50.0_mm, .diameter = 1.0_mm};
  EXPECT_EQ(code_of(spec, scene), ErrorCode::no_valid_method);
  // At f/0.5 a bar 0.2 m away blurs to 0.1 m * 51.28 mm (1/0.2 - 1/2)/m = 23.1 mm, 61.5 px of
  // 96, and over 256 px of 480.
  Scene close = wall_scene(5.0);
  add_bar(close, -0.01, 0.02, 0.2, {1, 1, 1});
  EXPECT_EQ(code_of(lens_shot(0.5, 48, 32), RayScene(close)), ErrorCode::internal);
  EXPECT_EQ(code_of(lens_shot(0.5, 480, 320), RayScene(close)), ErrorCode::no_valid_method);
}

TEST(Gather, AutoHasNoReasonToTakeIt) {
  const RayScene scene(thin_bars());
  for (const double f_number : {1.4, 8.0, 64.0}) {
    EXPECT_NE(plan_for(lens_shot(f_number, 96, 64), &scene).method, "gather");
  }
}

}  // namespace
}  // namespace fstop
