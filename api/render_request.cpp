#include "api/render_request.h"

#include <algorithm>

#include "api/json_reader.h"
#include "api/json_text.h"
#include "api/simulation_json.h"
#include "core/scene/ray_scene.h"

namespace fstop::api {
namespace {

using nlohmann::json;

constexpr std::size_t kSceneNameBytes = 64;
constexpr std::size_t kScenePathBytes = 4096;

constexpr Named<Output> kOutputs[] = {
    {"color", Output::color},       {"depth", Output::depth},
    {"coc", Output::coc},           {"all_in_focus", Output::all_in_focus},
    {"variance", Output::variance}, {"normal", Output::normal},
    {"distance", Output::distance}, {"coc_diameter", Output::coc_diameter},
    {"valid", Output::valid},       {"alpha", Output::alpha}};

std::string scene_name(ObjectReader& root, SceneNames names) {
  const std::string name = root.text("scene", kScenePathBytes);
  const bool file = names == SceneNames::stored_or_files && names_a_file(name);
  if (root.clean() && !file && !is_scene_name(name)) {
    root.fault("scene", "must name a stored scene: 1 to 64 characters of a-z, 0-9 and -");
  }
  return name;
}

[[noreturn]] void over_budget(std::string pointer, std::string_view verb, std::int64_t count,
                              std::string_view things, std::int64_t most) {
  throw InvalidRequest(
      FieldFault{std::move(pointer), std::string(verb) + " " + std::to_string(count) + " " +
                                         std::string(things) + "; at most " + std::to_string(most) +
                                         " are allowed"},
      ErrorCode::over_budget);
}

void require_budget(const SimulationSpec& spec, const Limits& limits) {
  const std::int64_t pixels = std::int64_t{spec.width} * spec.height;
  if (pixels > limits.image_pixels) {
    over_budget("#/image", "has", pixels, "pixels", limits.image_pixels);
  }
  const std::int64_t samples = pixels * spec.quality.samples.value_or(1);
  if (samples > limits.samples) {
    over_budget("#/quality/samples", "asks for", samples, "samples in all", limits.samples);
  }
}

// Whether something is known to move: of a stored scene's objects only its renderer knows.
bool moves(const RenderRequest& request) {
  if (request.spec.camera.velocity != Vec3{}) return true;
  const auto* document = std::get_if<SceneDocument>(&request.scene);
  return document != nullptr &&
         std::ranges::any_of(document->scene.objects,
                             [](const Object& object) { return object.velocity != Vec3{}; });
}

}  // namespace

std::variant<std::string, SceneDocument> read_scene(ObjectReader& root, SceneNames names,
                                                    const Limits& limits, FaultList& faults) {
  const json* scene = root.value("scene", true);
  if (scene == nullptr) return {};
  if (scene->is_string()) return scene_name(root, names);
  if (!scene->is_object()) {
    root.fault("scene", "must be the name of a stored scene or a scene object, got " +
                            std::string(scene->type_name()));
    return {};
  }
  json normal;
  SceneDocument document = parse_scene(*scene, root.pointer("scene"), limits, faults, &normal);
  root.normalise("scene", std::move(normal));
  return document;
}

RenderRequest parse_render_request(std::string_view body, const Limits& limits, SceneNames names) {
  const json value = parse_json(body, limits);
  FaultList faults(limits.faults);
  json normal;
  ObjectReader root(value, "#", faults, normal);
  faults.throw_if_any();  // no object: nothing further to say
  RenderRequest request;
  request.scene = read_scene(root, names, limits, faults);
  ObjectReader camera = root.object("camera");
  request.spec.camera = read_camera(camera);
  ObjectReader image = root.object("image");
  const ImageSpec size = read_image(image, limits);
  ObjectReader quality = root.object("quality");
  request.spec.quality = read_quality(quality, limits);
  ObjectReader effects = root.object("effects");
  request.spec.effects = read_effects(effects);
  request.spec.illumination = read_illumination(root);
  request.spec.outputs = root.choices<Output>("outputs", kOutputs, "color");
  request.spec.seed = static_cast<std::uint32_t>(root.integer("seed", 0, 0xFFFF'FFFF, 0));
  root.reject_unread_members();
  if (std::ranges::count(request.spec.outputs, Output::alpha) > 0) {
    if (size.format == ImageFormat::jpeg) {
      image.fault("format", "cannot be jpeg where outputs have alpha: it holds none");
    }
    if (size.halftone) image.fault("halftone", "cannot be had where outputs have alpha");
  }
  if (camera.clean() && request.spec.camera.shutter_seconds > kLongestShutter &&
      request.spec.effects.motion != EffectChoice::off && moves(request)) {
    camera.fault("shutter_s",
                 "must be at most 64 s where objects or the camera move, or effects.motion off");
  }
  if (camera.clean() && image.clean()) require_square_pixels(image, size, request.spec.camera);
  faults.throw_if_any();

  request.spec.width = size.width;
  request.spec.height = size.height;
  request.spec.halftone = size.halftone;
  request.format = size.format;
  request.precision = size.precision;
  require_budget(request.spec, limits);
  normal["image"].erase("format");
  normal["image"].erase("precision");
  request.normalised = json_text(normal);
  normal.erase("scene");
  request.canonical = json_text(normal);
  return request;
}

bool is_scene_name(std::string_view name) {
  const auto legal = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
  };
  return !name.empty() && name.size() <= kSceneNameBytes && std::ranges::all_of(name, legal);
}

bool names_a_file(std::string_view scene) {
  return scene.find('/') != std::string_view::npos || scene.ends_with(".json");
}

}  // namespace fstop::api
