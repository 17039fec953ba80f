#pragma once

#include "core/film/replicate_film.h"
#include "core/render/block_tracer.h"
#include "core/render/bokeh_splatting.h"
#include "core/render/method.h"

namespace fstop {

/// What a picture is rendered for, and by which means beside samples of its own pixels.
struct AdaptiveSpec {
  QualitySpec quality = {};
  std::uint32_t seed = 0;
  double bias = 0.0;  // RMSE of what is left out
  /// Samples are shared between neighbouring pixels where everything is out of focus, as far as
  /// the certificate shows a gain (see DefocusFilter).
  bool shares_samples = false;
  /// Light that is splatted beside the samples, whose rays pass through what sends it; may be null.
  const SplatSource* splats = nullptr;
};

/// Traces two replicates of a picture, each block by as many samples as its error asks for, until
/// the noise's 95 % bound, joined in squares with `bias`, is at or under max_error; or
/// the samples that were asked for; or as many as max_time_ms allows.
///
/// A pilot of a few samples a pixel tells how fast each block converges; from then on every round
/// asks `allocated` for the counts that reach the target and traces them. Counts of a replicate
/// follow from the other's samples (see ReplicateFilm).
RenderOutcome rendered_adaptively(const SampleSource& source, const AdaptiveSpec& spec,
                                  const RunControl& run);

/// Samples of a pixel, both replicates together.
inline constexpr int kMostSamples = 65536;

}  // namespace fstop
