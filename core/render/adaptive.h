#pragma once

#include "core/film/replicate_film.h"
#include "core/render/block_tracer.h"
#include "core/render/bokeh_splatting.h"
#include "core/render/method.h"

namespace fstop {

/// What a picture is made by beside samples of its own pixels.
struct AdaptiveMeans {
  double bias = 0.0;  // RMSE of what is left out
  /// Tiles whose blocks are interleaved, row by row (BlockGrid); may be null.
  const std::vector<std::uint8_t>* interleaved = nullptr;
  /// Samples are shared between neighbouring pixels where everything is out of focus, as far as
  /// the certificate shows a gain (see DefocusFilter).
  bool shares_samples = false;
  /// Light that is splatted beside the samples, whose rays pass through what sends it; may be null.
  const SplatSource* splats = nullptr;
};

/// Traces two replicates of a picture, each block by as many samples as its error asks for, until
/// the noise's 95 % bound, joined in squares with the bias, is at or under the shot's max_error; or
/// the samples that were asked for; or as many as max_time_ms allows.
///
/// A pilot of a few samples a pixel tells how fast each block converges; from then on every round
/// asks `allocated` for the counts that reach the target and traces them. Counts of a replicate
/// follow from the other's samples (see ReplicateFilm).
///
/// With max_time_ms rounds are as large as measured rates say, what is left after the last round
/// counted in, and end at the deadline whatever is untraced then. Two samples a pixel, one a
/// replicate, are taken in any case, since with less there is no picture or no error: a warning
/// says so where they took longer.
RenderOutcome rendered_adaptively(const SampleSource& source, const Shot& shot,
                                  const AdaptiveMeans& means, const RunControl& run);

/// Samples of a pixel, both replicates together.
inline constexpr int kMostSamples = 65536;

}  // namespace fstop
