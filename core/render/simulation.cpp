#include "core/render/simulation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/render/coverage.h"
#include "core/render/gather.h"
#include "core/render/layers.h"
#include "core/render/lens_sampling.h"
#include "core/render/pinhole_trace.h"
#include "core/render/planner.h"
#include "core/render/progressive.h"
#include "core/render/shot_facts.h"
#include "core/render/texture_detail.h"
#include "core/render/wave.h"
#include "core/shading/material.h"

namespace fstop {
namespace {

constexpr std::array<std::pair<Output, std::string_view>, 10> kOutputNames = {
    {{Output::color, "color"},
     {Output::depth, "depth"},
     {Output::coc, "coc"},
     {Output::all_in_focus, "all_in_focus"},
     {Output::variance, "variance"},
     {Output::normal, "normal"},
     {Output::distance, "distance"},
     {Output::coc_diameter, "coc_diameter"},
     {Output::valid, "valid"},
     {Output::alpha, "alpha"}}};

std::string width_text(const QualitySpec& quality) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", texture_lookup_width(quality));
  return text;
}

bool wants(const SimulationSpec& spec, Output output) {
  return std::ranges::count(spec.outputs, output) > 0;
}

Shot shot_of(const SimulationSpec& spec, const RayScene* scene) {
  return {.scene = scene,
          .camera = spec.camera,
          .sensor = sensor_of(spec.camera, spec.width, spec.height),
          .quality = spec.quality,
          .effects = spec.effects,
          .illumination = spec.illumination,
          .seed = spec.seed,
          .hides_background = wants(spec, Output::alpha),
          .wants_variance = wants(spec, Output::variance)};
}

// The picture that a perfect lens with everything in focus would give, from as many samples.
Image all_in_focus(const Shot& shot, int samples, const RunControl& run) {
  Shot sharp = shot;
  sharp.quality.samples = samples;
  sharp.parts.sharp_samples = static_cast<std::uint32_t>(samples);
  return PinholeTrace().render(sharp, {}, 0.0, run).color;
}

// One value of each pixel made of another's.
template <typename Function>
Image each(const Image& from, const Function& function) {
  Image made(from.width(), from.height(), 1);
  std::ranges::transform(from.pixels(), made.pixels().begin(), function);
  return made;
}

std::map<Output, Image> layers_of(const SimulationSpec& spec, const Shot& shot,
                                  const RenderOutcome& outcome, const RunControl& run) {
  std::map<Output, Image> layers;
  const auto has = [&](Output output) { return wants(spec, output); };
  constexpr std::array kOfGeometry = {Output::depth,    Output::coc,          Output::normal,
                                      Output::distance, Output::coc_diameter, Output::valid};
  if (std::ranges::any_of(kOfGeometry, has)) {
    GeometryLayers geometry = geometry_layers(shot, run);
    const double um_per_px = 1e6 * shot.sensor.pixel_pitch.si();
    if (has(Output::coc_diameter)) {
      layers[Output::coc_diameter] = each(geometry.coc, [&](float px) {
        return static_cast<float>(um_per_px * std::abs(static_cast<double>(px)));
      });
    }
    if (has(Output::valid)) {
      layers[Output::valid] =
          each(geometry.depth, [](float depth) { return std::isfinite(depth) ? 1.0F : 0.0F; });
    }
    if (has(Output::distance)) layers[Output::distance] = std::move(geometry.distance);
    if (has(Output::depth)) layers[Output::depth] = std::move(geometry.depth);
    if (has(Output::coc)) layers[Output::coc] = std::move(geometry.coc);
    if (has(Output::normal)) layers[Output::normal] = std::move(geometry.normal);
  }
  if (has(Output::variance)) layers[Output::variance] = outcome.variance;
  if (has(Output::all_in_focus)) {
    layers[Output::all_in_focus] = all_in_focus(shot, outcome.samples_max, run);
  }
  return layers;
}

// RMSE of what the outcome's noise does not hold already.
double uncertified_rmse(std::vector<EffectLoss> effects, double contrast) {
  std::erase_if(effects, [](const EffectLoss& effect) { return effect.certified; });
  return loss_rmse(effects, contrast);
}

// What mirrors and glass show of small emitters, their rays meet as rarely as those of the camera
// would, and replicates that both missed it do not tell. About the light of as many discs as such
// surfaces fill of the picture: beside the estimate, part of the bound.
double unseen_emitters_rmse(const ShotFacts& facts) {
  if (facts.emitters_splatted == 0) return 0.0;
  const double all = facts.emitter_px * facts.emitters_found / facts.emitters_splatted;
  return std::sqrt(2.0 * all * facts.branch_share / facts.pixel_count);
}

// Light that lamps send by mirrors and glass is carried to what the camera sees straight. Mirrors
// and glass that show such places would show it, too, and do not: as much of it as of their share
// of the picture.
double mirrored_caustics_rmse(const RenderOutcome& outcome, const ShotFacts& facts) {
  return outcome.carried_rms * std::sqrt(facts.mirror_share);
}

// RMSE of branches that are not followed, though the request asks for them.
double error_of_branches(const Shot& shot, const ShotFacts& facts) {
  return shot.illumination == Illumination::local ? 0.0 : facts.branch_error;
}

void report_carried_light(const RenderOutcome& outcome, const ShotFacts& facts,
                          RenderReport& report) {
  report.model.push_back({.effect = "caustics",
                          .modelled = true,
                          .bound = 0.0,
                          .why = "what lamps send by mirrors and glass, carried forward along " +
                                 std::to_string(outcome.carried_paths) + " paths"});
  const double missing = mirrored_caustics_rmse(outcome, facts);
  if (!(missing > 0.0)) return;
  report.model.push_back({.effect = "caustics in mirrors and glass",
                          .modelled = false,
                          .bound = missing,
                          .why = "carried to what is seen straight only; part of the bound"});
}

// Images of bright things in mirrors and glass may be as small as they like. By the rule of three
// those that no sample met fill, weighed by the samples of each pixel, less than 3 samples; a pixel
// turns white where one in L of its points shows what is L times white, as the strongest mirror
// shows the brightest thing: 3 L/n of them at most.
double unseen_highlights_rmse(const Shot& shot, const ShotFacts& facts,
                              const RenderOutcome& outcome) {
  const bool shows_others = facts.mirrors && shot.illumination != Illumination::local;
  if (!shows_others || shot.scene == nullptr) return 0.0;
  double strongest = 0.0;
  for (const Material& m : shot.scene->scene().materials)
    strongest = std::max({strongest, m.reflection, m.transmission});
  const double shown = strongest * facts.brightest;
  if (!(shown > 1.0)) return 0.0;
  const double samples = std::max(1.0, outcome.samples_mean * facts.pixel_count);
  return std::sqrt(std::min(facts.mirror_share, 3.0 * shown / samples));
}

void report_unseen_highlights(double rmse, const ShotFacts& facts, RenderReport& report) {
  if (!(rmse > 0.0)) return;
  char why[160];
  std::snprintf(why, sizeof why,
                "images in mirrors and glass of what is up to %.3g times white, if no sample met "
                "any: at 95 %%; part of the bound",
                facts.brightest);
  report.model.push_back(
      {.effect = "highlights that no sample saw", .modelled = false, .bound = rmse, .why = why});
}

// The finished image's error: noise and what was left out add in squares, since noise is as
// often too bright as too dark.
ImageError error_of(const RenderOutcome& outcome, double bias, double unseen, double target) {
  // Two-sided 95 % of a normal distribution.
  // Values clipped to [0,1] differ by at most 1.
  const double square = bias * bias;
  return {
      .estimate = std::min(1.0, std::sqrt(outcome.noise.mse + square)),
      .upper_95 = std::min(1.0, std::sqrt(outcome.noise.mse_upper_95 + square + unseen * unseen)),
      .target = target,
      .energy = outcome.noise.energy,
      .energy_upper_95 = 1.959964 * outcome.noise.energy};
}

}  // namespace

