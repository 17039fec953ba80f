#include "tests/methods/calibration.h"

#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <thread>

#include "core/error.h"
#include "core/render/method.h"
#include "tests/bench/thread_timer.h"
#include "tests/methods/random_shots.h"

namespace fstop {
namespace {

double bound_of(const std::vector<ModelledEffect>& model) {
  double sum = 0.0;
  for (const ModelledEffect& effect : model) sum += effect.bound;
  return sum;
}

double diffraction_bound(const SimulationSpec& spec, const RayScene& scene) {
  SimulationSpec rays = spec;
  rays.quality.method = "lens-sampling";
  double bound = 0.0;
  for (const ModelledEffect& effect : plan_for(rays, &scene).model) {
    if (effect.effect.starts_with("diffraction")) bound += effect.bound;
  }
  return bound;
}

bool all_finite(const Image& image) {
  for (const float value : image.pixels()) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

MethodTrial trial(SimulationSpec spec, const std::string& method, const RayScene& scene,
                  const Truth& truth) {
  spec.quality.method = method;
  MethodTrial trial{.method = method};
  try {
    if (method != "auto" && bound_of(plan_for(spec, &scene).model) > spec.quality.max_error) {
      trial.passed_over = "its bound is above the target";
      return trial;
    }
    const double start = thread_seconds();
    const Photograph picture = simulate(spec, scene, {});
    trial.cpu_seconds = thread_seconds() - start;
    trial.method = picture.report.method;
    trial.told = picture.report.error;
    trial.rays = picture.report.cost.rays;
    trial.finite = all_finite(picture.color);
    if (trial.finite) trial.truth = truth.error_of(picture.color);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::no_valid_method) throw;
    trial.passed_over = error.what();
  }
  return trial;
}

// The least cost of the trials that were rendered and meet the target; infinity if none does.
template <typename Cost>
double least_of(const std::vector<MethodTrial>& trials, const Cost& cost) {
  double least = std::numeric_limits<double>::infinity();
  for (const MethodTrial& t : trials) {
    if (t.passed_over.empty() && t.meets_target()) least = std::min(least, cost(t));
  }
  return least;
}

}  // namespace

CalibrationCase calibrated(std::uint32_t seed, const CalibrationOptions& options) {
  RandomShot shot = random_shot(seed);
  const RayScene scene(std::move(shot.scene));
  SimulationSpec& spec = shot.spec;
  if (spec.effects.diffraction == EffectChoice::automatic &&
      diffraction_bound(spec, scene) > 0.1 * spec.quality.max_error) {
    spec.effects.diffraction = EffectChoice::off;
  }
  const double target = spec.quality.max_error;
  const Truth truth(spec, scene, options.noise_share * target, options.most_samples, {});
  CalibrationCase result{.seed = seed,
                         .what = shot.what,
                         .target = target,
                         .reference_noise = truth.noise(),
                         .reference_samples = truth.samples(),
                         .chosen = trial(spec, "auto", scene, truth)};
  if (options.all_methods) {
    for (const RenderMethod* method : render_methods()) {
      result.methods.push_back(trial(spec, std::string(method->name()), scene, truth));
    }
  }
  return result;
}

std::vector<CalibrationCase> calibrated(std::uint32_t first, int count, int threads,
                                        const CalibrationOptions& options,
                                        const std::function<void(const CalibrationCase&)>& done) {
  std::vector<CalibrationCase> cases(static_cast<std::size_t>(count));
  std::vector<std::exception_ptr> failures(cases.size());
  std::atomic<std::size_t> next = 0;
  std::mutex telling;
  const auto work = [&] {
    for (std::size_t i = next++; i < cases.size(); i = next++) {
      try {
        cases[i] = calibrated(first + static_cast<std::uint32_t>(i), options);
        const std::scoped_lock lock(telling);
        if (done) done(cases[i]);
      } catch (...) {
        failures[i] = std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> team;
    for (int i = 0; i < threads; ++i) team.emplace_back(work);
  }
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
  return cases;
}

CalibrationSummary summary_of(const std::vector<CalibrationCase>& cases) {
  CalibrationSummary summary;
  std::vector<double> ratios;
  for (const CalibrationCase& c : cases) {
    if (!c.resolved()) {
      ++summary.unresolved;
      continue;
    }
    ++summary.cases;
    const double error = c.chosen.truth.rmse;
    summary.held += c.chosen.holds() && c.chosen.finite ? 1.0 : 0.0;
    summary.over_target += c.chosen.meets_target() ? 0.0 : 1.0;
    summary.mean_used += error / c.target;
    // A picture without any error to tell says nothing of the ratio.
    if (error > 0.02 * c.target) ratios.push_back(c.chosen.told.estimate / error);
  }
  if (summary.cases == 0) return summary;
  summary.held /= summary.cases;
  summary.over_target /= summary.cases;
  summary.mean_used /= summary.cases;
  if (!ratios.empty()) {
    std::ranges::sort(ratios);
    summary.median_ratio = ratios[ratios.size() / 2];
  }
  return summary;
}

ChoiceSummary choices_of(const std::vector<CalibrationCase>& cases) {
  constexpr double kAllowed = 1.3;
  ChoiceSummary summary;
  const auto rays = [](const MethodTrial& t) { return static_cast<double>(t.rays); };
  const auto time = [](const MethodTrial& t) { return t.cpu_seconds; };
  for (const CalibrationCase& c : cases) {
    if (!c.resolved() || c.methods.empty()) continue;
    const double least_rays = least_of(c.methods, rays);
    if (std::isinf(least_rays)) {
      ++summary.missed;
      continue;
    }
    ++summary.cases;
    const double by_time = time(c.chosen) / least_of(c.methods, time);
    summary.good_by_rays += rays(c.chosen) <= kAllowed * least_rays ? 1.0 : 0.0;
    summary.good_by_time += by_time <= kAllowed ? 1.0 : 0.0;
    summary.worst_by_time = std::max(summary.worst_by_time, by_time);
  }
  if (summary.cases == 0) return summary;
  summary.good_by_rays /= summary.cases;
  summary.good_by_time /= summary.cases;
  return summary;
}

}  // namespace fstop
