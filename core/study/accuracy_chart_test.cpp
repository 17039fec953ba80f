#include "core/study/accuracy_chart.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/measure/image_difference.h"
#include "core/study/reference_image.h"

namespace fstop {
namespace {

// Bars out of focus before a wall in it, no textures: only noise and blur can be wrong.
Scene bars_scene() {
  Scene scene;
  scene.materials = {Material{.emission = {.value = {0.9F, 0.5F, 0.2F}}},
                     Material{.emission = {.value = {0.1F, 0.2F, 0.6F}}}};
  scene.objects = {
      {.shape = QuadObject{.corner = {-0.4, -1, -2}, .edge_u = {0.8, 0, 0}, .edge_v = {0, 2, 0}},
       .material = 1}};
  for (int i = -3; i <= 3; ++i) {
    scene.objects.push_back(
        {.shape = QuadObject{
             .corner = {0.05 * i, -0.2, -0.5}, .edge_u = {0.015, 0, 0}, .edge_v = {0, 0.4, 0}}});
  }
  scene.background = {0.3F, 0.3F, 0.3F};
  return scene;
}

AccuracyChartSpec tiny_chart() {
  AccuracyChartSpec spec;
  spec.shot.camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 1.4}, .focus_distance = 2.0_m};
  spec.shot.width = 48;
  spec.shot.height = 32;
  spec.shot.effects.diffraction = EffectChoice::off;
  spec.methods = {"pinhole", "lens-sampling"};
  spec.samples = {4, 16, 64};
  spec.max_errors = {0.05, 0.02};
  spec.reference = {.samples = 1024, .replicates = 4};
  return spec;
}

std::vector<AccuracyPoint> points_of(const AccuracyChart& chart, const std::string& method) {
  std::vector<AccuracyPoint> points;
  std::ranges::copy_if(chart.points, std::back_inserter(points),
                       [&](const AccuracyPoint& point) { return point.method == method; });
  return points;
}

const AccuracyChart& drawn_chart() {
  static const RayScene scene(bars_scene());
  static const AccuracyChart chart = accuracy_chart(tiny_chart(), scene, {});
  return chart;
}

// Three pictures of two values, by hand: 0.2, 0.4, 0.6 have s^2 = 0.04, and 0.7, 0.9, 1.4 clipped
// are 0.7, 0.9, 1.0 with s^2 = 7/300; unclipped s^2 = 0.13. Their mean has a third of it.
TEST(ReferenceImage, TellsTheVarianceOfItsMean) {
  ReferenceImage reference;
  for (const auto& [first, other] : {std::pair(0.2F, 0.9F), {0.6F, 0.7F}, {0.4F, 1.4F}}) {
    Image image(2, 1, 3);
    for (int c = 0; c < 3; ++c) {
      image.at(0, 0)[c] = first;
      image.at(1, 0)[c] = other;
    }
    reference.add(image);
  }
  // Pixels are floats: 2^-24 of values near 1, in products of two.
  constexpr double kRounding = 2e-7;
  EXPECT_NEAR(reference.mean().at(0, 0)[0], 0.4, kRounding);
  EXPECT_NEAR(reference.mean().at(1, 0)[2], 1.0, kRounding);
  EXPECT_NEAR(reference.clipped_variance(), (0.04 + 7.0 / 300.0) / 6.0, kRounding);
  EXPECT_NEAR(reference.relative_variance(), (0.04 / 0.17 + 0.13 / 1.01) / 6.0, kRounding);
  // Sums of all six values: 3.3, 3.9, 5.4; mean 4.2, s^2 = 1.17.
  EXPECT_NEAR(reference.energy_error(), std::sqrt(1.17 / 3.0) / 4.2, kRounding);
}

// Four times the samples halve the error of plain Monte Carlo, and that of nets more than halve.
// An RMSE over some hundred independent noisy pixels scatters by less than a tenth.
TEST(AccuracyChart, ErrorOfLensSamplingFallsWithSamples) {
  const auto points = points_of(drawn_chart(), "lens-sampling");
  ASSERT_EQ(points.size(), 3U);
  for (std::size_t i = 1; i < points.size(); ++i) {
    EXPECT_LT(points[i].truth.rmse, 0.6 * points[i - 1].truth.rmse);
    EXPECT_LT(points[i].truth.rel_mse, 0.36 * points[i - 1].truth.rel_mse);
    EXPECT_GT(points[i].cost.rays, 3 * points[i - 1].cost.rays);
    EXPECT_TRUE(points[i].truth.resolved);
  }
  // The net's first 16 samples leave no more than 16 independent ones would: 0.4 at most between
  // bar and wall, half of the pixels mixed.
  EXPECT_LT(points[1].truth.rmse, 0.5 * 0.4 / 4.0);
  EXPECT_NEAR(points[2].truth.energy, 0.0, 5.0 * points[2].truth.rmse);
}

