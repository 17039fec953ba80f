#include "core/render/gather.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/error.h"
#include "core/render/certificate.h"
#include "core/render/gather_blur.h"
#include "core/render/layers.h"
#include "core/render/pinhole_trace.h"
#include "core/render/progressive.h"
#include "core/render/shot_facts.h"

namespace fstop {
namespace {

// What the sharp picture is made with has nothing in common with the certificate's samples.
constexpr std::uint32_t kSharpSeed = 0x6a7e0001U;
// A tap on one pixel costs this share of a ray: 4 ns beside 50 ns, measured at 37 px of blur.
constexpr double kTapRays = 0.08;

std::string too_large(double blur_px) {
  char text[96];
  std::snprintf(text, sizeof text, "needs blur discs of at most %.0f px, and one has %.4g px",
                kLargestGatherPx, blur_px);
  return text;
}

// Samples of a pixel of the sharp picture: its own noise shall be small beside max_error where
// nothing is blurred.
int sharp_samples(const QualitySpec& quality) {
  if (quality.samples) return *quality.samples;
  if (quality.max_error >= 0.03) return 4;
  return quality.max_error >= 0.006 ? 16 : 64;
}

// Samples of a pixel in each replicate that the certificate may take.
std::uint32_t certificate_samples(const Shot& shot) {
  constexpr double kMost = 64.0;
  const double pixels = static_cast<double>(shot.sensor.width) * shot.sensor.height;
  const double allowed =
      static_cast<double>(shot.quality.most_samples) / pixels - sharp_samples(shot.quality);
  return static_cast<std::uint32_t>(
      std::clamp(allowed / kReplicates, double(kFirstCertificate), kMost));
}

// A part of the run, from `begin` to `end` of its progress.
RunControl part_of(const RunControl& run, double begin, double end) {
  RunControl part = run;
  if (run.progress) {
    part.progress = [&run, begin, end](double fraction) {
      run.progress(begin + (end - begin) * fraction);
    };
  }
  return part;
}

double largest_blur(const Image& coc) {
  double largest = 0.0;
  for (const float blur : coc.pixels()) {
    largest = std::max(largest, std::abs(static_cast<double>(blur)));
  }
  return largest;
}

struct SharpRender {
  SharpPicture picture = {};
  std::uint64_t rays = 0;
};

// The picture through the centre of projection, as much wider as discs in it reach.
SharpRender sharp_render(const Shot& shot, const RunControl& run) {
  const double blur_px = largest_blur(geometry_layers(shot, run).coc);
  if (blur_px > kLargestGatherPx) {
    throw Error(ErrorCode::outside_domain, "gather: " + too_large(blur_px));
  }
  const int margin = gather_margin(aperture_of(shot.camera), blur_px);
  Shot wide = shot;
  wide.sensor.width += 2 * margin;
  wide.sensor.height += 2 * margin;
  wide.seed = hash_of(shot.seed, kSharpSeed);
  wide.quality.samples = sharp_samples(shot.quality);
  RenderOutcome outcome = PinholeTrace().render(wide, {}, 0.0, run);
  const auto pixels = static_cast<std::uint64_t>(shot.sensor.width) *
                          static_cast<std::uint64_t>(shot.sensor.height) +
                      static_cast<std::uint64_t>(wide.sensor.width) *
                          static_cast<std::uint64_t>(wide.sensor.height);
  return {.picture = {.color = std::move(outcome.color),
                      .coc = geometry_layers(wide, run).coc,
                      .margin = margin},
          .rays = outcome.rays + pixels};
}

Certificate certificate_for(const Shot& shot, const Image& picture, double omitted,
                            const RunControl& run) {
  const Camera camera = camera_of(shot.camera, shot.sensor);
  const double target = shot.quality.max_error;
  // Where the omissions alone pass the target, the error is known against it all the same.
  const double others = omitted < target ? omitted : 0.0;
  return certified(picture, sample_source(shot, camera, true),
                   {.mse = target * target - others * others,
                    .most_samples = certificate_samples(shot),
                    .seed = shot.seed},
                   run);
}

EffectLoss defocus_of(const Certificate& certificate) {
  char why[128];
  std::snprintf(why, sizeof why,
                "gathered from one picture; measured against 2 x %u lens samples a pixel",
                certificate.samples);
  return {.effect = "defocus",
          .why = why,
          .modelled = true,
          .offset = std::sqrt(certificate.error.mse_upper_95),
          .certified = true};
}

}  // namespace

Quote Gather::quote(const Shot& shot, const ShotFacts& facts) const {
  if (facts.carries_light) return {.refusal = kCarriesNoLight};
  if (shot.quality.sampling.any()) return {.refusal = kSequenceAlone};
  if (shot.scene != nullptr && shot.scene->has_screen_maps()) return {.refusal = kScreenMapsStay};
  if (shot.effects.diffraction == EffectChoice::on) {
    return {.refusal = "blurs by geometry, which shows no diffraction: wave does"};
  }
  if (shot.effects.defocus == EffectChoice::off) {
    return {.refusal = "blurs by depth, and defocus is switched off"};
  }
  if (!std::holds_alternative<LensSpec>(shot.camera.optics)) {
    return {.refusal = "blurs as a lens does, and the camera is a pinhole"};
  }
  if (facts.largest_blur_px > kLargestGatherPx) {
    return {.refusal = too_large(facts.largest_blur_px)};
  }
  Quote quote;
  // Two pictures of one mean that differ from it by the picture's contrast at most differ from each
  // other by twice as much: nothing better is known beforehand.
  quote.error.effects = {{.effect = "defocus",
                          .transfer_loss = 2.0,
                          .why = "gathered from one picture, which misses what foregrounds hide",
                          .modelled = true}};
  std::ranges::move(omitted_diffraction(shot, facts), std::back_inserter(quote.error.effects));
  quote.error.rmse = loss_rmse(quote.error.effects, facts.contrast);
  const double disc = 0.25 * 3.1416 * facts.largest_blur_px * facts.largest_blur_px;
  // Taps fill discs of up to 16 px radius and thin out beyond: some 600 for each doubling.
  const double taps =
      std::min(disc, 800.0 + 600.0 * std::log2(std::max(1.0, facts.largest_blur_px / 32.0)));
  quote.cost_rays = facts.pixel_count * (sharp_samples(shot.quality) + 2.0 + kTapRays * taps +
                                         kReplicates * double(certificate_samples(shot)));
  return quote;
}

RenderOutcome Gather::render(const Shot& shot, const ShotFacts& facts, double,
                             const RunControl& run) const {
  const SharpRender sharp = sharp_render(shot, part_of(run, 0.0, 0.3));
  RenderOutcome outcome;
  outcome.color = gathered(sharp.picture, aperture_of(shot.camera), run);
  std::vector<EffectLoss> effects = omitted_diffraction(shot, facts);
  const double omitted = loss_rmse(effects, contrast_of(outcome.color));
  if (run.progress) run.progress(0.6);
  Certificate certificate = certificate_for(shot, outcome.color, omitted, run);
  effects.insert(effects.begin(), defocus_of(certificate));
  outcome.effects = std::move(effects);
  outcome.variance = std::move(certificate.tiles);
  outcome.noise = certificate.error;
  outcome.samples_mean = sharp_samples(shot.quality);
  outcome.samples_max = sharp_samples(shot.quality);
  outcome.rays = sharp.rays + certificate.rays;
  if (run.progress) run.progress(1.0);
  return outcome;
}

}  // namespace fstop
