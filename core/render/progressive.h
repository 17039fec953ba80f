#pragma once

#include "core/render/method.h"
#include "core/render/sample_loop.h"

namespace fstop {

/// Doubles the samples of every pixel until the noise's 95 % bound, joined in squares with
/// `bias`, is at or under the shot's max_error; or renders the samples that were asked for; or
/// stops where max_time_ms would be passed. At most kMostSamples a pixel, then with a warning.
RenderOutcome render_progressively(const SampleSource& source, const QualitySpec& quality,
                                   double bias, Film& film, const RunControl& run);

inline constexpr int kMostSamples = 65536;

/// The source of a shot's samples, seen through `camera`.
SampleSource sample_source(const Shot& shot, const Camera& camera, bool samples_pupil);

/// What leaving out diffraction costs a picture traced by rays; nothing where it is switched off.
/// A transfer loss of 0.41 Q for sharp points, at most 1.
/// Source: measured against the Hopkins integral with the pixel's box up to Nyquist; 0.27 Q from
/// 1.5 px of blur on, so that 0.41 Q holds for both.
std::vector<OmittedEffect> omitted_diffraction(const Shot& shot, const ShotFacts& facts);

/// Rays that `noise` RMSE will take: a law of N^-0.6 for scrambled nets on mixed scenes.
double predicted_rays(const ShotFacts& facts, double noise, double spread);

}  // namespace fstop
