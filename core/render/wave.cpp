#include "core/render/wave.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "core/film/square_sums.h"
#include "core/render/layer_sink.h"
#include "core/render/progressive.h"
#include "core/render/simulation.h"
#include "core/render/wave_emitters.h"
#include "core/render/wave_spread.h"
#include "core/render/wave_survey.h"

namespace fstop {
namespace {

constexpr int kMostLayers = 24;
constexpr double kWidePlane = 64.0;  // elements a pixel: more than a usual picture's
// Beyond 40 waves a disc is right to 0.165 W^(-3/4) = 0.010, as rays show it.
constexpr double kLargestDefocusOfWaves = 500.0;

double transfer_tolerance(const QualitySpec& quality) {
  return std::clamp(0.5 * quality.max_error, 0.0005, 0.01);
}

// What a disc alone would be wrong by at |U| and beyond.
double disc_loss(double defocus) {
  const double waves = std::abs(defocus) / (4.0 * std::numbers::pi);
  return std::min(1.0, 0.165 * std::pow(std::max(waves, 1e-3), -0.75));
}

// What rays get wrong of light at |U| and beyond: no more than where it would be sharp.
double far_loss(double defocus, double q) { return std::min({1.0, disc_loss(defocus), 0.41 * q}); }

// The noise of a mean of two halves of a spread picture: its pixels share light with their
// neighbours, `shared` of them, so that as many fewer tell of the error.
NoiseEstimate spread_noise(const Image& mean, const Image& half_difference, double shared,
                           double energy) {
  SquareSums squares;
  const std::size_t pixels = mean.pixels().size() / 3;
  for (std::size_t i = 0; i < pixels; ++i) {
    double mse = 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double value = mean.pixels()[3 * i + c];
      const double off = half_difference.pixels()[3 * i + c];
      const double a = std::clamp(value + off, 0.0, 1.0);
      const double b = std::clamp(value - off, 0.0, 1.0);
      mse += (a - b) * (a - b) / 12.0;
    }
    squares.add(mse);
  }
  const auto count = static_cast<double>(pixels);
  return {.mse = squares.mean(count),
          .mse_upper_95 = squares.upper_95(count, shared),
          .energy = energy};
}

// Cells along a pixel: where samples are counted, as many as they fall into evenly.
int cells_for(const Shot& shot, const WaveOptics& optics, const WaveSurvey& survey) {
  int cells = WaveSpreader::cells_for(optics.q(), survey.sensor.width, survey.sensor.height);
  while (shot.quality.samples && *shot.quality.samples % (cells * cells) != 0) cells /= 2;
  return cells;
}

double total_light(const Image& image) {
  double sum = 0.0;
  for (const float value : image.pixels()) sum += static_cast<double>(value);
  return sum;
}

// The sharp light of a shot and what it becomes behind the pupil.
class SharpLight {
 public:
  SharpLight(const Shot& shot, const WaveOptics& optics, const WaveSurvey& survey,
             const DepthNodes& nodes, const VisibilityMask& mask, const RunControl& run)
      : frame_{.width = shot.sensor.width,
               .height = shot.sensor.height,
               .guard = survey.guard,
               .cells = cells_for(shot, optics, survey),
               .light_reach = survey.light_reach},
        with_discs_(mask.share > 0.0),
        shared_pixels_(1.0 + std::numbers::pi * std::pow(2.0 * optics.q(), 2)),
        run_(run),
        spreader_(optics, nodes, frame_, transfer_tolerance(shot.quality), run),
        total_(survey.sensor.width, survey.sensor.height, frame_.cells,
               static_cast<int>(nodes.defocuses().size())),
        pass_(survey.sensor.width, survey.sensor.height, frame_.cells, total_.layers()),
        sink_(optics, nodes, mask, survey, pass_) {
    // A wide disc smooths as much.
    for (const double u : nodes.defocuses()) {
      shared_pixels_ =
          std::max(shared_pixels_, 0.25 * std::numbers::pi * std::pow(optics.disc_px(u), 2));
    }
  }

  LayerSink& sink() { return sink_; }
  int samples() const { return samples_; }
  const WaveSpreader& spreader() const { return spreader_; }
  int cells() const { return frame_.cells; }
  double shared_pixels() const { return shared_pixels_; }

