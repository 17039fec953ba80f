#include "core/render/progressive.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <utility>

#include "core/optics/exposure.h"
#include "core/optics/pinhole.h"
#include "core/render/adaptive.h"
#include "core/render/texture_detail.h"
#include "core/shading/ray_tree.h"

namespace fstop {
namespace {

// First passes: small errors deserve a first look that is not blind to rare samples.
std::uint32_t first_count(const QualitySpec& quality) {
  return quality.max_error >= 0.02 ? 2U : 4U;
}

// Traces passes of a series and joins what they cost and how noisy they leave the film.
class PassRunner {
 public:
  PassRunner(const PassSeries& series, const RunControl& run) : series_(series), run_(run) {}

  // Traces the next `count` samples; progress, 0 to 1, reaches `progress`.
  void trace(std::uint32_t count, double progress) {
    const bool halves = count == done_;
    outcome_.rays += trace_pass(series_.source,
                                {.first = done_,
                                 .count = count,
                                 .begin = scaled(progress_),
                                 .end = scaled(progress),
                                 .tiles = series_.tiles,
                                 .sink = series_.sink},
                                series_.film, run_);
    progress_ = progress;
    done_ += count;
    const NoiseEstimate film_noise = series_.film.end_pass(static_cast<int>(count));
    const NoiseEstimate noise =
        series_.end_of_pass ? series_.end_of_pass(film_noise, static_cast<int>(count), halves)
                            : film_noise;
    // Passes smaller than what they join say nothing: the noise stays that of the largest net.
    if (halves) outcome_.noise = noise;
  }
  std::uint32_t done() const { return done_; }
  double progress() const { return progress_; }
  const NoiseEstimate& noise() const { return outcome_.noise; }
  void warn(const char* warning) { outcome_.warnings.emplace_back(warning); }
  RenderOutcome finish() {
    outcome_.samples_mean = done_;
    outcome_.samples_max = static_cast<int>(done_);
    return std::move(outcome_);
  }

 private:
  double scaled(double progress) const {
    return series_.begin + (series_.end - series_.begin) * progress;
  }

  const PassSeries& series_;
  const RunControl& run_;
  RenderOutcome outcome_;
  std::uint32_t done_ = 0;
  double progress_ = 0.0;
};

// A forced count that is no power of two is rendered as the sum of its powers, largest first, so
// that every part is an aligned net of the sequence.
RenderOutcome render_exactly(const PassSeries& series, std::uint32_t samples,
                             const RunControl& run) {
  PassRunner runner(series, run);
  const auto trace = [&](std::uint32_t count) {
    runner.trace(count, double(runner.done() + count) / samples);
  };
  std::uint32_t power = std::bit_floor(samples);
  if (power == 1) {
    trace(1);
    runner.warn("one sample a pixel: the noise cannot be told");
    RenderOutcome outcome = runner.finish();
    outcome.noise = {.mse = 1.0, .mse_upper_95 = 1.0, .unclipped_mse_upper_95 = 1.0, .energy = 1.0};
    return outcome;
  }
  trace(power / 2);
  trace(power / 2);
  while (runner.done() < samples) trace(std::bit_floor(samples - runner.done()));
  return runner.finish();
}

}  // namespace

RenderOutcome render_progressively(const PassSeries& series, const QualitySpec& quality,
                                   double bias, const RunControl& run) {
  if (quality.samples) {
    return render_exactly(series, static_cast<std::uint32_t>(*quality.samples), run);
  }
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed_ms = [&] {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
  };
  PassRunner runner(series, run);
  runner.trace(std::max(first_count(quality), static_cast<std::uint32_t>(series.least_samples)),
               0.1);
  while (true) {
    runner.trace(runner.done(), 0.5 * (1.0 + runner.progress()));
    // Where the omissions alone pass the target, noise is brought down to it all the same.
    const double noise = std::sqrt(runner.noise().mse_upper_95);
    const double error = bias < quality.max_error ? std::hypot(noise, bias) : noise;
    if (error <= quality.max_error) break;
    const std::int64_t pixels = std::int64_t{series.film.width()} * series.film.height();
    if (runner.done() >= kMostSamples ||
        2 * std::int64_t{runner.done()} * pixels > quality.most_samples) {
      runner.warn("the noise was still above the target at the most samples allowed");
      break;
    }
    // The next pass takes as long as all before it.
    if (quality.max_time_ms && 2.0 * elapsed_ms() > *quality.max_time_ms) {
      runner.warn("stopped by max_time_ms before the error was reached");
      break;
    }
  }
  if (run.progress) run.progress(series.end);
  return runner.finish();
}

double exposure_of(const CameraSpec& camera) {
  if (!camera.exposure) return 1.0;
  return exposure_factor(camera.shutter_seconds, camera.exposure->iso, working_f_number(camera));
}

namespace {

// Radiance below which light is traced by chance: each light then adds at most certain^2/4 to a
// sample's variance, a sixteenth of the target's square over four samples. What is wanted in
// a hurry has noise enough to hide more.
float certain_light(const Shot& shot) {
  constexpr double kInAHurry = 0.1;
  const QualitySpec& quality = shot.quality;
  const double value =
      quality.max_time_ms ? std::max(kInAHurry, quality.max_error) : quality.max_error;
  return static_cast<float>(value / std::max(exposure_of(shot.camera), 1e-6));
}

}  // namespace

SampleSource sample_source(const Shot& shot, const Camera& camera, bool samples_pupil) {
  const bool motion = shot.effects.motion != EffectChoice::off &&
                      (shot.scene->moves() || shot.camera.velocity != Vec3{});
  return {.scene = *shot.scene,
          .camera = camera,
          .sensor = shot.sensor,
          .pupil = PupilWarp(aperture_vertices(aperture_of(shot.camera))),
          .sequence = SampleSequence(shot.seed),
          .samples_pupil = samples_pupil,
          .falloff = shot.effects.falloff != EffectChoice::off,
          .exposure = static_cast<float>(exposure_of(shot.camera)),
          .shutter_seconds = motion ? static_cast<float>(shot.camera.shutter_seconds) : 0.0F,
          .velocity = motion ? to_float(shot.camera.velocity) : Vec3f{},
          .certain_light = certain_light(shot),
          .brightest = std::max(brightest_value(*shot.scene, exposure_of(shot.camera)),
                                static_cast<float>(shot.brightest)),
          .texture_width_px = static_cast<float>(texture_lookup_width(shot.quality)),
          .texture_disc_share = static_cast<float>(shot.quality.texture_disc_share),
          .illumination = shot.illumination,
          .hides_background = shot.hides_background};
}

std::vector<EffectLoss> omitted_diffraction(const Shot& shot, const ShotFacts& facts) {
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
  double order = 0.6;
  double rays_each = 1.0;
  if (facts.interreflects) {
    // Every pixel looks about the scene, whatever it shows, along paths of some turns.
    spread = std::max(spread, facts.contrast);
    order = 0.5;
    rays_each = 4.0;
  }
  const double samples = std::pow(std::max(1.0, spread / std::max(noise, 1e-9)), 1.0 / order);
  return facts.pixel_count * rays_each * std::clamp(samples, 4.0, double(kMostSamples));
}

}  // namespace fstop