std::span<const RenderMethod* const> render_methods() {
  static const PinholeTrace pinhole;
  static const LensReconstruction lens_reconstruction;
  static const LensSampling lens_sampling;
  static const Wave wave;
  static const BokehSplatting bokeh_splatting;
  static const Gather gather;
  static const std::array<const RenderMethod*, 6> methods = {
      &pinhole, &lens_reconstruction, &bokeh_splatting, &gather, &lens_sampling, &wave};
  return methods;
}

namespace {

// What the chief rays' cos^4 would change at most: RMS of value (1 - cos^4), values clipped to
// [0,1].
double falloff_rmse(const Shot& shot, const Image& image, const RunControl& run) {
  const Camera camera = camera_of(shot.camera, shot.sensor);
  std::vector<double> rows(static_cast<std::size_t>(image.height()));
  parallel_for(run, image.height(), [&](int y) {
    double squares = 0.0;
    for (int x = 0; x < image.width(); ++x) {
      // The corner that is farthest from the axis: no less than the pixel's mean.
      const Vec2 raster{2 * x < image.width() ? x : x + 1.0, 2 * y < image.height() ? y : y + 1.0};
      const double lost =
          1.0 - std::visit([&](const auto& any) { return any.falloff(raster); }, camera);
      for (int c = 0; c < 3; ++c) {
        const double value = std::clamp(static_cast<double>(image.at(x, y)[c]), 0.0, 1.0);
        squares += lost * lost * value * value;
      }
    }
    rows[static_cast<std::size_t>(y)] = squares;
  });
  return std::sqrt(std::accumulate(rows.begin(), rows.end(), 0.0) /
                   (3.0 * image.width() * image.height()));
}

// Whether, beside the method, nothing keeps the picture together.
bool may_be_in_parts(const SimulationSpec& spec) {
  return !spec.quality.max_time_ms && !wants(spec, Output::alpha);
}

// All but alpha.
Photograph photographed(const SimulationSpec& spec, const RayScene& scene, const RunControl& run,
                        PartTracer* parts) {
  Shot shot = shot_of(spec, &scene);
  if ((scene.moves() || spec.camera.velocity != Vec3{}) &&
      spec.camera.shutter_seconds > kLongestShutter && spec.effects.motion != EffectChoice::off) {
    throw Error(
        ErrorCode::outside_domain,
        "needs shutter_s of at most 64 s where objects or the camera move, or effects.motion off");
  }
  const OpticalSummary optics = optical_summary(shot.camera, shot.sensor, std::nullopt, {});
  const ShotFacts facts = facts_of(shot, run);
  shot.brightest = facts.brightest;
  MethodPlan plan = planned_method(render_methods(), shot, facts);
  if (plan.method->traces_in_parts() && may_be_in_parts(spec))
    shot.parts = {.tracer = parts, .method = std::string(plan.method->name())};

  const double expected_detail =
      facts.averages_texels ? kTextureDetailShare * spec.quality.max_error : 0.0;
  const double expected_cut = error_of_branches(shot, facts);
  const double expected_bias = plan.quote.error.rmse + expected_cut + expected_detail;
  RenderOutcome outcome = plan.method->render(shot, facts, expected_bias, run);
  if (outcome.effects) plan.quote.error.effects = *outcome.effects;

  Photograph photograph;
  photograph.layers = layers_of(spec, shot, outcome, run);
  photograph.color = std::move(outcome.color);
  // Differences of waves are noisy where it is dark; light is not negative.
  for (float& value : photograph.color.pixels()) value = std::max(0.0F, value);

  // What was cut in the picture says more than what might be cut of any path.
  ShotFacts told = facts;
  if (outcome.cut_rmse) {
    // Of textures' albedos, which may pass 1, global light's bound knows nothing.
    told.branch_error = shot.illumination == Illumination::global
                            ? *outcome.cut_rmse
                            : std::min(told.branch_error, *outcome.cut_rmse);
    told.forks = false;
  }
  // The finished image knows its own contrast and detail better than the probe did.
  RenderReport& report = photograph.report;
  const double contrast = contrast_of(photograph.color, run);
  report.model = model_of(shot, told, plan, contrast);
  for (ModelledEffect& effect : report.model) {
    if (effect.effect == "falloff" && !effect.modelled) {
      effect.bound = falloff_rmse(shot, photograph.color, run);
      effect.why += ", as the request says: not part of the error";
    }
  }
  double bias = uncertified_rmse(plan.quote.error.effects, contrast);
  bias += error_of_branches(shot, told);
  if (facts.averages_texels) {
    // Without samples over the pupil no lookup knows a disc.
    const bool has_discs = spec.quality.texture_disc_share > 0.0 && outcome.samples_pupil;
    const double width = texture_lookup_width(spec.quality);
    const double detail =
        has_discs ? texture_detail_rmse(photograph.color, width, spec.quality.texture_disc_share,
                                        geometry_layers(shot, run).coc, run)
                  : texture_detail_rmse(photograph.color, width, run);
    report.model.push_back({.effect = "texture detail",
                            .modelled = false,
                            .bound = detail,
                            .why = "each lookup averages " + width_text(spec.quality) + " px" +
                                   (has_discs ? " or its share of the blur disc" : "")});
    bias += detail;
  }
  if (outcome.shared) {
    report.model.push_back(
        {.effect = "samples shared between pixels",
         .modelled = true,
         .bound = outcome.shared->bias,
         .why = "within windows of up to " + std::to_string(outcome.shared->widest_window) +
                " px where all is out of focus; measured, part of the estimate"});
  }
  if (facts.emitters_found > 0) {
    report.model.push_back(
        {.effect = "small bright emitters",
         .modelled = true,
         .bound = 0.0,
         .why = std::to_string(facts.emitters_found) + " in the scene, " +
                (outcome.splats_emitters
                     ? std::to_string(facts.emitters_splatted) + " traced through the pupil"
                     : std::string("left to samples, which may miss them"))});
  }
  const double highlights = unseen_highlights_rmse(shot, facts, outcome);
  const double unseen =
      std::hypot(unseen_emitters_rmse(facts), mirrored_caustics_rmse(outcome, facts), highlights);
  if (outcome.carried_paths > 0) report_carried_light(outcome, facts, report);
  if (unseen_emitters_rmse(facts) > 0.0) {
    report.model.push_back({.effect = "small emitters in mirrors and glass",
                            .modelled = true,
                            .bound = unseen_emitters_rmse(facts),
                            .why = "left to samples, which may miss them; part of the bound"});
  }
  // Of all rays none may have met a thing: at 95 % its share of them is below 3/n (rule of three),
  // and pixels of at most 1 change by no more in the mean, so by sqrt(3/n) in the root of squares.
  const double rays = std::max(1.0, static_cast<double>(outcome.rays));
  report.model.push_back({.effect = "what no sample saw",
                          .modelled = false,
                          .bound = std::sqrt(3.0 / rays),
                          .why = "its share of ray space is below 3 in " +
                                 std::to_string(outcome.rays) + " at 95 %; beside the estimate"});
  report_unseen_highlights(highlights, facts, report);
  if (const auto map = photograph.layers.find(Output::variance); map != photograph.layers.end()) {
    for (float& square : map->second.pixels()) square += static_cast<float>(bias * bias);
  }
  report.method = plan.method->name();
  report.passed_over = std::move(plan.passed_over);
  report.error = error_of(outcome, bias, unseen, spec.quality.max_error);
  report.optics = optics;
  report.cost = {.rays = outcome.rays + facts.probe_rays,
                 .samples_mean = outcome.samples_mean,
                 .samples_max = outcome.samples_max};
  report.warnings = std::move(plan.warnings);
  std::ranges::move(material_warnings(scene.scene()), std::back_inserter(report.warnings));
  if (spec.halftone) {
    report.warnings.push_back(
        "the error is that of the picture before halftoning, which EXR and TIFF files hold");
  }
  std::ranges::move(outcome.warnings, std::back_inserter(report.warnings));
  if (told.forks) {
    report.warnings.push_back(
        "a material reflects and transmits both: the many light branches that were cut may add up "
        "to more than the bound of one");
  }
  if (report.error.upper_95 > spec.quality.max_error) {
    report.warnings.push_back("the error's bound is above max_error");
  }
  return photograph;
}

// A part of some longer work.
RunControl part_of(const RunControl& run, double begin, double end) {
  RunControl part = run;
  if (run.progress) {
    part.progress = [tell = run.progress, begin, end](double fraction) {
      tell(begin + (end - begin) * fraction);
    };
  }
  return part;
}

}  // namespace

