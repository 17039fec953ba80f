#include "tests/methods/omission.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <ostream>

#include "core/render/method.h"
#include "core/render/shot_facts.h"
#include "tests/methods/random_shots.h"

namespace fstop {
namespace {

constexpr int kSamples = 128;

// From `low` to `high` by the golden ratio's fractions: evenly by the logarithm, in any number.
double swept(std::uint32_t seed, double low, double high) {
  const double share = std::fmod(0.618033988749895 * seed, 1.0);
  return low * std::pow(high / low, share);
}

struct Pair {
  Photograph first = {};
  Photograph second = {};
};

Pair pair_of(SimulationSpec spec, const RayScene& scene) {
  spec.quality.samples = kSamples;
  Pair pair;
  pair.first = simulate(spec, scene, {});
  spec.seed += 0x2545f491U;
  pair.second = simulate(spec, scene, {});
  return pair;
}

double clipped(float value) { return std::clamp(static_cast<double>(value), 0.0, 1.0); }

// E (A1 - B1)(A2 - B2) = (A - B)^2, whatever the noises, since the pairs' are independent. Its own
// scatter from the products of squares of kSide pixels, between which nothing is shared.
void compare(const Pair& with, const Pair& without, OmissionTrial& trial) {
  constexpr int kSide = 8;
  const Image& shape = with.first.color;
  const auto change = [&](const Photograph& on, const Photograph& off, int x, int y, int c) {
    return clipped(on.color.at(x, y)[c]) - clipped(off.color.at(x, y)[c]);
  };
  double sum = 0.0;
  double squares = 0.0;
  for (int top = 0; top < shape.height(); top += kSide) {
    for (int left = 0; left < shape.width(); left += kSide) {
      double part = 0.0;
      for (int y = top; y < std::min(top + kSide, shape.height()); ++y) {
        for (int x = left; x < std::min(left + kSide, shape.width()); ++x) {
          for (int c = 0; c < 3; ++c) {
            part += change(with.first, without.first, x, y, c) *
                    change(with.second, without.second, x, y, c);
          }
        }
      }
      sum += part;
      squares += part * part;
    }
  }
  const auto n = static_cast<double>(shape.pixels().size());
  const double mse = std::max(0.0, sum / n);
  const double scatter = std::sqrt(squares) / n;
  trial.change = std::sqrt(mse);
  if (scatter <= 0.0) return;
  trial.scatter = scatter / (2.0 * std::max(trial.change, 0.5 * std::sqrt(scatter)));
}

// The bounds of all effects whose name begins so; "" for all that are told.
double told_bound(const Photograph& picture, std::string_view beginning) {
  double bound = 0.0;
  for (const ModelledEffect& effect : picture.report.model) {
    if (effect.effect == "what no sample saw") continue;  // stated beside the estimate
    if (effect.effect.starts_with(beginning)) bound += effect.bound;
  }
  return bound;
}

bool told_modelled(const Photograph& picture, std::string_view name) {
  return std::ranges::any_of(picture.report.model, [&](const ModelledEffect& effect) {
    return effect.effect == name && effect.modelled;
  });
}

RandomShot small_shot(std::uint32_t seed) {
  RandomShot shot = random_shot(seed);
  shot.spec.width = 48;
  shot.spec.height = 32;
  shot.spec.effects = {.diffraction = EffectChoice::off};
  shot.spec.quality.max_error = 0.02;
  return shot;
}

// What `auto` does at an ordinary error against everything modelled.
void compare_with_full(const RandomShot& shot, const RayScene& scene, OmissionTrial& trial) {
  const Pair automatic = pair_of(shot.spec, scene);
  SimulationSpec full = shot.spec;
  full.seed += 17U;
  full.quality = {.max_error = 1e-5, .method = "lens-sampling"};
  full.effects.motion = EffectChoice::on;
  trial.modelled = told_modelled(automatic.first, trial.effect);
  trial.bound = told_bound(automatic.first, "");
  compare(pair_of(full, scene), automatic, trial);
}

}  // namespace

OmissionTrial defocus_omitted(std::uint32_t seed) {
  OmissionTrial trial{.effect = "defocus", .seed = seed, .unit = "px"};
  RandomShot shot = small_shot(1000 + seed);
  const RayScene scene(std::move(shot.scene));
  trial.strength = swept(seed, 0.05, 4.0);
  SimulationSpec& spec = shot.spec;
  const double now = facts_of({.scene = &scene,
                               .camera = spec.camera,
                               .sensor = sensor_of(spec.camera, spec.width, spec.height),
                               .effects = spec.effects})
                         .largest_blur_px;
  const double factor = trial.strength / std::max(now, 1e-6);
  if (auto* lens = std::get_if<LensSpec>(&spec.camera.optics)) {
    lens->lens.f_number /= factor;
  } else {
    std::get<PinholeSpec>(spec.camera.optics).diameter *= factor;
  }
  spec.quality.method = "pinhole";
  const Pair without = pair_of(spec, scene);
  spec.quality.method = "lens-sampling";
  spec.seed += 17U;
  trial.bound = told_bound(without.first, "");
  compare(pair_of(spec, scene), without, trial);
  return trial;
}

OmissionTrial diffraction_omitted(std::uint32_t seed) {
  OmissionTrial trial{.effect = "diffraction", .seed = seed, .unit = "Q"};
  RandomShot shot = small_shot(2000 + seed);
  trial.strength = swept(seed, 0.01, 1.0);
  // A camera a twentieth as large: pixels come near a wavelength times the f-number.
  CameraSpec& camera = shot.spec.camera;
  camera.sensor_width /= 20.0;
  camera.sensor_height /= 20.0;
  const double pitch = camera.sensor_width.si() / shot.spec.width;
  if (auto* lens = std::get_if<LensSpec>(&camera.optics)) {
    lens->lens.focal_length /= 20.0;
    lens->lens.f_number = std::max(1.4, trial.strength * pitch / camera.wavelength.si());
  } else {
    auto& hole = std::get<PinholeSpec>(camera.optics);
    hole.image_distance /= 20.0;
    hole.diameter = hole.image_distance * (camera.wavelength.si() / (trial.strength * pitch));
  }
  const RayScene scene(std::move(shot.scene));
  shot.spec.effects.diffraction = EffectChoice::automatic;
  shot.spec.quality.method = "lens-sampling";
  const Pair without = pair_of(shot.spec, scene);
  shot.spec.quality.method = "wave";
  shot.spec.quality.max_error = 0.005;
  shot.spec.effects.diffraction = EffectChoice::on;
  shot.spec.seed += 17U;
  const Pair with = pair_of(shot.spec, scene);
  trial.bound = told_bound(without.first, "") + told_bound(with.first, "");
  compare(with, without, trial);
  return trial;
}

OmissionTrial motion_omitted(std::uint32_t seed) {
  OmissionTrial trial{.effect = "motion", .seed = seed, .unit = "px"};
  RandomShot shot = small_shot(3000 + seed);
  trial.strength = swept(seed, 0.02, 5.0);
  Object& object = shot.scene.objects.back();
  const Pose pose =
      Pose::looking_at(shot.spec.camera.position, shot.spec.camera.look_at, shot.spec.camera.up);
  Vec3 place = {};
  if (const auto* quad = std::get_if<QuadObject>(&object.shape)) place = quad->corner;
  if (const auto* ball = std::get_if<SphereObject>(&object.shape)) place = ball->center;
  if (const auto* mesh = std::get_if<MeshObject>(&object.shape)) {
    const auto& p = mesh->mesh.positions.front();
    place = {p[0], p[1], p[2]};
  }
  const double depth = std::abs(pose.from_world(place).z);
  const double pixel = shot.spec.camera.sensor_width.si() / shot.spec.width * depth /
                       sensor_distance(shot.spec.camera).si();
  shot.spec.camera.shutter_seconds = 1.0 / 60.0;
  object.velocity = pose.vector({trial.strength * pixel * 60.0, 0, 0});
  const RayScene scene(std::move(shot.scene));
  compare_with_full(shot, scene, trial);
  return trial;
}

OmissionTrial area_light_omitted(std::uint32_t seed) {
  OmissionTrial trial{.effect = "area light", .seed = seed, .unit = "of its height"};
  RandomShot shot = small_shot(4000 + seed);
  trial.strength = swept(seed, 0.001, 1.0);
  const Pose pose =
      Pose::looking_at(shot.spec.camera.position, shot.spec.camera.look_at, shot.spec.camera.up);
  const double side = 2.0 * trial.strength;
  shot.scene.lights = {{.kind = AreaLight{.corner = pose.point({-side / 2, -2.0, 1.0}),
                                          .edge_u = pose.vector({side, 0, 0}),
                                          .edge_v = pose.vector({0, 0, side})},
                        .intensity = {0.7F, 0.7F, 0.6F}}};
  for (Material& material : shot.scene.materials) {
    const bool plain = material.model == ShadingModel::unlit && material.transmission == 0.0;
    if (!plain || material.emission.value[0] > 1.0F) continue;
    material.model = ShadingModel::phong;
    std::swap(material.diffuse, material.emission);
  }
  const RayScene scene(std::move(shot.scene));
  compare_with_full(shot, scene, trial);
  return trial;
}

// Inside a mirror ball of emission e every ray meets it for ever: L = e (1 + r + r^2 + ...).
OmissionTrial reflection_omitted(std::uint32_t seed) {
  OmissionTrial trial{.effect = "reflection", .seed = seed, .unit = "reflection"};
  trial.strength = 1.0 - swept(seed, 0.005, 0.7);
  const double all = 0.9;
  const auto emission = static_cast<float>(all * (1.0 - trial.strength));
  Scene ball;
  ball.materials = {Material{.emission = {.value = {emission, emission, emission}},
                             .reflection = trial.strength}};
  ball.objects = {{.shape = SphereObject{.center = {0.1, 0.2, -0.1}, .radius = 1.0}}};
  const RayScene scene(std::move(ball));
  SimulationSpec spec;
  spec.camera.optics =
      LensSpec{.lens = {.focal_length = 35.0_mm, .f_number = 8.0}, .focus_distance = 0.5_m};
  spec.width = 24;
  spec.height = 16;
  spec.effects.diffraction = EffectChoice::off;
  spec.quality.samples = 4;
  const Photograph picture = simulate(spec, scene, {});
  double sum = 0.0;
  for (const float value : picture.color.pixels()) {
    sum += (value - all) * (value - all);
  }
  trial.modelled = told_modelled(picture, "reflection and transmission");
  trial.bound = told_bound(picture, "reflection");
  trial.change = std::sqrt(sum / static_cast<double>(picture.color.pixels().size()));
  trial.scatter = 64 * 0x1p-24;  // roundings of as many sums of floats below 1
  return trial;
}

OmissionTrial texture_detail_omitted(std::uint32_t seed) {
  OmissionTrial trial{.effect = "texture detail", .seed = seed, .unit = "px a texel"};
  RandomShot shot = small_shot(5000 + seed);
  trial.strength = swept(seed, 0.1, 2.0);
  // A card of noise that is as fine as asked for fills the middle of the frame, in focus.
  constexpr int kTexels = 128;
  TextureSource texture{.name = "fine", .image = Image(kTexels, kTexels, 3)};
  std::uint32_t state = seed + 1;
  for (float& value : texture.image.pixels()) {
    state = state * 1664525U + 1013904223U;
    value = static_cast<float>(state >> 8U) * 0x1p-24F;
  }
  shot.scene.textures.push_back(std::move(texture));
  shot.scene.materials.push_back(
      {.emission = {.value = {1, 1, 1},
                    .texture = static_cast<int>(shot.scene.textures.size()) - 1}});
  SimulationSpec& spec = shot.spec;
  const Pose pose = Pose::looking_at(spec.camera.position, spec.camera.look_at, spec.camera.up);
  const double depth = 1.0;
  const double side = trial.strength * kTexels * (spec.camera.sensor_width.si() / spec.width) *
                      depth / sensor_distance(spec.camera).si();
  shot.scene.objects.push_back(
      {.shape = QuadObject{.corner = pose.point({-side / 2, side / 2, depth}),
                           .edge_u = pose.vector({side, 0, 0}),
                           .edge_v = pose.vector({0, -side, 0})},
       .material = static_cast<int>(shot.scene.materials.size()) - 1});
  if (auto* lens = std::get_if<LensSpec>(&spec.camera.optics)) lens->lens.f_number = 64.0;
  const RayScene scene(std::move(shot.scene));
  spec.quality = {.max_error = 0.05, .method = "lens-sampling"};
  const Pair without = pair_of(spec, scene);
  spec.quality.max_error = 1e-5;
  spec.seed += 17U;
  trial.bound = told_bound(without.first, "");
  compare(pair_of(spec, scene), without, trial);
  return trial;
}

OmissionTrial falloff_omitted(std::uint32_t seed) {
  OmissionTrial trial{.effect = "falloff", .seed = seed, .unit = "mm"};
  RandomShot shot = small_shot(6000 + seed);
  trial.strength = swept(seed, 24.0, 400.0);
  shot.spec.camera.optics =
      LensSpec{.lens = {.focal_length = Length::si(trial.strength / 1e3), .f_number = 8.0},
               .focus_distance = 4.0_m};
  const RayScene scene(std::move(shot.scene));
  shot.spec.effects.falloff = EffectChoice::off;
  const Pair without = pair_of(shot.spec, scene);
  shot.spec.effects.falloff = EffectChoice::on;
  shot.spec.seed += 17U;
  trial.modelled = told_modelled(without.first, "falloff");
  // Left out only where the request says so: told beside the error.
  trial.bound = told_bound(without.first, "falloff");
  compare(pair_of(shot.spec, scene), without, trial);
  return trial;
}

void print_omissions(std::ostream& out, const std::vector<OmissionTrial>& trials) {
  int held = 0;
  int omitted = 0;
  char line[300];
  for (const OmissionTrial& t : trials) {
    held += t.holds() ? 1 : 0;
    omitted += t.modelled ? 0 : 1;
    if (t.holds()) continue;
    std::snprintf(line, sizeof line,
                  "  %s, case %u (%.3g %s): changes %.5f +- %.5f, bound %.5f%s\n", t.effect.c_str(),
                  t.seed, t.strength, t.unit, t.change, t.scatter, t.bound,
                  t.modelled ? ", modelled" : "");
    out << line;
  }
  if (trials.empty()) return;
  std::snprintf(line, sizeof line, "%s: within its bound in %d of %zu cases, left out in %d\n",
                trials.front().effect.c_str(), held, trials.size(), omitted);
  out << line;
}

}  // namespace fstop
