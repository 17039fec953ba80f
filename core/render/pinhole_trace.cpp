#include "core/render/pinhole_trace.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/render/adaptive.h"
#include "core/render/progressive.h"
#include "core/render/splatted_light.h"

namespace fstop {
namespace {

constexpr double kSharpPoint = 0.05;  // px of blur that leave a point a point

// A disc of c px costs a sharp image 0.17 c^2 of transfer up to 1 px; beyond, all of it and the
// reversed contrast of the first lobe of J1, 0.1323.
double defocus_loss(double blur_px) { return std::min(0.17 * blur_px * blur_px, 1.1323); }

}  // namespace

Quote PinholeTrace::quote(const Shot& shot, const ShotFacts& facts) const {
  if (shot.effects.diffraction == EffectChoice::on) {
    return {.refusal = "traces rays, which show no diffraction: wave does"};
  }
  if (shot.effects.defocus == EffectChoice::on) {
    return {.refusal = "has no pupil, and defocus must be modelled"};
  }
  const bool has_pupil = shot.effects.defocus != EffectChoice::off;
  if (has_pupil && shot.quality.sampling.lens != SamplePattern::low_discrepancy) {
    return {.refusal = "has no pupil, and a pattern was asked for on it"};
  }
  Quote quote;
  if (shot.effects.defocus == EffectChoice::automatic) {
    char why[64];
    std::snprintf(why, sizeof why, "largest blur disc %.2g px", facts.largest_blur_px);
    quote.error.effects.push_back(
        {.effect = "defocus", .transfer_loss = defocus_loss(facts.largest_blur_px), .why = why});
  }
  // A bright point is a disc where it is out of focus: pixels change by at most 1, so that the sum
  // of squares is at most that of the light that is moved, away from here and to there.
  const bool defocus = shot.effects.defocus == EffectChoice::automatic;
  if (defocus && facts.emitter_px > 0.0 && facts.largest_blur_px > kSharpPoint) {
    quote.error.effects.push_back(
        {.effect = "defocus of small bright emitters",
         .why = "their discs are missing",
         .offset = std::sqrt(2.0 * facts.emitter_px / facts.pixel_count)});
  }
  std::ranges::move(omitted_diffraction(shot, facts), std::back_inserter(quote.error.effects));
  quote.error.rmse = loss_rmse(quote.error.effects, facts.contrast);
  // Only pixels on an edge mix values: a tenth of the picture's spread.
  quote.cost_rays = predicted_rays(facts, shot.quality.max_error, 0.1 * facts.contrast);
  return quote;
}

RenderOutcome PinholeTrace::render(const Shot& shot, const ShotFacts&, double bias,
                                   const RunControl& run) const {
  const Camera camera = central_projection(shot.camera, shot.sensor);
  SampleSource samples = sample_source(shot, camera, false);
  const Splatting splatting(camera, shot.seed, samples);
  return rendered_adaptively(samples, shot, {.bias = bias, .splats = splatting.light()}, run);
}

}  // namespace fstop
