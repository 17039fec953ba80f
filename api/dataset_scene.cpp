#include "api/dataset_scene.h"

#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace fstop::api {
namespace {

using nlohmann::json;

constexpr double kEyeHeight = 1.2;     // metres over the floor
constexpr double kSensorWidth = 36.0;  // mm
constexpr double kNearest = 0.6;       // metres: of objects and focus
constexpr double kFarthest = 6.0;
constexpr double kFarthestFocus = 8.0;

constexpr std::array kMeshes = {
    "still-life/apples.ply",   "still-life/pears.ply",      "still-life/lemon.ply",
    "still-life/bowl.ply",     "still-life/vase.ply",       "still-life/candlestick.ply",
    "still-life/nautilus.glb", "still-life/book-upper.obj", "spheres/knot.glb",
    "night/bottle.ply",        "night/camera-body.ply",     "fence/pots.ply"};
constexpr std::array kTextures = {
    "still-life/linen.jpg", "still-life/porcelain.jpg", "still-life/walnut.jpg",
    "still-life/leaf.jpg",  "spheres/marble.jpg",       "spheres/globe.jpg",
    "spheres/pavement.jpg", "fence/bricks.jpg",         "fence/stone.jpg",
    "fence/rust.jpg",       "fence/terracotta.jpg",     "relief/bricks.jpg"};

// SplitMix64: Steele, Lea & Flood, OOPSLA 2014. The standard's distributions differ by library.
class Dice {
 public:
  Dice(std::uint32_t seed, std::uint32_t stream, std::uint32_t purpose)
      : state_((std::uint64_t{seed} << 32 | stream) * 0x9E3779B97F4A7C15 + purpose) {
    next();
  }

  // Of few digits: the last bits of libm, which differ between machines, do not show.
  double between(double low, double high) { return rounded(low + (high - low) * share()); }
  double ratio_between(double low, double high) {
    return rounded(low * std::pow(high / low, share()));
  }
  int whole(int low, int high) {
    return low + static_cast<int>(share() * static_cast<double>(high - low + 1));
  }
  template <typename List>
  auto one_of(const List& list) {
    return list[static_cast<std::size_t>(whole(0, static_cast<int>(list.size()) - 1))];
  }
  bool chance() { return share() < 0.5; }

 private:
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
    return z ^ (z >> 31);
  }
  double share() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  static double rounded(double x) { return std::round(x * 1e4) / 1e4; }

  std::uint64_t state_;
};

json grey(double level) { return json::array({level, level, level}); }

json color(Dice& dice, double low, double high) {
  return json::array({dice.between(low, high), dice.between(low, high), dice.between(low, high)});
}

json light_of_many(Dice& dice, double low, double high) {
  const double level = dice.between(low, high);
  return json::array({level, level * 0.96, level * 0.9});
}

json material(Dice& dice, const std::string& texture) {
  json made = {{"model", "phong"}, {"shininess", dice.whole(8, 120)}};
  made["specular"] = grey(dice.chance() ? dice.between(0.0, 0.3) : 0.0);
  if (texture.empty()) {
    made["diffuse"] = made["ambient"] = color(dice, 0.05, 0.75);
  } else {
    made["diffuse"] = made["ambient"] = {{"texture", texture}, {"scale", color(dice, 0.5, 0.9)}};
  }
  return made;
}

json quad(const json& corner, const json& u, const json& v, const char* material) {
  return {{"type", "quad"},
          {"corner_m", corner},
          {"edge_u_m", u},
          {"edge_v_m", v},
          {"material", material}};
}

// Somewhere in the field of view, as large as a tenth to a third of it.
json scattered(Dice& dice, double half_width, double half_height, const std::string& material) {
  const double depth = dice.ratio_between(kNearest, kFarthest);
  const double size = depth * half_width * dice.between(0.2, 0.66);
  const json center = {depth * half_width * dice.between(-0.85, 0.85),
                       kEyeHeight + depth * half_height * dice.between(-0.8, 0.8), -depth};
  json object = {{"material", material}};
  if (dice.whole(0, 3) == 0) {
    object["type"] = "sphere";
    object["center_m"] = center;
    object["radius_m"] = size / 2.0;
    return object;
  }
  object["type"] = "mesh";
  object["file"] = dice.one_of(kMeshes);
  object["placement"] = {
      {"center_m", center}, {"size_m", size}, {"turn_deg", dice.whole(-180, 180)}};
  // Whatever coordinates a mesh has or lacks.
  object["mapping"] = {{"type", "spherical"}, {"origin_m", center}, {"around", dice.whole(1, 3)}};
  return object;
}

