#pragma once

#include "core/render/method.h"

namespace fstop {

/// Probes the shot's scene with at most 20,000 rays through the centre of projection.
/// Without a scene the facts are those of a scene that reaches from close up to infinity.
ShotFacts facts_of(const Shot& shot, const RunControl& run = {});

/// Standard deviation of an image's values, clipped to [0,1], over pixels and channels.
double contrast_of(const Image& image, const RunControl& run = {});

/// Root mean square of the five-point Laplacian of the values, clipped to [0,1].
double curvature_of(const Image& image, const RunControl& run = {});

}  // namespace fstop
