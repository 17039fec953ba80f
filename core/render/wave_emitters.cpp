#include "core/render/wave_emitters.h"

#include <array>
#include <cmath>

namespace fstop {
namespace {

constexpr std::uint32_t kFirstPoints = 4096;
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

// The mean of two pictures and half their difference.
void compare(const std::array<SplatImage, 2>& light, Image& mean, Image& off) {
  for (std::size_t i = 0; i < mean.pixels().size(); ++i) {
    const double a = light[0].values()[i];
    const double b = light[1].values()[i];
    mean.pixels()[i] = static_cast<float>(0.5 * (a + b));
    off.pixels()[i] = static_cast<float>(0.5 * (a - b));
  }
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

EmitterPicture emitter_picture(
    const SampleSource& rays, const WaveSurvey& survey, std::uint32_t seed, double target,
    const std::function<double(const Image& light, const Image& off)>& mse, const RunControl& run) {
  const int width = rays.sensor.width;
  const int height = rays.sensor.height;
  EmitterPicture picture{.light = Image(width, height, 3)};
  if (survey.emitters.emitters.empty()) return picture;
  const SplatSource source = splat_source(rays, survey.emitters, seed);
  std::array<SplatImage, 2> light = {SplatImage(width, height), SplatImage(width, height)};
  Image off(width, height, 3);
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
    compare(light, picture.light, off);
    picture.mse = mse(picture.light, off);
    if (std::sqrt(picture.mse) <= target) break;
  }
  return picture;
}

}  // namespace fstop
