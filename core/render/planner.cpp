#include "core/render/planner.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

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
  return reason + ": bound " + rounded(quote.error.rmse) + ", while at most " +
         rounded(kOmissionShare * max_error) + " may be left out of a target of " +
         rounded(max_error);
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

struct Candidate {
  const RenderMethod* method = nullptr;
  Quote quote = {};
  std::string shortfall = {};  // empty: it keeps the promise
};

// The cheapest that keeps the promise; where none does, the cheapest of those whose bound is at
// most a quarter above the smallest: a hair's breadth is worth no tenfold cost. Null: all refuse.
const Candidate* best_of(const std::vector<Candidate>& candidates) {
  bool any = false;
  double smallest = std::numeric_limits<double>::infinity();
  for (const Candidate& c : candidates) {
    if (!c.quote.refusal.empty()) continue;
    any = any || c.shortfall.empty();
    smallest = std::min(smallest, c.quote.error.rmse);
  }
  const Candidate* best = nullptr;
  for (const Candidate& c : candidates) {
    if (!c.quote.refusal.empty()) continue;
    if (any ? !c.shortfall.empty() : c.quote.error.rmse > 1.25 * smallest) continue;
    if (best == nullptr || c.quote.cost_rays < best->quote.cost_rays) best = &c;
  }
  return best;
}

void take_cheapest(MethodPlan& plan, std::span<const RenderMethod* const> methods, const Shot& shot,
                   const ShotFacts& facts) {
  std::vector<Candidate> candidates;
  for (const RenderMethod* method : methods) {
    Quote quote = method->quote(shot, facts);
    std::string reason = shortfall(quote, shot.quality.max_error);
    candidates.push_back({method, std::move(quote), std::move(reason)});
  }
  const Candidate* best = best_of(candidates);
  for (const Candidate& c : candidates) {
    if (&c == best) continue;
    plan.passed_over.push_back(
        {std::string(c.method->name()), c.shortfall.empty() ? "costs more rays" : c.shortfall});
  }
  if (best == nullptr) throw Error(ErrorCode::no_valid_method, explained(plan.passed_over));
  plan.method = best->method;
  plan.quote = best->quote;
}

ModelledEffect modelled(std::string effect, std::string why) {
  return {.effect = std::move(effect), .modelled = true, .bound = 0.0, .why = std::move(why)};
}

ModelledEffect branches_of(const Shot& shot, const ShotFacts& facts) {
  const bool followed = shot.illumination != Illumination::local;
  return {.effect = "reflection and transmission",
          .modelled = followed,
          .bound = facts.branch_error,
          .why = followed
                     ? "followed until the brightest that shines or is seen adds less than " +
                           rounded(kSmallestBranch) + " or lies " + std::to_string(kDeepestBranch) +
                           " deep; what is lit unseen is taken as no brighter"
                     : "left out, as illumination local says: not part of the error"};
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
    model.push_back(modelled("motion", facts.camera_moves
                                           ? "the camera moves while the shutter is open"
                                           : "objects move while the shutter is open"));
  } else {
    model.push_back({.effect = "motion",
                     .why = facts.moves ? "switched off" : "nothing moves during the exposure"});
  }
  if (facts.area_lights) model.push_back(modelled("area light", "sampled over its surface"));
  if (facts.mirrors) model.push_back(branches_of(shot, facts));
  if (facts.interreflects) {
    model.push_back({.effect = "diffuse interreflection",
                     .modelled = true,
                     .bound = facts.mirrors ? 0.0 : facts.branch_error,
                     .why = "paths end by chance, the last " + std::to_string(kDeepestBranch) +
                            " deep; in place of ambient light, which is left out"});
  }
  model.push_back(shot.effects.falloff != EffectChoice::off
                      ? modelled("falloff", "cos^4 of the chief ray")
                      : ModelledEffect{.effect = "falloff", .why = "switched off"});
  return model;
}

}  // namespace fstop
