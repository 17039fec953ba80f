#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/render/simulation.h"

namespace fstop {

/// How the truth is made: independent pictures of the full model, each of `samples` a pixel.
struct ReferenceSpec {
  /// Empty: lens-sampling where what it leaves out is at most a quarter of the smallest target,
  /// else the method that leaves out least.
  std::string method = {};
  int samples = 256;   // a pixel, of each replicate
  int replicates = 4;  // 2 or more: their scatter is the reference's own noise
};

/// One scene and camera, rendered by every method over its range.
struct AccuracyChartSpec {
  SimulationSpec shot = {};               // quality.method, max_error and samples apart
  std::vector<std::string> methods = {};  // empty: all there are
  std::vector<int> samples = {1, 2, 4, 8, 16, 32, 64};  // a pixel, of each method
  std::vector<double> max_errors = {0.03, 0.01};        // of the planner
  ReferenceSpec reference = {};
};

/// How far a picture is from the reference, whose own noise is taken off.
struct TrueError {
  double rmse = 0.0;     // of values clipped to [0,1], as max_error counts; 0: lost in the noise
  double rel_mse = 0.0;  // mean of (x - ref)^2/(ref^2 + 0.01)
  double energy = 0.0;   // of the picture over that of the reference, less 1; unclipped
  /// Whether the error is above the reference's own noise. If not, `rmse` is little more than a
  /// guess, and that noise is what the error is at most.
  bool resolved = true;
  double rmse_at_most = 0.0;  // rmse, or where that is not resolved the reference's noise
};

/// What one picture took. Times are the fastest of a few runs where one is short.
struct PointCost {
  std::uint64_t rays = 0;
  double samples_mean = 0.0;  // a pixel
  double cpu_seconds = 0.0;   // see accuracy_chart
  double wall_seconds = 0.0;
};

/// One picture: what it cost, how wrong it said it is and how wrong it is.
struct AccuracyPoint {
  std::string method = {};
  PointCost cost = {};
  TrueError truth = {};
  std::optional<double> estimate = {};  // the report's; one sample a pixel tells no noise
  std::optional<double> upper_95 = {};
};

/// What the planner took for one max_error.
struct PlannerPick {
  double max_error = 0.0;
  AccuracyPoint point = {};
  std::vector<ModelledEffect> model = {};
  std::vector<PassedOverMethod> passed_over = {};
  std::vector<std::string> warnings = {};

  bool meets_target() const { return point.truth.rmse_at_most <= max_error; }
  bool keeps_bound() const { return !point.upper_95 || point.truth.rmse <= *point.upper_95; }
};

/// What the pictures are compared with.
struct ChartReference {
  std::string method = {};
  int samples = 0;
  int replicates = 0;
  double noise = 0.0;          // RMSE of the replicates' mean, clipped values
  double rel_mse_noise = 0.0;  // the same as relMSE
  double energy_noise = 0.0;   // relative standard error of its energy
  double bias_bound = 0.0;     // RMSE of what the method leaves out, at most
};

struct AccuracyChart {
  ChartReference reference = {};
  std::vector<AccuracyPoint> points = {};      // by method, then by samples
  std::vector<PlannerPick> picks = {};         // as the targets were given
  std::vector<PassedOverMethod> refused = {};  // methods whose domain the shot lies outside
  int threads = 1;
};

/// Time against true error of every method, and of the planner's picks. The reference is the mean
/// of replicates of other seeds than the shot's; a picture's error is the mean square of its
/// differences from it, less the variance of that mean, which their scatter tells:
///
///     e^2 = mean((x - m)^2) - s^2/n,   m and s^2 of the n replicates, per pixel and channel.
///
/// Textures are read as finely for every point as for the smallest of the targets.
/// Deterministic but for the times. `cpu_seconds` is the calling thread's processor time where
/// `run` has no workers; with workers it is the whole process's, which counts whatever else runs
/// in it.
/// Throws: as simulate; Error{no_valid_method} where every method refuses the shot,
///         Error{outside_domain} unless there are 2 replicates or more and all counts are positive.
AccuracyChart accuracy_chart(const AccuracyChartSpec& spec, const RayScene& scene,
                             const RunControl& run);

/// The samples over all pixels that points and reference take; the picks take what they need.
std::int64_t planned_samples(const AccuracyChartSpec& spec);

/// The names of all methods, in their order.
std::vector<std::string> method_names();

}  // namespace fstop