// Half of the difference of a net's halves overestimates the squared error by 2^t - 1 where the
// error falls as N^(-t/2): nothing for t = 1 (Monte Carlo), 7 for t = 3 (the best a net does on
// smooth integrands). A tenth of scatter on either side.
TEST(AccuracyChart, EstimateIsWithinTheEstimatorsFactorOfTheTruth) {
  for (const AccuracyPoint& point : points_of(drawn_chart(), "lens-sampling")) {
    ASSERT_TRUE(point.estimate && point.upper_95);
    EXPECT_GT(*point.estimate, 0.9 * point.truth.rmse);
    EXPECT_LT(*point.estimate, 1.1 * std::sqrt(7.0) * point.truth.rmse);
    EXPECT_GE(*point.upper_95, *point.estimate);
  }
}

double clipped_rmse(const SimulationSpec& a, const SimulationSpec& b, const RayScene& scene) {
  const Image first = simulate(a, scene, {}).color;
  const Image second = simulate(b, scene, {}).color;
  return image_difference(first.view(), second.view()).rmse_clipped;
}

// Noise adds to a bias in squares, so that no count brings the error below it. The bias is found
// without the chart: 2,048 samples of either method, whose own noise is a hundredth of it.
TEST(AccuracyChart, PinholeNeverFallsBelowItsBias) {
  const RayScene scene(bars_scene());
  SimulationSpec sharp = tiny_chart().shot;
  sharp.quality.samples = 2048;
  SimulationSpec blurred = sharp;
  sharp.quality.method = "pinhole";
  blurred.quality.method = "lens-sampling";
  const double bias = clipped_rmse(sharp, blurred, scene);
  EXPECT_GT(bias, 0.03);
  for (const AccuracyPoint& point : points_of(drawn_chart(), "pinhole")) {
    EXPECT_GT(point.truth.rmse, 0.98 * bias);
    EXPECT_GE(*point.upper_95, point.truth.rmse);  // and it says so
  }
  EXPECT_NEAR(points_of(drawn_chart(), "pinhole").back().truth.rmse, bias, 0.05 * bias);
}

TEST(AccuracyChart, PicksMeetTheirTargets) {
  const AccuracyChart& chart = drawn_chart();
  ASSERT_EQ(chart.picks.size(), 2U);
  for (const PlannerPick& pick : chart.picks) {
    EXPECT_TRUE(pick.point.truth.resolved);
    EXPECT_LE(pick.point.truth.rmse, pick.max_error);
    EXPECT_TRUE(pick.meets_target());
    EXPECT_TRUE(pick.keeps_bound());
    EXPECT_FALSE(pick.passed_over.empty());
    EXPECT_GT(pick.point.cost.rays, 0U);
  }
  EXPECT_EQ(chart.reference.method, "lens-sampling");
  EXPECT_EQ(chart.reference.bias_bound, 0.0);
}

// Against a reference of 4 samples a picture of 4 has a squared difference twice its error: only
// with the reference's own variance taken off is it the same error as against a good reference.
// 4,608 values, of which some hundreds are noisy: 15 % of scatter, where leaving it in adds 41 %.
TEST(AccuracyChart, TakesTheReferencesNoiseOff) {
  const RayScene scene(bars_scene());
  AccuracyChartSpec spec = tiny_chart();
  spec.methods = {"lens-sampling"};
  spec.samples = {4};
  spec.max_errors = {};
  spec.reference = {.samples = 1, .replicates = 16};
  const AccuracyChart rough = accuracy_chart(spec, scene, {});
  const double wanted = points_of(drawn_chart(), "lens-sampling").front().truth.rmse;
  EXPECT_NEAR(rough.points.front().truth.rmse, wanted, 0.15 * wanted);
  EXPECT_GT(rough.reference.noise, 0.2 * wanted);
}

TEST(AccuracyChart, SaysWhereTheReferenceIsTooNoisyToTell) {
  const RayScene scene(bars_scene());
  AccuracyChartSpec spec = tiny_chart();
  spec.methods = {"lens-sampling"};
  spec.samples = {256};
  spec.max_errors = {};
  spec.reference = {.samples = 4, .replicates = 2};
  const AccuracyChart chart = accuracy_chart(spec, scene, {});
  const TrueError& truth = chart.points.front().truth;
  EXPECT_FALSE(truth.resolved);
  EXPECT_EQ(truth.rmse_at_most, chart.reference.noise);
  EXPECT_LT(truth.rmse, chart.reference.noise);
}

TEST(AccuracyChart, IsTheSameForAnyNumberOfThreads) {
  const RayScene scene(bars_scene());
  AccuracyChartSpec spec = tiny_chart();
  spec.samples = {4};
  spec.max_errors = {0.05};
  spec.reference = {.samples = 64, .replicates = 2};
  const AccuracyChart one = accuracy_chart(spec, scene, {});
  WorkerPool workers(3);
  const AccuracyChart three = accuracy_chart(spec, scene, {.workers = &workers});
  EXPECT_EQ(one.reference.noise, three.reference.noise);
  ASSERT_EQ(one.points.size(), three.points.size());
  for (std::size_t i = 0; i < one.points.size(); ++i) {
    EXPECT_EQ(one.points[i].truth.rmse, three.points[i].truth.rmse);
    EXPECT_EQ(one.points[i].truth.rel_mse, three.points[i].truth.rel_mse);
    EXPECT_EQ(one.points[i].truth.energy, three.points[i].truth.energy);
    EXPECT_EQ(one.points[i].estimate, three.points[i].estimate);
    EXPECT_EQ(one.points[i].cost.rays, three.points[i].cost.rays);
  }
  EXPECT_EQ(one.picks.front().point.method, three.picks.front().point.method);
  EXPECT_EQ(one.picks.front().point.truth.rmse, three.picks.front().point.truth.rmse);
}

