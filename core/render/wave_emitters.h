#pragma once

#include <functional>

#include "core/render/bokeh_splatting.h"
#include "core/render/wave_survey.h"

namespace fstop {

/// Points of an emitter for each sample of a pixel of the sharp picture: its place and light are
/// smooth, so that few are needed.
inline constexpr std::uint32_t kSplatsPerSample = 32;

/// Lays sharp light of the survey's emitters down, as the samples [first, first + count) of every
/// pixel would on average: what a point's splat adds to a pixel, times `count`. `rays` looks
/// through the centre of projection. Returns the number of rays.
std::uint64_t lay_down_emitters(const SampleSource& rays, const WaveSurvey& survey,
                                std::uint32_t seed, std::uint32_t first, std::uint32_t count,
                                SharpSplatSink& sink, const RunControl& run);

/// Light of the survey's emitters through the whole pupil, 3 channels, and its noise.
struct EmitterPicture {
  Image light = {};
  double mse = 0.0;
  std::uint64_t rays = 0;
};

/// Splats with two independent replicates until mse(their mean, half their difference) is at most
/// that of `target`, or 2^18 points of each emitter were taken.
EmitterPicture emitter_picture(
    const SampleSource& rays, const WaveSurvey& survey, std::uint32_t seed, double target,
    const std::function<double(const Image& light, const Image& off)>& mse, const RunControl& run);

}  // namespace fstop
