#include "core/render/lens_sampling.h"

#include <cmath>

#include "core/render/adaptive.h"
#include "core/render/progressive.h"
#include "core/render/splatted_light.h"

namespace fstop {
namespace {

constexpr double kLeastShare = 0.18;  // of a blur disc, in which samples are shared

}  // namespace

Quote LensSampling::quote(const Shot& shot, const ShotFacts& facts) const {
  if (shot.effects.diffraction == EffectChoice::on) {
    return {.refusal = "traces rays, which show no diffraction: wave does"};
  }
  if (shot.effects.defocus == EffectChoice::off) {
    return {.refusal = "samples the pupil, and defocus is switched off"};
  }
  Quote quote;
  quote.error.effects = omitted_diffraction(shot, facts);
  // What samples miss their noise does not show. As for a disc that is missing: pixels change by at
  // most 1, so that the sum of squares is at most that of the light, not here and seen elsewhere.
  if (facts.emitters_splatted > 0) {
    quote.error.effects.push_back(
        {.effect = "small emitters left to samples",
         .why = "which may miss their discs or thin them out",
         .offset = std::sqrt(2.0 * facts.emitter_px / facts.pixel_count)});
  }
  quote.error.rmse = loss_rmse(quote.error.effects, facts.contrast);
  // Pixels mix what lies within a blur disc: their spread is that of the whole picture.
  quote.cost_rays = predicted_rays(facts, shot.quality.max_error, facts.contrast);
  // Samples find a small emitter once in thousands.
  if (facts.emitters_splatted > 0) quote.cost_rays *= 50.0;
  return quote;
}

RenderOutcome LensSampling::render(const Shot& shot, const ShotFacts&, double bias,
                                   const RunControl& run) const {
  const Camera camera = camera_of(shot.camera, shot.sensor);
  return rendered_adaptively(sample_source(shot, camera, true), shot, {.bias = bias}, run);
}

Quote LensReconstruction::quote(const Shot& shot, const ShotFacts& facts) const {
  Quote quote = LensSampling().quote(shot, facts);
  if (!quote.refusal.empty()) return quote;
  if (facts.largest_blur_px * kLeastShare < 1.0) {
    return {.refusal = "no blur disc is wide enough to share samples within"};
  }
  if (shot.quality.sampling.any()) return {.refusal = kSequenceAlone};
  // The pilot decides whether to share; looking costs some pixel operations.
  quote.cost_rays *= 1.0 - 0.5 * facts.blurred_share;
  quote.cost_rays += 2.0 * facts.pixel_count;
  return quote;
}

RenderOutcome LensReconstruction::render(const Shot& shot, const ShotFacts& facts, double bias,
                                         const RunControl& run) const {
  const Camera camera = camera_of(shot.camera, shot.sensor);
  return rendered_adaptively(
      sample_source(shot, camera, true), shot,
      {.bias = bias, .interleaved = &facts.soft_tiles, .shares_samples = true}, run);
}

Quote BokehSplatting::quote(const Shot& shot, const ShotFacts& facts) const {
  if (facts.camera_moves) return {.refusal = "the camera moves: its emitters are left to samples"};
  if (facts.emitters_splatted == 0) {
    return {.refusal = "no small emitter brighter than white lies before this camera"};
  }
  if (shot.quality.sampling.any()) return {.refusal = kSequenceAlone};
  ShotFacts rest = facts;
  rest.emitters_splatted = 0;
  Quote quote = LensSampling().quote(shot, rest);
  if (!quote.refusal.empty()) return quote;
  quote.cost_rays *= 1.0 - 0.5 * facts.blurred_share;
  quote.cost_rays += 2.0 * facts.pixel_count + 1024.0 * facts.emitters_splatted;
  return quote;
}

RenderOutcome BokehSplatting::render(const Shot& shot, const ShotFacts& facts, double bias,
                                     const RunControl& run) const {
  const Camera camera = camera_of(shot.camera, shot.sensor);
  SampleSource samples = sample_source(shot, camera, true);
  const Splatting splatting(camera, shot.seed, samples);
  return rendered_adaptively(samples, shot,
                             {.bias = bias,
                              .interleaved = &facts.soft_tiles,
                              .shares_samples = facts.largest_blur_px * kLeastShare >= 1.0,
                              .splats = splatting.light()},
                             run);
}

}  // namespace fstop