TEST(AccuracyChart, ProgressNeverFallsAndEndsAtOne) {
  const RayScene scene(bars_scene());
  AccuracyChartSpec spec = tiny_chart();
  spec.reference = {.samples = 16, .replicates = 2};
  std::vector<double> told;
  accuracy_chart(spec, scene, {.progress = [&](double part) { told.push_back(part); }});
  ASSERT_GT(told.size(), 10U);
  EXPECT_TRUE(std::ranges::is_sorted(told));
  EXPECT_LT(told.front(), 0.5);
  EXPECT_EQ(told.back(), 1.0);
}

// Stopped at any moment, it renders no more than what was under way: progress tells no more.
TEST(AccuracyChart, StopsWhenToldTo) {
  const RayScene scene(bars_scene());
  for (const double when : {0.0, 0.3, 0.9}) {
    std::stop_source stop;
    int told_after = 0;
    const RunControl run{.stop = stop.get_token(), .progress = [&](double part) {
                           if (stop.stop_requested()) ++told_after;
                           if (part >= when) stop.request_stop();
                         }};
    try {
      accuracy_chart(tiny_chart(), scene, run);
      ADD_FAILURE() << "was not stopped at " << when;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::cancelled);
    }
    EXPECT_EQ(told_after, 0) << when;
  }
}

TEST(AccuracyChart, TellsWhichMethodsRefuseAndWhy) {
  const RayScene scene(bars_scene());
  AccuracyChartSpec spec = tiny_chart();
  spec.shot.effects.defocus = EffectChoice::off;
  spec.samples = {2};
  spec.max_errors = {};
  spec.reference = {.samples = 2, .replicates = 2};
  const AccuracyChart chart = accuracy_chart(spec, scene, {});
  ASSERT_EQ(chart.refused.size(), 1U);
  EXPECT_EQ(chart.refused.front().method, "lens-sampling");
  EXPECT_EQ(chart.refused.front().why.find("lens-sampling"), std::string::npos);
  EXPECT_NE(chart.refused.front().why, "");
  EXPECT_NE(chart.reference.method, "lens-sampling");
  EXPECT_EQ(points_of(chart, "pinhole").size(), 1U);
}

// One sample a pixel has no scatter, whatever else a method samples beside it.
TEST(AccuracyChart, TakesNoWordOnNoiseFromOneSample) {
  const RayScene scene(bars_scene());
  AccuracyChartSpec spec = tiny_chart();
  spec.methods = {};
  spec.shot.effects.diffraction = EffectChoice::automatic;
  spec.samples = {1, 2};
  spec.max_errors = {};
  spec.reference = {.samples = 4, .replicates = 2};
  const AccuracyChart chart = accuracy_chart(spec, scene, {});
  ASSERT_EQ(chart.points.size() + 2 * chart.refused.size(), 2 * method_names().size());
  for (std::size_t i = 0; i < chart.points.size(); ++i) {
    EXPECT_EQ(chart.points[i].estimate.has_value(), i % 2 == 1) << chart.points[i].method;
    EXPECT_EQ(chart.points[i].upper_95.has_value(), i % 2 == 1) << chart.points[i].method;
  }
}

TEST(AccuracyChart, RefusesWhatTellsNothing) {
  const RayScene scene(bars_scene());
  const auto refuses = [&](const auto& change) {
    AccuracyChartSpec spec = tiny_chart();
    change(spec);
    try {
      accuracy_chart(spec, scene, {});
    } catch (const Error& error) {
      return error.code() == ErrorCode::outside_domain ||
             error.code() == ErrorCode::no_valid_method;
    }
    return false;
  };
  EXPECT_TRUE(refuses([](AccuracyChartSpec& s) { s.reference.replicates = 1; }));
  EXPECT_TRUE(refuses([](AccuracyChartSpec& s) { s.samples = {0}; }));
  EXPECT_TRUE(refuses([](AccuracyChartSpec& s) { s.max_errors = {0.0}; }));
  EXPECT_TRUE(refuses([](AccuracyChartSpec& s) { s.reference.method = "guess"; }));
}

TEST(AccuracyChart, CountsTheSamplesItWillTake) {
  AccuracyChartSpec spec = tiny_chart();
  EXPECT_EQ(planned_samples(spec), (2 * (4 + 16 + 64) + 4 * 1024) * 48 * 32);
  spec.methods = {};
  EXPECT_EQ(planned_samples(spec),
            (static_cast<int>(method_names().size()) * 84 + 4 * 1024) * 48 * 32);
}

}  // namespace
}  // namespace fstop
