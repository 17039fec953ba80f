#include "core/study/accuracy_chart.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <mutex>
#include <numeric>

#include "core/error.h"
#include "core/measure/image_difference.h"
#include "core/render/method.h"
#include "core/study/reference_image.h"

namespace fstop {
namespace {

constexpr std::string_view kPlainMethod = "lens-sampling";
constexpr double kFinestTarget = 0.001;  // where no targets are given
// A pick's samples are not known before: what it counts for in the progress.
constexpr double kSamplesOfPick = 64.0;
// Pictures that take less are made again, since their times would be those of interruptions.
constexpr double kShortRun = 0.05;  // seconds
constexpr int kRunsOfShort = 3;
constexpr std::uint32_t kSeedStep = 0x9E3779B9U;  // odd: no replicate has the shot's seed

void require(bool holds, const char* message) {
  if (!holds) throw Error(ErrorCode::outside_domain, message);
}

void require_legal(const AccuracyChartSpec& spec) {
  require(spec.reference.replicates >= 2, "a reference needs 2 replicates or more");
  require(spec.reference.samples >= 1, "a reference needs 1 sample a pixel or more");
  require(std::ranges::all_of(spec.samples, [](int n) { return n >= 1; }),
          "a chart's counts must be 1 sample a pixel or more");
  require(std::ranges::all_of(spec.max_errors, [](double e) { return e > 0.0; }),
          "a chart's targets must be positive");
}

double finest_target(const AccuracyChartSpec& spec) {
  return spec.max_errors.empty() ? kFinestTarget : *std::ranges::min_element(spec.max_errors);
}

// The shot by one method with so many samples a pixel.
SimulationSpec forced(const AccuracyChartSpec& spec, const std::string& method, int samples) {
  SimulationSpec shot = spec.shot;
  shot.quality.method = method;
  shot.quality.samples = samples;
  shot.quality.max_time_ms = std::nullopt;
  shot.quality.max_error = finest_target(spec);
  shot.outputs = {Output::color};
  return shot;
}

SimulationSpec planned(const AccuracyChartSpec& spec, double max_error) {
  SimulationSpec shot = forced(spec, "auto", 1);
  shot.quality.samples = std::nullopt;
  shot.quality.max_error = max_error;
  return shot;
}

// A method's plan, or why it refuses.
struct MethodAnswer {
  std::string method = {};
  std::string refusal = {};
  double bias_bound = 0.0;
};

MethodAnswer answer_of(const AccuracyChartSpec& spec, const std::string& method,
                       const RayScene& scene) {
  MethodAnswer answer{.method = method};
  try {
    const Plan plan = plan_for(forced(spec, method, 1), &scene);
    for (const ModelledEffect& effect : plan.model) answer.bias_bound += effect.bound;
  } catch (const Error& error) {
    // A refusal is part of what a chart tells; nothing but the exception has its reason.
    if (error.code() != ErrorCode::no_valid_method) throw;
    answer.refusal = error.what();
    const std::string prefix = method + ": ";
    if (answer.refusal.starts_with(prefix)) answer.refusal.erase(0, prefix.size());
  }
  return answer;
}

// Shares of the whole that steps take, in the order in which they are taken.
class ChartProgress {
 public:
  ChartProgress(const RunControl& run, double total) : run_(run), total_(total) {}

  // The control of the next step, which is `weight` of the total.
  RunControl step(double weight) {
    const double begin = done_ / total_;
    done_ += weight;
    const double share = weight / total_;
    RunControl step{.stop = run_.stop, .workers = run_.workers};
    if (run_.progress) step.progress = [=, this](double part) { report(begin + share * part); };
    return step;
  }
  void finish() { report(1.0); }

 private:
  void report(double fraction) {
    if (!run_.progress) return;
    const std::scoped_lock lock(mutex_);
    if (fraction <= reported_) return;
    reported_ = std::min(fraction, 1.0);
    run_.progress(reported_);
  }