  // Judges by the sharp light's own noise, which spreading only lowers, where that is enough;
  // else spreads the difference of the halves.
  NoiseEstimate end_of_pass(const NoiseEstimate& sharp, int samples, bool halves, double target,
                            bool has_emitters) {
    NoiseEstimate noise = sharp;
    noise.mse_upper_95 = sharp.unclipped_mse_upper_95;
    noise.mse = std::min(sharp.mse, noise.mse_upper_95);
    spread_.reset();
    // Of splats the film knows nothing: only the layers do.
    if (halves && (has_emitters || std::sqrt(noise.mse_upper_95) > target)) {
      const float scale = factor(2 * samples);
      const Image off = spreader_.spread_roughly({total_, scale, &pass_, -scale}, run_);
      spread_ = spreader_.spread({total_, scale, &pass_, scale}, with_discs_, run_);
      noise = spread_noise(spread_->waves, off, shared_pixels_, sharp.energy);
      if (has_emitters) {
        const double all_light = std::max(total_light(spread_->waves), 1e-30);
        noise.energy = std::hypot(sharp.energy, total_light(off) / all_light);
      }
    }
    total_.take(pass_);
    samples_ += samples;
    return noise;
  }

  const SpreadLight& spread() {
    if (!spread_) spread_ = spreader_.spread({total_, factor(samples_)}, with_discs_, run_);
    return *spread_;
  }

 private:
  // From sums over the samples of a cell to radiance.
  float factor(int samples) const {
    return static_cast<float>(frame_.cells * frame_.cells) / static_cast<float>(samples);
  }

