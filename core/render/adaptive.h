#pragma once

#include "core/film/replicate_film.h"
#include "core/render/block_tracer.h"
#include "core/render/method.h"

namespace fstop {

/// Traces two replicates of a picture, each block by as many samples as its error asks for, until
/// the noise's 95 % bound, joined in squares with `bias`, is at or under the shot's max_error; or
/// the samples that were asked for; or as many as max_time_ms allows.
///
/// A pilot of a few samples a pixel tells how fast each block converges; from then on every round
/// asks `allocated` for the counts that reach the target and traces them. Counts of a replicate
/// follow from the other's samples (see ReplicateFilm).
RenderOutcome rendered_adaptively(const SampleSource& source, const QualitySpec& quality,
                                  std::uint32_t seed, double bias, const RunControl& run);

/// The same with samples shared between neighbouring pixels where everything is out of focus, as
/// far as the certificate shows a gain (see DefocusFilter).
RenderOutcome rendered_sharing(const SampleSource& source, const QualitySpec& quality,
                               std::uint32_t seed, double bias, const RunControl& run);

/// Samples of a pixel, both replicates together.
inline constexpr int kMostSamples = 65536;

}  // namespace fstop
