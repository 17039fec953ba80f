#include "api/chart_photograph.h"

#include <numbers>

#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/picture.h"
#include "api/render_request.h"
#include "core/error.h"

namespace fstop::api {
namespace {

Json vector_json(Vec3 v) { return {number_json(v.x), number_json(v.y), number_json(v.z)}; }

std::string_view choice_word(EffectChoice choice) {
  switch (choice) {
    case EffectChoice::automatic:
      return "auto";
    case EffectChoice::on:
      return "on";
    case EffectChoice::off:
      return "off";
  }
  return {};
}

Json optics_json(const LensSpec& lens) {
  Json json = Json::object();
  put_length(json, "focal_length_mm", lens.lens.focal_length);
  json["f_number"] = number_json(lens.lens.f_number);
  put_length(json, "focus_distance_m", lens.focus_distance);
  json["blades"] = lens.aperture.blades;
  json["blade_rotation_deg"] = number_json(lens.aperture.rotation * (180.0 / std::numbers::pi));
  return json;
}

Json optics_json(const PinholeSpec& hole) {
  Json json = Json::object();
  put_length(json, "image_distance_mm", hole.image_distance);
  put_length(json, "diameter_mm", hole.diameter);
  return json;
}

Json camera_json(const CameraSpec& camera) {
  Json json = {{"position_m", vector_json(camera.position)},
               {"look_at_m", vector_json(camera.look_at)},
               {"up", vector_json(camera.up)}};
  Json sides = Json::object();
  put_length(sides, "width_mm", camera.sensor_width);
  put_length(sides, "height_mm", camera.sensor_height);
  json["sensor_mm"] = {sides["width_mm"], sides["height_mm"]};
  const bool has_lens = std::holds_alternative<LensSpec>(camera.optics);
  json[has_lens ? "lens" : "pinhole"] =
      std::visit([](const auto& optics) { return optics_json(optics); }, camera.optics);
  if (has_lens) json["breathing"] = camera.breathing;
  put_length(json, "wavelength_nm", camera.wavelength);
  json["spectrum"] = camera.monochromatic ? "monochromatic" : "rgb";
  json["shutter_s"] = number_json(camera.shutter_seconds);
  if (camera.exposure) json["exposure"] = {{"iso", number_json(camera.exposure->iso)}};
  return json;
}

Json quality_json(const QualitySpec& quality) {
  Json json = {{"max_error", number_json(quality.max_error)}, {"method", quality.method}};
  if (quality.samples) json["samples"] = *quality.samples;
  return json;
}

Json scene_json(const Scene& scene) {
  Json materials = Json::object();
  for (const Material& material : scene.materials) {
    const Rgb& light = material.emission.value;
    materials[material.name] = {{"model", "unlit"}, {"emission", {light[0], light[1], light[2]}}};
  }
  Json objects = Json::array();
  for (const Object& object : scene.objects) {
    const auto* quad = std::get_if<QuadObject>(&object.shape);
    if (quad == nullptr) throw Error(ErrorCode::internal, "a chart is made of quads");
    objects.push_back(
        {{"type", "quad"},
         {"corner_m", vector_json(quad->corner)},
         {"edge_u_m", vector_json(quad->edge_u)},
         {"edge_v_m", vector_json(quad->edge_v)},
         {"material", scene.materials[static_cast<std::size_t>(object.material)].name}});
  }
  return {{"format", "fstop-scene/1"}, {"materials", materials}, {"objects", objects}};
}

}  // namespace

std::string chart_request_text(const ChartShot& shot) {
  const SimulationSpec& spec = shot.shot;
  const Json request = {
      {"scene", scene_json(shot.scene)},
      {"camera", camera_json(spec.camera)},
      {"image", {{"width", spec.width}, {"height", spec.height}, {"format", "exr"}}},
      {"quality", quality_json(spec.quality)},
      {"effects",
       {{"defocus", choice_word(spec.effects.defocus)},
        {"diffraction", choice_word(spec.effects.diffraction)},
        {"motion", choice_word(spec.effects.motion)},
        {"falloff", choice_word(spec.effects.falloff)}}},
      {"seed", spec.seed}};
  return json_text(request);
}

Image finished_picture(std::span<const std::byte> bytes, const Limits& limits) {
  return decode_texture("picture.exr", bytes, ColorSpace::linear, limits.assets);
}

Image picture_here(std::string_view request, const std::filesystem::path& folder,
                   const SceneStore& store, const Limits& limits, const RunControl& run) {
  const RenderRequest parsed = parse_render_request(request, limits, SceneNames::stored_or_files);
  const RayScene scene(load_beside(parsed, folder, store, limits).scene);
  const Photograph photograph = simulate(parsed.spec, scene, run);
  return finished_picture(
      encode(picture_of(photograph, parsed.spec, "", ImageFormat::exr), ImageFormat::exr), limits);
}

}  // namespace fstop::api
