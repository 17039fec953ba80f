#pragma once

#include "core/render/method.h"

namespace fstop {

/// One bundle of rays through the centre of projection: leaves out defocus and diffraction.
class PinholeTrace : public RenderMethod {
 public:
  std::string_view name() const noexcept override { return "pinhole"; }
  bool traces_in_parts() const noexcept override { return true; }
  Quote quote(const Shot& shot, const ShotFacts& facts) const override;
  RenderOutcome render(const Shot& shot, const ShotFacts& facts, double bias,
                       const RunControl& run) const override;
};

}  // namespace fstop
