#pragma once

#include <functional>

#include "core/render/method.h"
#include "core/render/sample_loop.h"

namespace fstop {

/// What is rendered pass by pass, each doubling the samples.
struct PassSeries {
  const SampleSource& source;
  Film& film;
  const std::vector<char>* tiles = nullptr;  // as SamplePass::tiles
  SampleSink* sink = nullptr;
  /// Called at the end of every pass with the film's noise; `halves` tells whether the pass holds
  /// as many samples as all before it. Returns the noise that the series is judged by.
  std::function<NoiseEstimate(const NoiseEstimate& noise, int samples, bool halves)> end_of_pass =
      {};
  int least_samples = 1;  // of the first pass, a power of two
  double begin = 0.0;     // progress reported goes from here
  double end = 1.0;       // to here
};

/// Doubles the samples of every pixel until the noise's 95 % bound, joined in squares with
/// `bias`, is at or under the shot's max_error; or renders the samples that were asked for; or
/// stops where max_time_ms would be passed. At most kMostSamples a pixel, then with a warning.
/// The outcome's images are left empty.
RenderOutcome render_progressively(const PassSeries& series, const QualitySpec& quality,
                                   double bias, const RunControl& run);

/// Factor from radiance to pixel value.
double exposure_of(const CameraSpec& camera);

/// The source of a shot's samples, seen through `camera`.
SampleSource sample_source(const Shot& shot, const Camera& camera, bool samples_pupil);

/// What leaving out diffraction costs a picture traced by rays; nothing where it is switched off.
/// A transfer loss of 0.41 Q for sharp points, at most 1.
/// Source: measured against the Hopkins integral with the pixel's box up to Nyquist; 0.27 Q from
/// 1.5 px of blur on, so that 0.41 Q holds for both.
std::vector<EffectLoss> omitted_diffraction(const Shot& shot, const ShotFacts& facts);

/// Rays that `noise` RMSE will take: a law of N^-0.6 for scrambled nets on mixed scenes, of N^-0.5
/// where diffuse surfaces light each other.
double predicted_rays(const ShotFacts& facts, double noise, double spread);

}  // namespace fstop