Photograph simulate(const SimulationSpec& spec, const RayScene& scene, const RunControl& run,
                    PartTracer* parts) {
  if (!wants(spec, Output::alpha)) return photographed(spec, scene, run, parts);
  constexpr double kShare = 0.5;  // of time and progress, for each of colour and alpha
  SimulationSpec half = spec;
  if (half.quality.max_time_ms) *half.quality.max_time_ms *= kShare;
  Photograph photograph = photographed(half, scene, part_of(run, 0.0, kShare), nullptr);
  RenderReport& report = photograph.report;
  RunControl rest = part_of(run, kShare, 1.0);
  rest.preview = {};
  Coverage covered = coverage(half, scene, report.method, rest);
  photograph.layers[Output::alpha] = std::move(covered.alpha);
  report.alpha_error = covered.error;
  report.cost.rays += covered.rays;
  if (covered.missed_target) report.warnings.push_back("alpha's bound is above max_error");
  return photograph;
}

bool is_made_in_parts(const SimulationSpec& spec, const RayScene& scene, const RunControl& run) {
  if (!may_be_in_parts(spec)) return false;
  const Shot shot = shot_of(spec, &scene);
  return planned_method(render_methods(), shot, facts_of(shot, run)).method->traces_in_parts();
}

TracedPart traced_part(const SimulationSpec& spec, const RayScene& scene, const PartOrder& order,
                       const RunControl& run) {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw Error(ErrorCode::invalid_request, std::string("a picture's part: ") + what);
  };
  require(order.width == spec.width && order.height == spec.height && may_be_in_parts(spec),
          "of another picture than the request's");
  Shot shot = shot_of(spec, &scene);
  shot.part = &order;
  if (scene.branches()) shot.brightest = facts_of(shot, run).brightest;  // as the whole picture's
  if (order.sharp_samples > 0) {
    shot.quality.samples = static_cast<int>(order.sharp_samples);
    return PinholeTrace().render(shot, {}, 0.0, run).part;
  }
  const auto methods = render_methods();
  const auto method =
      std::ranges::find(methods, std::string_view(order.method), &RenderMethod::name);
  require(method != methods.end() && (*method)->traces_in_parts(),
          "of a method that traces no parts");
  return (*method)->render(shot, {}, 0.0, run).part;
}

Plan plan_for(const SimulationSpec& spec, const RayScene* scene) {
  const Shot shot = shot_of(spec, scene);
  const ShotFacts facts = facts_of(shot);
  MethodPlan plan = planned_method(render_methods(), shot, facts);
  return {.method = std::string(plan.method->name()),
          .model = model_of(shot, facts, plan, facts.contrast),
          .passed_over = std::move(plan.passed_over),
          .warnings = std::move(plan.warnings)};
}

std::string_view output_name(Output output) {
  for (const auto& [value, name] : kOutputNames) {
    if (value == output) return name;
  }
  return "color";
}

std::optional<Output> output_of(std::string_view name) {
  for (const auto& [value, text] : kOutputNames) {
    if (text == name) return value;
  }
  return std::nullopt;
}

}  // namespace fstop