  const RunControl& run_;
  double total_;
  double done_ = 0.0;
  std::mutex mutex_;
  double reported_ = 0.0;
};

// Processor time: of this thread where it renders alone, else of the process.
double cpu_seconds(const RunControl& run) {
  std::timespec time = {};
  clock_gettime(run.workers == nullptr ? CLOCK_THREAD_CPUTIME_ID : CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct TimedPhotograph {
  std::optional<int> forced_samples = {};
  Photograph photograph = {};
  PointCost cost = {};
};

TimedPhotograph timed(const SimulationSpec& shot, const RayScene& scene, const RunControl& run) {
  TimedPhotograph result{.forced_samples = shot.quality.samples};
  double cpu = std::numeric_limits<double>::infinity();
  double wall = cpu;
  RunControl control = run;
  for (int i = 0; i < kRunsOfShort && (i == 0 || wall < kShortRun); ++i) {
    const double cpu_start = cpu_seconds(run);
    const double wall_start = wall_seconds();
    result.photograph = simulate(shot, scene, control);
    wall = std::min(wall, wall_seconds() - wall_start);
    cpu = std::min(cpu, cpu_seconds(run) - cpu_start);
    control.progress = nullptr;  // the first run has told it
  }
  const RenderCost& cost = result.photograph.report.cost;
  result.cost = {.rays = cost.rays,
                 .samples_mean = cost.samples_mean,
                 .cpu_seconds = cpu,
                 .wall_seconds = wall};
  return result;
}

double energy_of(const Image& image) {
  return std::accumulate(image.pixels().begin(), image.pixels().end(), 0.0);
}

// The truth, as far as it is known.
struct Truth {
  ChartReference reference = {};
  Image mean = {};
};

TrueError true_error(const Image& picture, const Truth& truth) {
  const ImageDifference difference = image_difference(picture.view(), truth.mean.view());
  const double noise = truth.reference.noise * truth.reference.noise;
  const double mse = difference.rmse_clipped * difference.rmse_clipped - noise;
  TrueError error{.rmse = std::sqrt(std::max(0.0, mse)),
                  .rel_mse = std::max(0.0, difference.rel_mse - truth.reference.rel_mse_noise)};
  error.resolved = mse > noise;
  error.rmse_at_most = error.resolved ? error.rmse : truth.reference.noise;
  const double energy = energy_of(picture);
  const double wanted = energy_of(truth.mean);
  error.energy = energy == wanted ? 0.0 : energy / wanted - 1.0;
  return error;
}

MethodAnswer reference_method(const AccuracyChartSpec& spec, const RayScene& scene) {
  if (!spec.reference.method.empty()) {
    const MethodAnswer named = answer_of(spec, spec.reference.method, scene);
    if (!named.refusal.empty()) {
      throw Error(ErrorCode::no_valid_method,
                  "the reference cannot be made by " + named.method + ": " + named.refusal);
    }
    return named;
  }
  std::optional<MethodAnswer> best;
  for (const std::string& method : method_names()) {
    MethodAnswer answer = answer_of(spec, method, scene);
    if (!answer.refusal.empty()) continue;
    if (method == kPlainMethod && answer.bias_bound <= 0.25 * finest_target(spec)) return answer;
    if (!best || answer.bias_bound < best->bias_bound) best = std::move(answer);
  }
  if (!best) throw Error(ErrorCode::no_valid_method, "no method makes a reference of this shot");
  return *best;
}

Truth truth_of(const AccuracyChartSpec& spec, const MethodAnswer& method, const RayScene& scene,
               ChartProgress& progress) {
  SimulationSpec shot = forced(spec, method.method, spec.reference.samples);
  shot.quality.max_error = std::max(1e-6, 0.1 * finest_target(spec));  // textures read finely
  ReferenceImage image;
  for (int i = 0; i < spec.reference.replicates; ++i) {
    shot.seed += kSeedStep;
    image.add(simulate(shot, scene, progress.step(spec.reference.samples)).color);
  }
  return {.reference = {.method = method.method,
                        .samples = spec.reference.samples,
                        .replicates = spec.reference.replicates,
                        .noise = std::sqrt(image.clipped_variance()),
                        .rel_mse_noise = image.relative_variance(),
                        .energy_noise = image.energy_error(),
                        .bias_bound = method.bias_bound},
          .mean = image.mean()};
}

AccuracyPoint point_of(const TimedPhotograph& made, const Truth& truth) {
  const RenderReport& report = made.photograph.report;
  // What a method then says of its noise is what it adds to it.
  const bool tells_noise = made.forced_samples != 1 && report.cost.samples_max > 1;
  AccuracyPoint point{.method = report.method,
                      .cost = made.cost,
                      .truth = true_error(made.photograph.color, truth)};
  if (tells_noise) {
    point.estimate = report.error.estimate;
    point.upper_95 = report.error.upper_95;
  }
  return point;
}

PlannerPick pick_of(double max_error, TimedPhotograph made, const Truth& truth) {
  PlannerPick pick{.max_error = max_error, .point = point_of(made, truth)};
  RenderReport& report = made.photograph.report;
  pick.model = std::move(report.model);
  pick.passed_over = std::move(report.passed_over);
  pick.warnings = std::move(report.warnings);
  return pick;
}

double samples_of_points(const AccuracyChartSpec& spec) {
  return std::accumulate(spec.samples.begin(), spec.samples.end(), 0.0);
}

}  // namespace

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const RenderMethod* method : render_methods()) names.emplace_back(method->name());
  return names;
}

std::int64_t planned_samples(const AccuracyChartSpec& spec) {
  const std::size_t methods = spec.methods.empty() ? method_names().size() : spec.methods.size();
  const std::int64_t per_pixel =
      std::accumulate(spec.samples.begin(), spec.samples.end(), std::int64_t{0}) *
          static_cast<std::int64_t>(methods) +
      std::int64_t{spec.reference.samples} * spec.reference.replicates;
  return per_pixel * spec.shot.width * spec.shot.height;
}

AccuracyChart accuracy_chart(const AccuracyChartSpec& spec, const RayScene& scene,
                             const RunControl& run) {
  require_legal(spec);
  AccuracyChart chart{.threads = run.workers == nullptr ? 1 : run.workers->threads()};
  std::vector<std::string> methods;
  for (const std::string& method : spec.methods.empty() ? method_names() : spec.methods) {
    const MethodAnswer answer = answer_of(spec, method, scene);
    if (answer.refusal.empty()) {
      methods.push_back(method);
    } else {
      chart.refused.push_back({method, answer.refusal});
    }
  }
  const MethodAnswer reference = reference_method(spec, scene);
  ChartProgress progress(run, spec.reference.replicates * double(spec.reference.samples) +
                                  static_cast<double>(methods.size()) * samples_of_points(spec) +
                                  kSamplesOfPick * static_cast<double>(spec.max_errors.size()));
  const Truth truth = truth_of(spec, reference, scene, progress);
  chart.reference = truth.reference;
  for (const std::string& method : methods) {
    for (const int samples : spec.samples) {
      const SimulationSpec shot = forced(spec, method, samples);
      chart.points.push_back(point_of(timed(shot, scene, progress.step(samples)), truth));
    }
  }
  for (const double max_error : spec.max_errors) {
    const SimulationSpec shot = planned(spec, max_error);
    chart.picks.push_back(
        pick_of(max_error, timed(shot, scene, progress.step(kSamplesOfPick)), truth));
  }
  throw_if_stopped(run);
  progress.finish();
  return chart;
}

}  // namespace fstop
