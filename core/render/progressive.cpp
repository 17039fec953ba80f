#include "core/render/progressive.h"

#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "core/optics/exposure.h"
#include "core/optics/pinhole.h"
#include "core/render/texture_detail.h"

namespace fstop {
namespace {

// First passes: small errors deserve a first look that is not blind to rare samples.
std::uint32_t first_count(const QualitySpec& quality) {
  return quality.max_error >= 0.02 ? 2U : 4U;
}

// A forced count that is no power of two is rendered as the sum of its powers, largest first, so
// that every part is an aligned net of the sequence.
RenderOutcome render_exactly(const SampleSource& source, std::uint32_t samples, Film& film,
                             const RunControl& run) {
  RenderOutcome outcome;
  std::uint32_t done = 0;
  const auto trace = [&](std::uint32_t count) {
    outcome.rays += trace_pass(source, done, count, film, run, double(done) / samples,
                               double(done + count) / samples);
    const NoiseEstimate noise = film.end_pass(static_cast<int>(count));
    done += count;
    return noise;
  };
  std::uint32_t power = std::bit_floor(samples);
  if (power == 1) {
    trace(1);
    outcome.warnings.push_back("one sample a pixel: the noise cannot be told");
    return outcome;
  }
  trace(power / 2);
  outcome.noise = trace(power / 2);
  while (done < samples) {
    power = std::bit_floor(samples - done);
    trace(power);  // the noise stays that of the largest net: an upper estimate
  }
  return outcome;
}

}  // namespace

RenderOutcome render_progressively(const SampleSource& source, const QualitySpec& quality,
                                   double bias, Film& film, const RunControl& run) {
  if (quality.samples) {
    return render_exactly(source, static_cast<std::uint32_t>(*quality.samples), film, run);
  }
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed_ms = [&] {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
  };
  RenderOutcome outcome;
  std::uint32_t count = first_count(quality);
  outcome.rays += trace_pass(source, 0, count, film, run, 0.0, 0.1);
  film.end_pass(static_cast<int>(count));
  double progress = 0.1;
  while (true) {
    const double next = progress + 0.5 * (1.0 - progress);
    outcome.rays += trace_pass(source, count, count, film, run, progress, next);
    progress = next;
    outcome.noise = film.end_pass(static_cast<int>(count));
    count *= 2;
    // Where the omissions alone pass the target, noise is brought down to it all the same.
    const double noise = std::sqrt(outcome.noise.mse_upper_95);
    const double error = bias < quality.max_error ? std::hypot(noise, bias) : noise;
    if (error <= quality.max_error) break;
    const std::int64_t pixels = std::int64_t{film.width()} * film.height();
    if (count >= kMostSamples || 2 * std::int64_t{count} * pixels > quality.most_samples) {
      outcome.warnings.push_back(
          "the noise was still above the target at the most samples allowed");
      break;
    }
    // The next pass takes as long as all before it.
    if (quality.max_time_ms && 2.0 * elapsed_ms() > *quality.max_time_ms) {
      outcome.warnings.push_back("stopped by max_time_ms before the error was reached");
      break;
    }
  }
  if (run.progress) run.progress(1.0);
  return outcome;
}

SampleSource sample_source(const Shot& shot, const Camera& camera, bool samples_pupil) {
  const bool motion = shot.effects.motion != EffectChoice::off && shot.scene->moves();
  const double exposure =
      shot.camera.exposure ? exposure_factor(shot.camera.shutter_seconds, shot.camera.exposure->iso,
                                             working_f_number(shot.camera))
                           : 1.0;
  return {.scene = *shot.scene,
          .camera = camera,
          .sensor = shot.sensor,
          .pupil = PupilWarp(aperture_vertices(aperture_of(shot.camera))),
          .sequence = SampleSequence(shot.seed),
          .samples_pupil = samples_pupil,
          .falloff = shot.effects.falloff == EffectChoice::on,
          .exposure = static_cast<float>(exposure),
          .shutter_seconds = motion ? static_cast<float>(shot.camera.shutter_seconds) : 0.0F,
          .texture_width_px = static_cast<float>(texture_lookup_width(shot.quality.max_error))};
}

std::vector<OmittedEffect> omitted_diffraction(const Shot& shot, const ShotFacts& facts) {
  if (shot.effects.diffraction == EffectChoice::off) return {};
  const double airy_px = airy_diameter(shot.camera.wavelength, working_f_number(shot.camera)) /
                         shot.sensor.pixel_pitch;
  char why[64];
  std::snprintf(why, sizeof why, "Airy diameter %.2g px", airy_px);
  return {{.effect = "diffraction",
           .transfer_loss = std::min(1.0, 0.41 * facts.diffraction_q),
           .why = why}};
}

double predicted_rays(const ShotFacts& facts, double noise, double spread) {
  const double samples = std::pow(std::max(1.0, spread / std::max(noise, 1e-9)), 1.0 / 0.6);
  return facts.pixel_count * std::clamp(samples, 4.0, double(kMostSamples));
}

}  // namespace fstop
