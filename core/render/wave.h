#pragma once

#include "core/render/method.h"

namespace fstop {

/// Diffraction by layers of depth: sharp light, traced through the centre of projection, is
/// convolved with the exact point spread of its defocus, per channel:
///
///     picture = sum over layers of light * waves + Airy * [V (rays - sum of light * discs)]
///
/// Near edges in depth (V = 1) the pupil is sampled too, and what its rays tell beyond discs
/// without occlusion - light hidden, light seen past an edge - is added, as sharp as diffraction in
/// focus leaves it. Elsewhere V is 0 and the picture has no noise but that of the sharp light. With
/// ever less diffraction waves become discs, Airy's pattern a point and the picture that of
/// lens-sampling.
class Wave : public RenderMethod {
 public:
  std::string_view name() const noexcept override { return "wave"; }
  Quote quote(const Shot& shot, const ShotFacts& facts) const override;
  RenderOutcome render(const Shot& shot, const ShotFacts& facts, double bias,
                       const RunControl& run) const override;
};

}  // namespace fstop
