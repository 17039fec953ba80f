#pragma once

#include "core/render/method.h"

namespace fstop {

/// The method that was chosen, why, and what it leaves out.
struct MethodPlan {
  const RenderMethod* method = nullptr;
  Quote quote = {};
  std::vector<PassedOverMethod> passed_over = {};
  std::vector<std::string> warnings = {};
};

/// The cheapest method whose omissions leave room for noise under the shot's max_error; if none
/// does, the cheapest whose bound is at most a quarter above the smallest, and a warning. A method
/// the request names is taken unless it refuses the shot. Throws: Error{no_valid_method} with every
/// method's reason.
MethodPlan planned_method(std::span<const RenderMethod* const> methods, const Shot& shot,
                          const ShotFacts& facts);

/// Every effect of the full model: in the image, or left out with its bound for `contrast`.
std::vector<ModelledEffect> model_of(const Shot& shot, const ShotFacts& facts,
                                     const MethodPlan& plan, double contrast);

}  // namespace fstop
