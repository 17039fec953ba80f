#pragma once

#include "core/render/method.h"

namespace fstop {

/// Distributed ray tracing over pixel, pupil, time and area lights (Cook 1984): unbiased in
/// geometric optics; leaves out diffraction alone.
class LensSampling : public RenderMethod {
 public:
  std::string_view name() const noexcept override { return "lens-sampling"; }
  bool traces_in_parts() const noexcept override { return true; }
  Quote quote(const Shot& shot, const ShotFacts& facts) const override;
  RenderOutcome render(const Shot& shot, const ShotFacts& facts, double bias,
                       const RunControl& run) const override;
};

/// The same samples, shared between neighbouring pixels where everything that they have met is out
/// of focus: fewer are needed for the same error. What sharing adds is measured with the noise.
class LensReconstruction : public RenderMethod {
 public:
  std::string_view name() const noexcept override { return "lens-reconstruction"; }
  bool traces_in_parts() const noexcept override { return true; }
  Quote quote(const Shot& shot, const ShotFacts& facts) const override;
  RenderOutcome render(const Shot& shot, const ShotFacts& facts, double bias,
                       const RunControl& run) const override;
};

/// Lens reconstruction for all but small bright emitters, which samples rarely find: those are
/// traced from their own points through the pupil onto the film.
class BokehSplatting : public RenderMethod {
 public:
  std::string_view name() const noexcept override { return "bokeh-splatting"; }
  bool traces_in_parts() const noexcept override { return true; }
  Quote quote(const Shot& shot, const ShotFacts& facts) const override;
  RenderOutcome render(const Shot& shot, const ShotFacts& facts, double bias,
                       const RunControl& run) const override;
};

}  // namespace fstop
