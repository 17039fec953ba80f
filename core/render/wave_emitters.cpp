#include "core/render/wave_emitters.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace fstop {
namespace {

constexpr std::uint32_t kFirstPoints = 1024;
constexpr std::uint32_t kMostPoints = std::uint32_t{1} << 18;
constexpr std::uint32_t kSharpReplicate = 2;  // beside the two of the pupil

std::vector<SplatRange> all_emitters(const EmitterChoice& choice, std::uint32_t first,
                                     std::uint32_t count, double weight) {
  std::vector<SplatRange> ranges;
  for (std::uint32_t i = 0; i < choice.emitters.size(); ++i) {
    ranges.push_back({.emitter = i, .first = first, .count = count, .weight = weight});
  }
  return ranges;
}

// Mean square of half the difference of two pictures, in the mask, over the whole picture.
double half_difference_mse(const std::array<SplatImage, 2>& light, const VisibilityMask& mask) {
  double sum = 0.0;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (!mask.covers(x, y)) continue;
      const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(mask.width) +
                         static_cast<std::size_t>(x);
      for (std::size_t c = 0; c < 3; ++c) {
        const double a = std::clamp(light[0].at(pixel)[c], 0.0, 1.0);
        const double b = std::clamp(light[1].at(pixel)[c], 0.0, 1.0);
        sum += 0.25 * (a - b) * (a - b);
      }
    }
  }
  return sum / (3.0 * mask.width * static_cast<double>(mask.height));
}

}  // namespace

std::uint64_t lay_down_emitters(const SampleSource& rays, const WaveSurvey& survey,
                                std::uint32_t seed, std::uint32_t first, std::uint32_t count,
                                SharpSplatSink& sink, const RunControl& run) {
  if (survey.emitters.emitters.empty()) return 0;
  const std::vector<SplatRange> ranges =
      all_emitters(survey.emitters, first * kSplatsPerSample, count * kSplatsPerSample, count);
  return splat_sharp(splat_source(rays, survey.emitters, seed), kSharpReplicate, ranges, sink, run);
}

EmitterPicture emitter_picture(const SampleSource& rays, const WaveSurvey& survey,
                               const VisibilityMask& mask, std::uint32_t seed, double target,
                               const RunControl& run) {
  EmitterPicture picture{.light = Image(rays.sensor.width, rays.sensor.height, 3)};
  if (survey.emitters.emitters.empty()) return picture;
  const SplatSource source = splat_source(rays, survey.emitters, seed);
  std::array<SplatImage, 2> light = {SplatImage(rays.sensor.width, rays.sensor.height),
                                     SplatImage(rays.sensor.width, rays.sensor.height)};
  std::uint32_t done = 0;
  for (std::uint32_t count = kFirstPoints; done < kMostPoints; count = done) {
    // What is there and what comes each count half, but for the first.
    const double weight = done == 0 ? 1.0 : 0.5;
    const std::vector<SplatRange> ranges = all_emitters(survey.emitters, done, count, weight);
    for (std::uint32_t replicate = 0; replicate < 2; ++replicate) {
      for (double& value : light[replicate].values()) value *= 0.5;  // zero at first
      picture.rays += splat(source, replicate, ranges, light[replicate], {}, run);
    }
    done += count;
    picture.mse = half_difference_mse(light, mask);
    if (std::sqrt(picture.mse) <= target) break;
  }
  for (std::size_t i = 0; i < picture.light.pixels().size(); ++i) {
    picture.light.pixels()[i] =
        static_cast<float>(0.5 * (light[0].values()[i] + light[1].values()[i]));
  }
  return picture;
}

}  // namespace fstop