json scene(Dice& dice, double focal_length, double sensor_height) {
  const double half_width = kSensorWidth / 2.0 / focal_length;
  const double half_height = sensor_height / 2.0 / focal_length;
  json made = {{"format", "fstop-scene/1"},
               {"ambient_light", grey(dice.between(0.15, 0.4))},
               {"background", color(dice, 0.05, 0.6)},
               {"textures", json::object()},
               {"materials", json::object()},
               {"objects", json::array()}};
  const auto add_material = [&](const std::string& name, bool is_textured) {
    const std::string texture = is_textured ? dice.one_of(kTextures) : "";
    if (is_textured) made["textures"][texture] = {{"file", texture}, {"wrap", "repeat"}};
    made["materials"][name] = material(dice, texture);
  };
  const int objects = dice.whole(4, 12);
  for (int i = 0; i < objects; ++i) {
    const std::string name = "object " + std::to_string(i);
    add_material(name, dice.whole(0, 3) != 0);
    made["objects"].push_back(scattered(dice, half_width, half_height, name));
  }
  add_material("wall", true);
  add_material("floor", true);
  const double wall = dice.between(kFarthest + 1.0, 12.0);
  const double side = 2.0 * wall * half_width + 4.0;
  made["objects"].push_back(
      quad({-side, -1.0, -wall}, {2.0 * side, 0.0, 0.0}, {0.0, 2.0 * side, 0.0}, "wall"));
  if (dice.chance())
    made["objects"].push_back(
        quad({-side, 0.0, 0.0}, {2.0 * side, 0.0, 0.0}, {0.0, 0.0, -wall}, "floor"));
  json& lights = made["lights"] = json::array();
  lights.push_back({{"type", "directional"},
                    {"direction", {dice.between(-1.0, 1.0), -1.0, dice.between(-1.5, -0.3)}},
                    {"intensity", light_of_many(dice, 0.3, 0.8)}});
  for (int lamps = dice.whole(1, 2); lamps > 0; --lamps) {
    lights.push_back(
        {{"type", "point"},
         {"position_m", {dice.between(-3.0, 3.0), dice.between(1.5, 3.5), dice.between(-4.0, 0.5)}},
         {"intensity", light_of_many(dice, 0.4, 2.0)},
         {"attenuation", {1.0, 0.0, 0.25}}});
  }
  return made;
}

void fill(json& object, const char* key, json value) {
  if (!object.contains(key)) object[key] = std::move(value);
}

// So that pixels are square; where the image has no size, that of its default.
double height_of_width(const json& image) {
  if (!image.is_object()) return 2.0 / 3.0;
  const auto side = [&](const char* key, double otherwise) {
    const auto found = image.find(key);
    return found != image.end() && found->is_number() ? found->get<double>() : otherwise;
  };
  const double ratio = side("height", 640.0) / side("width", 960.0);
  return ratio > 0.0 && std::isfinite(ratio) ? ratio : 2.0 / 3.0;
}

}  // namespace

json dataset_request(const json& base, const DatasetPlace& place) {
  enum Purpose : std::uint32_t { of_scenes, of_images };
  Dice of_scene(place.seed, place.image / place.images_per_scene, of_scenes);
  Dice of_image(place.seed, place.image, of_images);
  const double focal_length = of_scene.whole(24, 85);
  json request = base;
  json& image = request["image"];
  if (image.is_null()) image = {{"width", 384}, {"height", 256}};
  if (image.is_object()) fill(image, "format", "exr");
  const double sensor_height = kSensorWidth * height_of_width(image);
  fill(request, "outputs",
       {"color", "depth", "coc", "all_in_focus", "variance", "distance", "coc_diameter", "valid"});
  request["scene"] = scene(of_scene, focal_length, sensor_height);
  request["camera"] = {{"position_m", {0.0, kEyeHeight, 0.0}},
                       {"look_at_m", {0.0, kEyeHeight, -1.0}},
                       {"sensor_mm", {kSensorWidth, sensor_height}},
                       {"breathing", of_scene.chance()},
                       {"shutter_s", 0.01},
                       {"lens",
                        {{"focal_length_mm", focal_length},
                         {"blades", of_scene.chance() ? 0 : of_scene.whole(5, 9)},
                         {"f_number", std::exp2(of_image.whole(3, 24) / 6.0)},
                         {"focus_distance_m", of_image.ratio_between(kNearest, kFarthestFocus)}}}};
  return request;
}

}  // namespace fstop::api
