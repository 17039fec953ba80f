#pragma once

#include "core/render/method.h"

namespace fstop {

/// Discs of larger diameter, in pixels, are refused: they bound the work on a pixel.
inline constexpr double kLargestGatherPx = 256.0;

/// Blurs one picture, seen through the centre of projection, by its depth (gather_blur.h), and
/// certifies the result by lens samples (certificate.h). What foregrounds hide is missing from that
/// picture, so that its error is unknown until the certificate tells it: auto has no reason to take
/// it, and it is here to be compared with.
class Gather : public RenderMethod {
 public:
  std::string_view name() const noexcept override { return "gather"; }
  Quote quote(const Shot& shot, const ShotFacts& facts) const override;
  RenderOutcome render(const Shot& shot, const ShotFacts& facts, double bias,
                       const RunControl& run) const override;
};

}  // namespace fstop
