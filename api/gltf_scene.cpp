// Cameras, lights and the base colour of a .glb, read from its JSON chunk; its meshes stay in the
// file, which the scene names.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <optional>
#include <vector>

#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/scene_upload.h"
#include "core/error.h"
#include "core/geometry.h"

namespace fstop::api {
namespace {

using nlohmann::json;

constexpr double kSensorHeight_mm = 24.0;
constexpr double kFNumber = 8.0;  // glTF's cameras have no aperture
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;

[[noreturn]] void refuse(const std::string& reason) {
  throw Error(ErrorCode::bad_geometry, "the .glb " + reason);
}

std::uint32_t u32(std::span<const std::byte> bytes, std::size_t at) {
  if (at + 4 > bytes.size()) refuse("is too short");
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

// glTF 2.0, 4.4: header, then the JSON chunk.
json document_of(std::span<const std::byte> bytes, const Limits& limits) {
  if (u32(bytes, 4) != 2) refuse("is not of glTF 2.0");
  const std::size_t length = u32(bytes, 12);
  if (u32(bytes, 16) != kJsonChunk ||
      length > bytes.size() - std::min<std::size_t>(bytes.size(), 20))
    refuse("has no JSON chunk");
  if (length > limits.scene_bytes)
    throw Error(ErrorCode::over_budget, "the .glb's JSON is too long");
  return parse_json({reinterpret_cast<const char*>(bytes.data()) + 20, length}, limits);
}

double number(const json& object, const char* key, double fallback) {
  if (!object.is_object() || !object.contains(key) || !object.at(key).is_number()) return fallback;
  return object.at(key).get<double>();
}

std::vector<double> numbers(const json& object, const char* key, std::size_t count) {
  std::vector<double> values;
  if (!object.is_object() || !object.contains(key) || !object.at(key).is_array()) return values;
  for (const json& value : object.at(key)) {
    if (!value.is_number()) refuse(std::string("has a ") + key + " that is not of numbers");
    values.push_back(value.get<double>());
  }
  if (values.size() != count) refuse(std::string("has a ") + key + " of the wrong length");
  return values;
}

const json& member(const json& object, const char* key) {
  static const json none;
  return object.is_object() && object.contains(key) ? object.at(key) : none;
}

std::optional<std::size_t> index(const json& object, const char* key) {
  const json& value = member(object, key);
  if (!value.is_number_unsigned()) return std::nullopt;
  return value.get<std::size_t>();
}

// Columns of a node's transform into the world.
struct Frame {
  Vec3 x = {1.0, 0.0, 0.0};
  Vec3 y = {0.0, 1.0, 0.0};
  Vec3 z = {0.0, 0.0, 1.0};
  Vec3 origin = {};

  Vec3 vector(Vec3 v) const { return x * v.x + y * v.y + z * v.z; }
  Frame operator*(const Frame& child) const {
    return {vector(child.x), vector(child.y), vector(child.z), vector(child.origin) + origin};
  }
};

Frame rotation(const std::vector<double>& q) {
  const double squares = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!(squares > 0.0)) refuse("has a rotation of length 0");
  const double k = 2.0 / squares;
  const auto p = [&](std::size_t a, std::size_t b) { return k * q[a] * q[b]; };
  return {{1.0 - p(1, 1) - p(2, 2), p(0, 1) + p(2, 3), p(0, 2) - p(1, 3)},
          {p(0, 1) - p(2, 3), 1.0 - p(0, 0) - p(2, 2), p(1, 2) + p(0, 3)},
          {p(0, 2) + p(1, 3), p(1, 2) - p(0, 3), 1.0 - p(0, 0) - p(1, 1)},
          {}};
}

Frame frame_of(const json& node) {
  const auto m = numbers(node, "matrix", 16);
  if (!m.empty())
    return {{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}, {m[12], m[13], m[14]}};
  Frame frame;
  if (const auto q = numbers(node, "rotation", 4); !q.empty()) frame = rotation(q);
  if (const auto s = numbers(node, "scale", 3); !s.empty()) {
    frame.x = frame.x * s[0];
    frame.y = frame.y * s[1];
    frame.z = frame.z * s[2];
  }
  if (const auto t = numbers(node, "translation", 3); !t.empty()) frame.origin = {t[0], t[1], t[2]};
  return frame;
}

Json triple(Vec3 v) { return Json::array({v.x, v.y, v.z}); }

class Reader {
 public:
  explicit Reader(const json& document) : document_(document) {}

  void read() {
    const json& nodes = member(document_, "nodes");
    if (!nodes.is_array()) return;
    std::vector<bool> is_child(nodes.size());
    for (const json& node : nodes) {
      for (const std::size_t child : children(node, nodes.size())) is_child[child] = true;
    }
    struct Visit {
      std::size_t node = 0;
      Frame parent = {};
    };
    std::vector<Visit> open;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (!is_child[i]) open.push_back({i, {}});
    }
    std::vector<bool> visited(nodes.size());
    while (!open.empty()) {
      const Visit visit = open.back();
      open.pop_back();
      if (visited[visit.node]) refuse("has a node with two parents");
      visited[visit.node] = true;
      const json& node = nodes[visit.node];
      const Frame frame = visit.parent * frame_of(node);
      add_camera(node, frame);
      add_light(node, frame);
      for (const std::size_t child : children(node, nodes.size())) open.push_back({child, frame});
    }
  }

  Json cameras = Json::array();
  Json lights = Json::array();
  std::vector<std::string> not_mapped = {};

