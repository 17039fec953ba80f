#include "tests/methods/truth.h"

#include <algorithm>
#include <cmath>

namespace fstop {
namespace {

double clipped(float value) { return std::clamp(static_cast<double>(value), 0.0, 1.0); }

// RMSE of the mean of two independent pictures, from their difference.
double noise_of_mean(const Image& a, const Image& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.pixels().size(); ++i) {
    const double off = clipped(a.pixels()[i]) - clipped(b.pixels()[i]);
    sum += off * off;
  }
  return 0.5 * std::sqrt(sum / static_cast<double>(a.pixels().size()));
}

}  // namespace

Truth::Truth(const SimulationSpec& spec, const RayScene& scene, double noise, int most_samples,
             const RunControl& run) {
  SimulationSpec reference = spec;
  reference.outputs = {Output::color};
  reference.quality = {.max_error = 1e-5, .method = "lens-sampling"};
  // Where nothing is out of focus, that too must be seen by rays through the whole pupil.
  if (spec.effects.defocus != EffectChoice::off) {
    reference.effects.defocus = EffectChoice::automatic;
  } else {
    reference.quality.method = "pinhole";
  }
  reference.effects.diffraction = EffectChoice::off;
  for (int samples = 64;;) {
    reference.quality.samples = samples;
    for (std::uint32_t i = 0; i < 2; ++i) {
      reference.seed = spec.seed + 0x51ed0001U + i;
      references_[i] = simulate(reference, scene, run).color;
    }
    samples_ = samples;
    noise_ = noise_of_mean(references_[0], references_[1]);
    if (noise_ <= noise || samples >= most_samples) return;
    // Scrambled nets converge at least as n^-1/2: one step mostly lands below.
    const double growth = std::pow(noise_ / noise, 1.7);
    int wanted = samples * 2;
    while (wanted < samples * growth && wanted < most_samples) wanted *= 2;
    samples = std::min(wanted, most_samples);
  }
}

TrueError Truth::error_of(const Image& picture) const {
  const auto count = static_cast<double>(picture.pixels().size());
  double sum = 0.0;
  for (std::size_t i = 0; i < picture.pixels().size(); ++i) {
    const double x = clipped(picture.pixels()[i]);
    sum += (x - clipped(references_[0].pixels()[i])) * (x - clipped(references_[1].pixels()[i]));
  }
  const double mse = std::max(0.0, sum / count);
  // Of the cross terms (X - T)(e_R + e_S) and e_R e_S, e of variance 2 noise^2; the pixels of a
  // block of 16 share pupil points, and a pixel's channels nearly all else.
  const double independent = std::max(1.0, count / 48.0);
  const double e2 = 2.0 * noise_ * noise_;
  const double mse_scatter = std::sqrt((2.0 * mse * e2 + e2 * e2) / independent);
  const double rmse = std::sqrt(mse);
  if (mse_scatter <= 0.0) return {.rmse = rmse};
  return {.rmse = rmse, .scatter = mse_scatter / (2.0 * std::max(rmse, std::sqrt(mse_scatter)))};
}

}  // namespace fstop
