#include "tests/methods/stability.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/measure/image_difference.h"
#include "core/render/method.h"
#include "tests/methods/truth.h"

namespace fstop {
namespace {

bool is_finite(const Photograph& picture) {
  for (const float value : picture.color.pixels()) {
    if (!std::isfinite(value)) return false;
  }
  const ImageError& error = picture.report.error;
  return std::isfinite(error.estimate) && std::isfinite(error.upper_95) &&
         std::isfinite(error.energy) && error.upper_95 >= error.estimate;
}

double diffraction_bound(const SimulationSpec& spec, const RayScene& scene) {
  SimulationSpec rays = spec;
  rays.quality.method = "lens-sampling";
  rays.effects.diffraction = EffectChoice::automatic;
  for (const ModelledEffect& effect : plan_for(rays, &scene).model) {
    if (effect.effect == "diffraction") return effect.bound;
  }
  return 0.0;
}

// One regime: its references are made when the first method asks for them.
class RegimeTrial {
 public:
  RegimeTrial(const Regime& regime, int most_samples, const RunControl& run)
      : regime_(regime), scene_(regime.scene), most_samples_(most_samples), run_(run) {}

  StabilityCell cell(const std::string& method) {
    StabilityCell cell{
        .regime = regime_.name, .method = method, .target = regime_.spec.quality.max_error};
    SimulationSpec spec = regime_.spec;
    spec.quality.method = method;
    spec.quality.most_samples = std::int64_t{most_samples_} * spec.width * spec.height;
    spec.effects.diffraction = method == "wave" ? EffectChoice::automatic : EffectChoice::off;
    try {
      const Photograph picture = simulate(spec, scene_, run_);
      cell.taken = picture.report.method;
      cell.bound = picture.report.error.upper_95;
      judge(spec, picture, cell);
    } catch (const Error& error) {
      const bool refusal = error.code() == ErrorCode::no_valid_method ||
                           error.code() == ErrorCode::outside_domain ||
                           error.code() == ErrorCode::over_budget;
      cell.verdict = refusal ? Verdict::refused : Verdict::failed;
      cell.note = error.what();
    } catch (const std::exception& error) {
      cell.note = error.what();
    }
    return cell;
  }

 private:
  void judge(const SimulationSpec& spec, const Photograph& picture, StabilityCell& cell) {
    if (!is_finite(picture)) {
      cell.verdict = Verdict::not_finite;
      return;
    }
    double allowed = cell.bound;
    if (method_has_diffraction(spec) &&
        diffraction_bound(spec, scene_) > 0.3 * std::max(cell.bound, 1e-6)) {
      judge_by_itself(spec, picture, cell);
      allowed += cell.scatter;
    } else {
      const TrueError error = truth().error_of(picture.color);
      cell.true_error = error.rmse;
      cell.scatter = error.scatter;
      allowed += method_has_diffraction(spec) ? diffraction_bound(spec, scene_) : 0.0;
    }
    const bool holds = cell.true_error - 2.0 * cell.scatter <= 1.25 * allowed;
    cell.verdict = !holds                                        ? Verdict::broken
                   : picture.report.error.upper_95 > cell.target ? Verdict::over
                                                                 : Verdict::held;
  }

  static bool method_has_diffraction(const SimulationSpec& spec) {
    return spec.effects.diffraction != EffectChoice::off;
  }

  void judge_by_itself(const SimulationSpec& spec, const Photograph& picture,
                       StabilityCell& cell) const {
    SimulationSpec finer = spec;
    finer.quality.max_error = spec.quality.max_error / 5.0;
    // Large pictures need fewer for the same certainty of their mean square.
    finer.quality.samples = std::clamp(400'000 / (spec.width * spec.height), 16, 256);
    finer.seed = spec.seed + 77U;
    const Photograph truth = simulate(finer, scene_, run_);
    cell.note = "held against itself, finer";
    cell.true_error = image_difference(picture.color.view(), truth.color.view()).rmse_clipped;
    cell.scatter = truth.report.error.estimate;
  }

  const Truth& truth() {
    if (!truth_) {
      truth_.emplace(regime_.spec, scene_, 0.15 * regime_.spec.quality.max_error, most_samples_,
                     run_);
    }
    return *truth_;
  }

  const Regime& regime_;
  RayScene scene_;
  int most_samples_;
  const RunControl& run_;
  std::optional<Truth> truth_ = {};
};

}  // namespace

std::vector<StabilityCell> stability_cells(const Regime& regime, int most_samples, int threads) {
  WorkerPool workers(threads);
  const RunControl run{.workers = &workers};
  RegimeTrial trial(regime, most_samples, run);
  std::vector<StabilityCell> cells;
  for (const RenderMethod* method : render_methods()) {
    cells.push_back(trial.cell(std::string(method->name())));
  }
  cells.push_back(trial.cell("auto"));
  return cells;
}

std::string_view verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::held:
      return "held";
    case Verdict::over:
      return "over target";
    case Verdict::refused:
      return "refused";
    case Verdict::broken:
      return "BROKEN";
    case Verdict::not_finite:
      return "NOT FINITE";
    case Verdict::failed:
      return "FAILED";
  }
  return "";
}

}  // namespace fstop
