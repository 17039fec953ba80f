#include "core/render/planner.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/error.h"
#include "core/render/texture_detail.h"
#include "core/shading/ray_tree.h"

namespace fstop {
namespace {

// Omissions may take at most this share of the error, so that noise has 80 % of it left:
// the two add in squares.
constexpr double kOmissionShare = 0.6;

std::string rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

// Why a method cannot keep the promise; empty if it can.
std::string shortfall(const Quote& quote, double max_error) {
  if (!quote.refusal.empty()) return quote.refusal;
  if (quote.error.rmse <= kOmissionShare * max_error) return {};
  std::string reason;
  for (const EffectLoss& loss : quote.error.effects) {
    if (loss.rmse(1.0) <= 0.0) continue;
    reason += (reason.empty() ? "" : " and ") +
              std::string(loss.modelled ? "models with an error " : "leaves out ") + loss.effect +
              " (" + loss.why + ")";
  }
  return reason + ": bound " + rounded(quote.error.rmse) + " of the target " + rounded(max_error);
}

std::string explained(const std::vector<PassedOverMethod>& passed_over) {
  std::string text = "no method covers this shot";
  for (const PassedOverMethod& method : passed_over) {
    text += "; " + method.method + ": " + method.why;
  }
  return text;
}

void take_named(MethodPlan& plan, std::span<const RenderMethod* const> methods, const Shot& shot,
                const ShotFacts& facts) {
  for (const RenderMethod* method : methods) {
    if (method->name() != shot.quality.method) {
      plan.passed_over.push_back({std::string(method->name()), "another method was asked for"});
      continue;
    }
    Quote quote = method->quote(shot, facts);
    if (!quote.refusal.empty()) {
      throw Error(ErrorCode::no_valid_method, shot.quality.method + ": " + quote.refusal);
    }
    plan.method = method;
    plan.quote = std::move(quote);
  }
  if (plan.method == nullptr) {
    throw Error(ErrorCode::no_valid_method,
                "there is no method " + shot.quality.method + " in this version");
  }
}

void take_cheapest(MethodPlan& plan, std::span<const RenderMethod* const> methods, const Shot& shot,
                   const ShotFacts& facts) {
  const RenderMethod* closest = nullptr;  // the smallest bound, if none is small enough
  Quote closest_quote;
  for (const RenderMethod* method : methods) {
    Quote quote = method->quote(shot, facts);
    if (std::string reason = shortfall(quote, shot.quality.max_error); !reason.empty()) {
      if (quote.refusal.empty() &&
          (closest == nullptr || quote.error.rmse < closest_quote.error.rmse)) {
        closest = method;
        closest_quote = quote;
      }
      plan.passed_over.push_back({std::string(method->name()), std::move(reason)});
    } else if (plan.method == nullptr || quote.cost_rays < plan.quote.cost_rays) {
      if (plan.method != nullptr) {
        plan.passed_over.push_back({std::string(plan.method->name()), "costs more rays"});
      }
      plan.method = method;
      plan.quote = std::move(quote);
    } else {
      plan.passed_over.push_back({std::string(method->name()), "costs more rays"});
    }
  }
  if (plan.method != nullptr) return;
  if (closest == nullptr) throw Error(ErrorCode::no_valid_method, explained(plan.passed_over));
  plan.method = closest;
  plan.quote = std::move(closest_quote);
  std::erase_if(plan.passed_over,
                [&](const PassedOverMethod& m) { return m.method == closest->name(); });
}

ModelledEffect modelled(std::string effect, std::string why) {
  return {.effect = std::move(effect), .modelled = true, .bound = 0.0, .why = std::move(why)};
}

}  // namespace

double loss_rmse(std::span<const EffectLoss> effects, double contrast) {
  double rmse = 0.0;
  for (const EffectLoss& effect : effects) rmse += effect.rmse(contrast);
  return rmse;
}

MethodPlan planned_method(std::span<const RenderMethod* const> methods, const Shot& shot,
                          const ShotFacts& facts) {
  MethodPlan plan;
  if (shot.quality.method == "auto") {
    take_cheapest(plan, methods, shot, facts);
  } else {
    take_named(plan, methods, shot, facts);
  }
  if (std::string reason = shortfall(plan.quote, shot.quality.max_error); !reason.empty()) {
    plan.warnings.push_back(std::string(plan.method->name()) + " " + reason);
  }
  return plan;
}

std::vector<ModelledEffect> model_of(const Shot& shot, const ShotFacts& facts,
                                     const MethodPlan& plan, double contrast) {
  std::vector<ModelledEffect> model;
  const std::vector<EffectLoss>& effects = plan.quote.error.effects;
  const auto told = [&](const char* name) {
    return std::ranges::any_of(effects, [&](const EffectLoss& e) { return e.effect == name; });
  };
  if (!told("defocus")) {
    model.push_back(
        shot.effects.defocus == EffectChoice::off
            ? ModelledEffect{.effect = "defocus", .why = "switched off"}
            : modelled("defocus", "largest blur disc " + rounded(facts.largest_blur_px) + " px"));
  }
  for (const EffectLoss& loss : effects) {
    model.push_back({.effect = loss.effect,
                     .modelled = loss.modelled,
                     .bound = loss.rmse(contrast),
                     .why = loss.why});
  }
  if (shot.effects.diffraction == EffectChoice::off) {
    model.push_back({.effect = "diffraction", .why = "switched off"});
  }
  if (facts.moves && shot.effects.motion != EffectChoice::off) {
    model.push_back(modelled("motion", "objects move while the shutter is open"));
  } else {
    model.push_back({.effect = "motion",
                     .why = facts.moves ? "switched off" : "nothing moves during the exposure"});
  }
  if (facts.area_lights) model.push_back(modelled("area light", "sampled over its surface"));
  if (facts.mirrors) {
    model.push_back({.effect = "reflection and transmission",
                     .modelled = true,
                     .bound = facts.branch_error,
                     .why = "followed until a branch counts less than " + rounded(kSmallestBranch) +
                            " or lies " + std::to_string(kDeepestBranch) + " deep"});
  }
  model.push_back(shot.effects.falloff == EffectChoice::on
                      ? modelled("falloff", "cos^4 of the chief ray")
                      : ModelledEffect{.effect = "falloff", .why = "switched off"});
  return model;
}

}  // namespace fstop