 private:
  static std::vector<std::size_t> children(const json& node, std::size_t count) {
    std::vector<std::size_t> list;
    const json& listed = member(node, "children");
    if (!listed.is_array()) return list;
    for (const json& child : listed) {
      if (!child.is_number_unsigned() || child.get<std::size_t>() >= count)
        refuse("has a child node that is not there");
      list.push_back(child.get<std::size_t>());
    }
    return list;
  }

  // A lens of the same view, stopped down: glTF says nothing of focus.
  void add_camera(const json& node, const Frame& frame) {
    const auto which = index(node, "camera");
    const json& all = member(document_, "cameras");
    if (!which || !all.is_array() || *which >= all.size()) return;
    const json& camera = all[*which];
    const double angle = number(member(camera, "perspective"), "yfov", 0.0);
    if (!(angle > 0.0 && angle < std::numbers::pi)) {
      not_mapped.push_back("camera " + std::to_string(*which) + ": not a perspective one");
      return;
    }
    const double aspect = number(member(camera, "perspective"), "aspectRatio", 1.5);
    const double focal_mm = 0.5 * kSensorHeight_mm / std::tan(0.5 * angle);
    cameras.push_back({{"position_m", triple(frame.origin)},
                       {"look_at_m", triple(frame.origin - normalized(frame.z))},
                       {"up", triple(normalized(frame.y))},
                       {"sensor_mm", Json::array({kSensorHeight_mm * aspect, kSensorHeight_mm})},
                       {"breathing", false},
                       {"lens",
                        {{"focal_length_mm", focal_mm},
                         {"f_number", kFNumber},
                         {"focus_distance_m", "infinity"}}}});
  }

  // Lambert's 1/pi, which fstop's shading does not have, goes into the intensity.
  void add_light(const json& node, const Frame& frame) {
    const auto which = index(member(member(node, "extensions"), "KHR_lights_punctual"), "light");
    const json& all =
        member(member(member(document_, "extensions"), "KHR_lights_punctual"), "lights");
    if (!which || !all.is_array() || *which >= all.size()) return;
    const json& light = all[*which];
    auto color = numbers(light, "color", 3);
    if (color.empty()) color = {1.0, 1.0, 1.0};
    const double scale = number(light, "intensity", 1.0) / std::numbers::pi;
    const Json intensity = Json::array({color[0] * scale, color[1] * scale, color[2] * scale});
    const Vec3 direction = -normalized(frame.z);
    const json& type = member(light, "type");
    const std::string label = "light " + std::to_string(*which);
    if (is_word(type, "directional")) {
      lights.push_back(
          {{"type", "directional"}, {"direction", triple(direction)}, {"intensity", intensity}});
      return;
    }
    if (number(light, "range", 0.0) > 0.0) not_mapped.push_back(label + ": its range");
    const Json attenuation = Json::array({0.0, 0.0, 1.0});
    if (is_word(type, "point")) {
      lights.push_back({{"type", "point"},
                        {"position_m", triple(frame.origin)},
                        {"intensity", intensity},
                        {"attenuation", attenuation}});
    } else if (is_word(type, "spot")) {
      const json& cone = member(light, "spot");
      const double half = 0.5 * (number(cone, "innerConeAngle", 0.0) +
                                 number(cone, "outerConeAngle", 0.25 * std::numbers::pi));
      // Half as bright where the cone's edge is half way.
      const double exponent = std::log(0.5) / std::log(std::cos(std::clamp(half, 0.01, 1.5)));
      not_mapped.push_back(label + ": its cone's edge; it falls off as a power of the cosine");
      lights.push_back({{"type", "spot"},
                        {"position_m", triple(frame.origin)},
                        {"direction", triple(direction)},
                        {"exponent", exponent},
                        {"intensity", intensity},
                        {"attenuation", attenuation}});
    } else {
      not_mapped.push_back(label + ": its type");
    }
  }

  const json& document_;
};

Json material_of(const json& document, std::vector<std::string>& not_mapped) {
  const json& materials = member(document, "materials");
  std::vector<double> color;
  if (materials.is_array() && !materials.empty()) {
    color = numbers(member(materials[0], "pbrMetallicRoughness"), "baseColorFactor", 4);
    not_mapped.push_back("materials: all but the base colour of the first");
  }
  if (color.empty()) color = {0.8, 0.8, 0.8, 1.0};
  const Json rgb = Json::array({color[0], color[1], color[2]});
  return {{"model", "phong"}, {"ambient", rgb}, {"diffuse", rgb}};
}

}  // namespace

GltfScene scene_of_gltf(std::span<const std::byte> bytes, const std::string& file,
                        const Limits& limits) {
  const json document = document_of(bytes, limits);
  Reader reader(document);
  reader.read();
  std::vector<std::string>& not_mapped = reader.not_mapped;
  const Json material = material_of(document, not_mapped);
  for (const char* kind : {"textures", "animations", "skins"}) {
    if (member(document, kind).is_array() && !member(document, kind).empty())
      not_mapped.emplace_back(kind);
  }
  if (reader.lights.empty()) {
    not_mapped.emplace_back("lights: there are none; one from above is put in their place");
    reader.lights.push_back({{"type", "directional"},
                             {"direction", Json::array({-0.4, -1.0, -0.6})},
                             {"intensity", Json::array({0.8, 0.8, 0.8})}});
  }
  const Json scene = {
      {"format", "fstop-scene/1"},
      {"materials", {{"first", material}}},
      {"objects", Json::array({{{"type", "mesh"}, {"file", file}, {"material", "first"}}})},
      {"lights", reader.lights},
      {"ambient_light", Json::array({0.2, 0.2, 0.2})}};
  return {json_text(scene), json_text(reader.cameras), not_mapped};
}

}  // namespace fstop::api