  WaveSpreader::Frame frame_;
  bool with_discs_;
  double shared_pixels_;
  const RunControl& run_;
  WaveSpreader spreader_;
  LightLayers total_;
  LightLayers pass_;
  LayerSink sink_;
  std::optional<SpreadLight> spread_;
  int samples_ = 0;
};

// A copy of `image` without `guard` pixels on every side.
Image cropped(const Image& image, int guard) {
  Image inner(image.width() - 2 * guard, image.height() - 2 * guard, image.channels());
  for (int y = 0; y < inner.height(); ++y) {
    std::copy_n(image.at(guard, y + guard), inner.width() * inner.channels(), inner.at(0, y));
  }
  return inner;
}

// V (rays - discs): what discs without occlusion get wrong.
Image hidden_light(const VisibilityMask& mask, const Image& rays, const Image& discs) {
  Image hidden(rays.width(), rays.height(), 3);
  for (int y = 0; y < rays.height(); ++y) {
    for (int x = 0; x < rays.width(); ++x) {
      if (!mask.covers(x, y)) continue;
      for (int c = 0; c < 3; ++c) hidden.at(x, y)[c] = rays.at(x, y)[c] - discs.at(x, y)[c];
    }
  }
  return hidden;
}

void add_to(Image& image, const Image& more) {
  for (std::size_t i = 0; i < image.pixels().size(); ++i) image.pixels()[i] += more.pixels()[i];
}

std::string plain(const char* format, double a, double b = 0.0, double c = 0.0) {
  char text[160];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

// The losses of the finished picture, in its own terms.
std::vector<EffectLoss> losses_of(const WaveOptics& optics, const DepthNodes& nodes,
                                  const VisibilityMask& mask, const SharpLight& light,
                                  double largest_disc_px, bool defocus) {
  const WaveSpreader& spreader = light.spreader();
  std::vector<EffectLoss> losses;
  // The wave model's own error is no more than what leaving waves out would be.
  const double transfer = spreader.transfer_error() +
                          (nodes.interpolates() ? spreader.tolerance() : 0.0) +
                          std::min(spreader.model_error(), 0.41 * optics.q());
  double largest = 0.0;
  for (const double u : nodes.defocuses()) largest = std::max(largest, std::abs(u));
  const std::string regime =
      std::string(name_of(diffraction_regime(largest))) +
      plain(", up to %.3g Fresnel zones", largest / (2.0 * std::numbers::pi));
  losses.push_back({.effect = "diffraction",
                    .transfer_loss = transfer,
                    .why = regime + "; " +
                           plain("Airy diameter %.2g px, %.0f layers of depth, %.0f wavelengths",
                                 2.44 * optics.q(), double(nodes.defocuses().size()),
                                 double(spreader.wavelengths())),
                    .modelled = true});
  if (!defocus) return losses;
  // Near an edge waves and discs lose light alike, at worst as wrong as leaving waves out.
  const double near_edges =
      std::min(1.0, 0.41 * optics.q()) * std::sqrt(mask.occluded_share) + mask.fine_edge_loss;
  if (near_edges > 0.0) {
    losses.push_back({.effect = "diffraction at edges in depth",
                      .transfer_loss = near_edges,
                      .why = plain("%.2g of the picture lies near one: rays tell what is hidden",
                                   mask.occluded_share)});
  }
  if (mask.beyond_share > 0.0) {
    losses.push_back(
        {.effect = "diffraction far out of focus",
         .transfer_loss = far_loss(nodes.reach(), optics.q()) * std::sqrt(mask.beyond_share),
         .why = plain("discs of up to %.3g px are shown by rays", largest_disc_px)});
  }
  return losses;
}

double root_mean_square(const Image& image) {
  double sum = 0.0;
  for (const float value : image.pixels()) {
    const double clipped = std::clamp(static_cast<double>(value), 0.0, 1.0);
    sum += clipped * clipped;
  }
  return std::sqrt(sum / static_cast<double>(image.pixels().size()));
}

// Films, layers and transforms of a picture this large, all at once; and the transforms of one
// whose point spreads are far wider than itself.
std::string memory_refusal(const Shot& shot, double q, double plane_elements) {
  constexpr double kBytesPerPixel = 300.0;  // of a picture so large that a cell is a pixel
  constexpr double kMostGigabytes = 8.0;
  const double gigabytes =
      kBytesPerPixel * shot.sensor.width * static_cast<double>(shot.sensor.height) / 1e9;
  if (gigabytes > kMostGigabytes) {
    return plain("needs about %.0f GB of memory for a picture of this size; at most %.0f are taken",
                 gigabytes, kMostGigabytes);
  }
  if (plane_elements > WaveSpreader::kMostPlaneElements) {
    return plain(
        "spreads light by an Airy disc of %.3g px: transforms wide enough for that have %.2g "
        "elements; at most %.2g are taken",
        2.44 * q, plane_elements, WaveSpreader::kMostPlaneElements);
  }
  return {};
}

// Light that comes from beyond the guard: at distance x from the border a share 2 Q/(pi^3 (g + x))
// of it, 2/(pi^2 v) of a point's light lying behind a line at v; averaged in squares over the
// frame. Borders add up (at most 1.2 times), and a triangle's rim is 1.28 times a disc's: 0.1.
double border_loss(const WaveOptics& optics, const WaveSurvey& survey, double largest_disc_px) {
  const double beyond = std::max(1.0, survey.light_reach - 0.5 * largest_disc_px);
  const int width = survey.sensor.width - 2 * survey.guard;
  const int height = survey.sensor.height - 2 * survey.guard;
  return 0.1 * optics.q() * std::sqrt((2.0 / width + 2.0 / height) / beyond);
}

}  // namespace

Quote Wave::quote(const Shot& shot, const ShotFacts& facts) const {
  if (facts.carries_light) return {.refusal = kCarriesNoLight};
  if (shot.quality.sampling.any()) return {.refusal = kSequenceAlone};
  if (shot.scene != nullptr && shot.scene->has_screen_maps()) return {.refusal = kScreenMapsStay};
  Quote quote;
  if (shot.effects.diffraction == EffectChoice::off) {
    quote.refusal = "models diffraction, which is switched off";
    return quote;
  }
  if (facts.camera_moves) {
    quote.refusal = "convolves layers of depth, which a moving camera mixes";
    return quote;
  }
  const WaveOptics optics(shot);
  quote.refusal = optics.refusal();
  if (!quote.refusal.empty()) return quote;
  const double tolerance = transfer_tolerance(shot.quality);
  const bool defocus = shot.effects.defocus != EffectChoice::off;
  const double widest =
      std::min(facts.largest_blur_px, std::abs(optics.disc_px(kLargestDefocusOfWaves)));
  const double elements =
      WaveSpreader::plane_elements(optics.q(), defocus ? widest : 0.0, shot.sensor.width,
                                   shot.sensor.height, light_reach(shot, facts, optics));
  quote.refusal = memory_refusal(shot, optics.q(), elements);
  if (!quote.refusal.empty()) return quote;
  // Layers on both sides of the focus, and whether they reach what is most defocused.
  const double largest = defocus ? std::abs(optics.defocus_of_px(facts.largest_blur_px)) : 0.0;
  const double layers = 1.0 + 2.0 * defocus_steps(largest) / std::sqrt(tolerance / 0.01);
  const bool all_waves = largest <= kLargestDefocusOfWaves && layers <= kMostLayers;
  const double traced = all_waves ? facts.edge_share : 1.0;
  quote.error.effects.push_back({.effect = "diffraction",
                                 .transfer_loss = tolerance,
                                 .why = plain("Airy diameter %.2g px, exact point spreads by depth",
                                              2.44 * facts.diffraction_q),
                                 .modelled = true});
  const double near =
      std::min(1.0, facts.edge_area + facts.edge_length * 4.88 * facts.diffraction_q);
  if (defocus && near > 0.0) {
    quote.error.effects.push_back(
        {.effect = "diffraction at edges in depth",
         .transfer_loss = std::min(1.0, 0.41 * facts.diffraction_q) * std::sqrt(near),
         .why = plain("about %.2g of the picture lies near one", near)});
  }
  if (!all_waves) {
    // Half the most steps on either side of the focus.
    const double reach =
        std::min(kLargestDefocusOfWaves,
                 defocus_after(0.5 * (kMostLayers - 1) * std::sqrt(tolerance / 0.01)));
    quote.error.effects.push_back(
        {.effect = "diffraction far out of focus",
         .transfer_loss = far_loss(reach, facts.diffraction_q),
         .why = plain("discs of up to %.3g px are shown by rays", facts.largest_blur_px)});
  }
  quote.error.rmse = loss_rmse(quote.error.effects, facts.contrast);
  // The sharp picture, the pupil where it must be sampled, and the transforms: half a ray an
  // element, of which a usual picture has four a pixel.
  const double planes = 3.0 * std::min(layers, double(kMostLayers)) + 3.0;
  const double beyond = elements > kWidePlane * facts.pixel_count ? elements : 0.0;
  quote.cost_rays = predicted_rays(facts, shot.quality.max_error, 0.1 * facts.contrast) +
                    traced * predicted_rays(facts, shot.quality.max_error, facts.contrast) +
                    planes * std::max(2.0 * facts.pixel_count, 0.5 * beyond);
  return quote;
}

RenderOutcome Wave::render(const Shot& shot, const ShotFacts& facts, double bias,
                           const RunControl& run) const {
  const WaveOptics optics(shot);
  const WaveSurvey survey = wave_survey(shot, facts, optics, run);
  const DepthNodes nodes(survey.seen, transfer_tolerance(shot.quality), kMostLayers,
                         kLargestDefocusOfWaves);
  const bool defocus = shot.effects.defocus != EffectChoice::off;
  const VisibilityMask mask = visibility_mask(survey, optics, nodes);
  const bool needs_rays = mask.share > 0.0;
  SharpLight light(shot, optics, survey, nodes, mask, run);

  // Sharp light and rays have half the noise each, in squares.
  const double half = needs_rays ? std::numbers::sqrt2 / 2.0 : 1.0;
  QualitySpec quality = shot.quality;
  quality.max_error *= half;
  if (quality.max_time_ms) *quality.max_time_ms *= needs_rays ? 0.4 : 0.8;
  const double room = bias < shot.quality.max_error
                          ? half * std::sqrt(std::pow(shot.quality.max_error, 2) - bias * bias)
                          : quality.max_error;

  Shot wide = shot;
  wide.sensor = survey.sensor;
  const Camera centre = central_projection(shot.camera, wide.sensor);
  Film film(wide.sensor.width, wide.sensor.height);
  SampleSource sharp = sample_source(wide, centre, false);
  sharp.mask = survey.emitters.camera_mask;
  const bool has_emitters = !survey.emitters.emitters.empty();
  std::uint64_t splat_rays = 0;
  const auto end_of_pass = [&](const NoiseEstimate& noise, int samples, bool halves) {
    splat_rays +=
        lay_down_emitters(sharp, survey, shot.seed, static_cast<std::uint32_t>(light.samples()),
                          static_cast<std::uint32_t>(samples), light.sink(), run);
    return light.end_of_pass(noise, samples, halves, room, has_emitters);
  };
  RenderOutcome outcome = render_progressively({.source = sharp,
                                                .film = film,
                                                .sink = &light.sink(),
                                                .end_of_pass = end_of_pass,
                                                .least_samples = light.cells() * light.cells(),
                                                .end = needs_rays ? 0.5 : 0.9},
                                               quality, half * bias, run);
  outcome.rays += survey.rays + splat_rays;
  outcome.splats_emitters = has_emitters;
  outcome.color = light.spread().waves;
  outcome.variance = cropped(film.variance(), survey.guard);
  if (needs_rays) {
    const Camera camera = camera_of(shot.camera, shot.sensor);
    SampleSource source = sample_source(shot, camera, true);
    source.mask = survey.emitters.camera_mask;
    // A tenth of the noise, in squares, is left to splats, spread as what is hidden will be.
    const Image dark(shot.sensor.width, shot.sensor.height, 3);
    const auto splat_mse = [&](const Image& seen, const Image& off) {
      const WaveSpreader& spreader = light.spreader();
      return spread_noise(spreader.spread_in_focus(hidden_light(mask, seen, dark), run),
                          spreader.spread_in_focus(hidden_light(mask, off, dark), run), 1.0, 0.0)
          .mse;
    };
    const EmitterPicture emitters =
        emitter_picture(source, survey, shot.seed, 0.3 * quality.max_error, splat_mse, run);
    outcome.rays += emitters.rays;
    Film rays(shot.sensor.width, shot.sensor.height);
    rays.keep_difference();
    const auto joined = [&] {
      Image sum = outcome.color;
      Image seen = rays.mean();
      add_to(seen, emitters.light);
      const Image hidden = hidden_light(mask, seen, light.spread().discs);
      add_to(sum, light.spreader().spread_in_focus(hidden, run));
      return sum;
    };
    // Light brighter than a pixel can show is spread into pixels that show it: so is its noise.
    const auto spread_out = [&](const NoiseEstimate& noise, int, bool halves) {
      if (!halves || noise.unclipped_mse_upper_95 < 1.5 * noise.mse_upper_95) return noise;
      return spread_noise(joined(), light.spreader().spread_in_focus(rays.half_difference(), run),
                          light.shared_pixels(), noise.energy);
    };
    const RenderOutcome traced = render_progressively({.source = source,
                                                       .film = rays,
                                                       .tiles = &mask.tiles,
                                                       .end_of_pass = spread_out,
                                                       .begin = 0.5,
                                                       .end = 1.0},
                                                      quality, half * bias, run);
    const double traced_light = total_light(rays.mean());
    outcome.color = joined();
    add_to(outcome.variance, rays.variance());
    outcome.rays += traced.rays;
    outcome.noise.mse += traced.noise.mse + emitters.mse;
    outcome.noise.mse_upper_95 += traced.noise.mse_upper_95 + emitters.mse;
    const double all_light = std::max(total_light(outcome.color), 1e-30);
    outcome.noise.energy = std::hypot(
        outcome.noise.energy, std::min(1.0, traced_light / all_light) * traced.noise.energy);
    outcome.samples_mean += mask.share * traced.samples_mean;
    outcome.samples_max += traced.samples_max;
    for (const std::string& warning : traced.warnings) {
      if (std::ranges::count(outcome.warnings, warning) == 0) outcome.warnings.push_back(warning);
    }
  }
  if (run.progress) run.progress(1.0);
  outcome.effects = losses_of(optics, nodes, mask, light, facts.largest_blur_px, defocus);
  const double level = root_mean_square(outcome.color);
  // Point spreads that change over the field do not add up to a constant where it is uniform.
  outcome.effects->front().offset = light.spreader().field_error() * level;
  const double border = border_loss(optics, survey, facts.largest_blur_px) * level;
  outcome.effects->push_back({.effect = "light from far outside the frame",
                              .why = plain("diffracted from more than %.0f px beyond the border",
                                           double(survey.light_reach)),
                              .offset = border});
  return outcome;
}

double transform_bytes(double diffraction_px, int width, int height) {
  const double elements = WaveSpreader::plane_elements(diffraction_px, 0.0, width, height, 0);
  return WaveSpreader::plane_bytes(std::min(elements, WaveSpreader::kMostPlaneElements));
}

}  // namespace fstop
