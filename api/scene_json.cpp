#include "api/scene_json.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "api/json_reader.h"
#include "api/json_text.h"
#include "core/scene/mapping.h"

namespace fstop::api {
namespace {

using nlohmann::json;

constexpr std::size_t kNameBytes = 256;
constexpr std::size_t kDescriptionBytes = 4096;
constexpr Range kRadiance{0.0, 1e6};
constexpr Range kShare{0.0, 1.0};

constexpr Named<ColorSpace> kColorSpaces[] = {{"srgb", ColorSpace::srgb},
                                              {"linear", ColorSpace::linear}};
constexpr Named<TextureFilter> kFilters[] = {
    {"nearest", TextureFilter::nearest},         {"bilinear", TextureFilter::bilinear},
    {"mipmap", TextureFilter::mipmap},           {"summed-area", TextureFilter::summed_area},
    {"brute-force", TextureFilter::brute_force}, {"stochastic", TextureFilter::stochastic},
    {"anisotropic", TextureFilter::anisotropic}};
constexpr Named<TextureWrap> kWraps[] = {{"repeat", TextureWrap::repeat},
                                         {"clamp", TextureWrap::clamp}};
constexpr Named<ShadingModel> kModels[] = {{"unlit", ShadingModel::unlit},
                                           {"phong", ShadingModel::phong},
                                           {"blinn-phong", ShadingModel::blinn_phong}};
constexpr Named<Interpolation> kInterpolations[] = {{"flat", Interpolation::flat},
                                                    {"gouraud", Interpolation::gouraud},
                                                    {"phong", Interpolation::phong}};

// Surfaces with names. Metal: the classical constants; the others follow its form, each with less
// light than it gets.
struct Preset {
  double ambient = 0.0;
  double diffuse = 0.0;
  double specular = 0.0;
  double shininess = 1.0;
  double reflection = 0.0;
  double transmission = 0.0;
  double ior = 0.0;  // 0: none
  bool fresnel = false;
};
constexpr Named<Preset> kPresets[] = {
    {"metal", {.ambient = 0.1, .diffuse = 0.2, .specular = 0.5, .shininess = 90.0}},
    {"plastic", {.ambient = 0.1, .diffuse = 0.5, .specular = 0.3, .shininess = 40.0}},
    {"rubber", {.ambient = 0.1, .diffuse = 0.6, .specular = 0.1, .shininess = 8.0}},
    {"matte", {.ambient = 0.1, .diffuse = 0.8}},
    {"mirror", {.diffuse = 0.02, .specular = 0.08, .shininess = 100.0, .reflection = 0.9}},
    {"glass",
     {.specular = 0.04,
      .shininess = 100.0,
      .reflection = 1.0,
      .transmission = 1.0,
      .ior = 1.5,
      .fresnel = true}},
    {"water",
     {.specular = 0.02,
      .shininess = 100.0,
      .reflection = 1.0,
      .transmission = 1.0,
      .ior = 1.333,
      .fresnel = true}}};

enum class ShapeKind { mesh, sphere, quad };
constexpr Named<ShapeKind> kShapes[] = {
    {"mesh", ShapeKind::mesh}, {"sphere", ShapeKind::sphere}, {"quad", ShapeKind::quad}};
enum class MappingKind { own, planar, spherical, cylindrical, screen };
constexpr Named<MappingKind> kMappings[] = {{"uv", MappingKind::own},
                                            {"planar", MappingKind::planar},
                                            {"spherical", MappingKind::spherical},
                                            {"cylindrical", MappingKind::cylindrical},
                                            {"screen", MappingKind::screen}};
enum class LightKind { directional, point, spot, area };
constexpr Named<LightKind> kLights[] = {{"directional", LightKind::directional},
                                        {"point", LightKind::point},
                                        {"spot", LightKind::spot},
                                        {"area", LightKind::area}};

template <typename Value, std::size_t count>
std::span<const Named<Value>> words(const Named<Value> (&table)[count]) {
  return table;
}

Rgb rgb(const std::array<double, 3>& values) {
  return {static_cast<float>(values[0]), static_cast<float>(values[1]),
          static_cast<float>(values[2])};
}

/// Reads one scene object into values; the names read so far are at hand.
class SceneReader {
 public:
  explicit SceneReader(const Limits& limits) : limits_(limits) {}

  Scene read(ObjectReader& root) {
    if (root.text("format", kNameBytes) != "fstop-scene/1" && root.clean()) {
      root.fault("format", "must be \"fstop-scene/1\"");
    }
    scene_.title = root.text("title", kNameBytes, "");
    scene_.description = root.text("description", kDescriptionBytes, "");
    for (auto& [name, reader] : root.named_objects("textures", limits_.scene_textures)) {
      scene_.textures.push_back(texture(name, reader));
    }
    for (auto& [name, reader] : root.named_objects("materials", limits_.scene_materials)) {
      scene_.materials.push_back(material(name, reader));
    }
    for (ObjectReader& reader : root.objects("objects", limits_.scene_objects)) {
      scene_.objects.push_back(object(reader));
    }
    for (ObjectReader& reader : root.objects("lights", limits_.scene_lights)) {
      scene_.lights.push_back(light(reader));
    }
    scene_.ambient_light = color(root, "ambient_light");
    scene_.background = color(root, "background");
    root.reject_unread_members();
    return std::move(scene_);
  }

 private:
  static Rgb color(ObjectReader& reader, std::string_view key) {
    return rgb(reader.triple(key, kRadiance, "", std::array{0.0, 0.0, 0.0}));
  }

  static TextureSource texture(const std::string& name, ObjectReader& reader) {
    TextureSource texture;
    texture.name = name;
    texture.file = reader.text("file", kNameBytes);
    texture.color_space = reader.choice("color_space", words(kColorSpaces), "srgb");
    texture.filter = reader.choice("filter", words(kFilters), "mipmap");
    texture.wrap = reader.choice("wrap", words(kWraps), "repeat");
    reader.reject_unread_members();
    return texture;
  }

  ColorSource color_source(ObjectReader& material, std::string_view key, double share = 0.0) const {
    const json* value = material.value(key, false);
    if (value == nullptr || !value->is_object()) {
      return {.value = rgb(material.triple(key, kRadiance, "", std::array{share, share, share}))};
    }
    ObjectReader reader = material.object(key);
    const std::string name = reader.text("texture", kNameBytes);
    ColorSource source{.value =
                           rgb(reader.triple("scale", kRadiance, "", std::array{1.0, 1.0, 1.0}))};
    if (reader.clean()) source.texture = index_of(name, scene_.textures, reader, "texture");
    reader.reject_unread_members();
    return source;
  }

  Material material(const std::string& name, ObjectReader& reader) const {
    // What a preset says, the other members may change; without one there is nothing, unless said.
    Preset preset;
    const bool has_preset = reader.has("preset");
    if (has_preset) preset = reader.choice("preset", words(kPresets));
    reader.leave_out("preset");  // its values stand in its place
    Material material;
    material.name = name;
    material.model =
        reader.choice("model", words(kModels),
                      has_preset ? std::optional<std::string_view>("phong") : std::nullopt);
    material.emission = color_source(reader, "emission");
    material.ambient = color_source(reader, "ambient", preset.ambient);
    material.diffuse = color_source(reader, "diffuse", preset.diffuse);
    material.specular = color_source(reader, "specular", preset.specular);
    material.shininess = reader.number("shininess", {0.0, 1e5}, preset.shininess);
    material.reflection = reader.number("reflection", kShare, preset.reflection);
    material.transmission = reader.number("transmission", kShare, preset.transmission);
    if (preset.ior > 0.0 && !reader.has("ior")) {
      material.ior = preset.ior;
      reader.normalise("ior", preset.ior);
    } else {
      material.ior = reader.optional_number("ior", {0.1, 10.0});
    }
    material.fresnel = reader.boolean("fresnel", preset.fresnel);
    if (reader.clean() && material.fresnel && !material.ior) {
      reader.fault("fresnel", "needs ior, on which Fresnel's equations depend");
    }
    if (!material.fresnel) reader.leave_out("fresnel");
    material.reflection_exponent = lobe(reader, "reflection_exponent");
    material.transmission_exponent = lobe(reader, "transmission_exponent");
    material.bump = bump(reader);
    material.normal_map = normal_map(reader);
    reader.reject_unread_members();
    return material;
  }

  static std::optional<double> lobe(ObjectReader& reader, std::string_view key) {
    const std::optional<double> exponent = reader.optional_number(key, {1.0, 1e6});
    if (!exponent) reader.leave_out(key);
    return exponent;
  }

  BumpMap bump(ObjectReader& material) const {
    if (!material.has("bump")) return {};
    ObjectReader reader = material.object("bump");
    const int texture = relief_texture(reader);
    const BumpMap bump{.texture = texture, .scale = reader.number("scale_m", {-1e3, 1e3})};
    reader.reject_unread_members();
    return bump;
  }

  NormalMap normal_map(ObjectReader& material) const {
    if (!material.has("normal_map")) return {};
    ObjectReader reader = material.object("normal_map");
    const int texture = relief_texture(reader);
    const NormalMap map{.texture = texture, .scale = reader.number("scale", {-1e3, 1e3}, 1.0)};
    reader.reject_unread_members();
    return map;
  }

  // Heights and normals are numbers, which the encoding of colours would bend.
  int relief_texture(ObjectReader& reader) const {
    const std::string name = reader.text("texture", kNameBytes);
    if (!reader.clean()) return -1;
    const int index = index_of(name, scene_.textures, reader, "texture");
    if (!reader.clean()) return -1;
    if (scene_.textures[static_cast<std::size_t>(index)].color_space != ColorSpace::linear) {
      reader.fault("texture", "must be one of color_space \"linear\": its values are no colours");
    }
    return index;
  }

  Object object(ObjectReader& reader) const {
    Object object;
    const ShapeKind kind = reader.choice("type", words(kShapes));
    if (!reader.clean()) return object;  // what else belongs here is unknown
    switch (kind) {
      case ShapeKind::mesh:
        object.shape = mesh(reader);
        break;
      case ShapeKind::sphere:
        object.shape = sphere(reader);
        break;
      case ShapeKind::quad:
        object.shape = quad(reader);
        break;
    }
    if (kind != ShapeKind::mesh) {
      // Legal and without effect: spheres are exact, quads flat.
      reader.choice("interpolation", words(kInterpolations), "phong");
      reader.leave_out("interpolation");
    }
    const std::string name = reader.text("material", kNameBytes);
    if (reader.clean()) object.material = index_of(name, scene_.materials, reader, "material");
    object.velocity = reader.vec3("velocity_m_s", 1e5, "m/s", Vec3{});
    object.mapping = mapping(reader);
    if (reader.clean() && std::holds_alternative<ScreenMapping>(object.mapping) &&
        has_relief(scene_.materials, object.material)) {
      reader.fault("mapping",
                   "must not be \"screen\", which gives no direction on the surface: "
                   "the material's bump or normal_map needs one");
    }
    reader.reject_unread_members();
    return object;
  }

  static bool has_relief(const std::vector<Material>& materials, int index) {
    const Material& material = materials[static_cast<std::size_t>(index)];
    return material.bump.texture >= 0 || material.normal_map.texture >= 0;
  }

  Mapping mapping(ObjectReader& object) const {
    if (!object.has("mapping")) return {};
    ObjectReader reader = object.object("mapping");
    const MappingKind kind = reader.choice("type", words(kMappings));
    if (!reader.clean()) return {};
    Mapping mapping;
    switch (kind) {
      case MappingKind::own:
        break;
      case MappingKind::planar:
        mapping = planar(reader);
        break;
      case MappingKind::spherical: {
        SphericalMapping spherical{.origin = position(reader, "origin_m")};
        read_turns(reader, spherical);
        mapping = spherical;
        break;
      }
      case MappingKind::cylindrical: {
        CylindricalMapping cylindrical{.origin = position(reader, "origin_m")};
        read_turns(reader, cylindrical);
        cylindrical.height = reader.length("height_m", Length::si(kSmallestPeriod), largest()).si();
        mapping = cylindrical;
        break;
      }
      case MappingKind::screen:
        mapping = ScreenMapping{};
        break;
    }
    reader.reject_unread_members();
    if (kind == MappingKind::own) object.leave_out("mapping");
    return mapping;
  }

  PlanarMapping planar(ObjectReader& reader) const {
    const PlanarMapping planar{.origin = position(reader, "origin_m"),
                               .edge_u = position(reader, "edge_u_m"),
                               .edge_v = position(reader, "edge_v_m")};
    for (const auto& [key, edge] :
         {std::pair{"edge_u_m", planar.edge_u}, std::pair{"edge_v_m", planar.edge_v}}) {
      if (reader.clean() && norm(edge) < kSmallestPeriod) {
        reader.fault(key, "must be at least 1e-06 m long");
      }
    }
    require_area(reader, planar.edge_u, planar.edge_v);
    return planar;
  }

  template <typename Turned>
  static void read_turns(ObjectReader& reader, Turned& mapping) {
    mapping.axis = reader.vec3("axis", 1e6, "", mapping.axis);
    mapping.front = reader.vec3("front", 1e6, "", mapping.front);
    mapping.around = static_cast<int>(reader.integer("around", 1, kMostTurns, 1));
    if (!reader.clean()) return;
    if (norm(mapping.axis) == 0.0) return reader.fault("axis", "must not be zero");
    if (norm(mapping.front) == 0.0) return reader.fault("front", "must not be zero");
    // As of edges: a sine below 1e-9 is rounding noise.
    if (!(norm(cross(normalized(mapping.axis), normalized(mapping.front))) > 1e-9)) {
      reader.fault("front", "must not be parallel to axis; its default is [0, 0, 1]");
    }
  }

  MeshObject mesh(ObjectReader& reader) const {
    MeshObject mesh;
    mesh.file = reader.text("file", kNameBytes);
    mesh.interpolation = reader.choice("interpolation", words(kInterpolations), "phong");
    if (const auto degrees = reader.optional_number("crease_angle_deg", {0.0, 180.0})) {
      mesh.crease_angle = *degrees * (std::numbers::pi / 180.0);
    } else {
      reader.leave_out("crease_angle_deg");
    }
    if (reader.value("placement", false) != nullptr) {
      ObjectReader placement = reader.object("placement");
      mesh.placement = {
          .center = position(placement, "center_m"),
          .size = placement.length("size_m", Length::si(1e-6), largest()).si(),
          .turn = placement.number("turn_deg", {-360.0, 360.0}, 0.0) * (std::numbers::pi / 180.0)};
      placement.reject_unread_members();
    }
    return mesh;
  }

  SphereObject sphere(ObjectReader& reader) const {
    SphereObject sphere;
    sphere.center = position(reader, "center_m");
    sphere.radius = reader.length("radius_m", Length::si(1e-6), largest()).si();
    return sphere;
  }

  QuadObject quad(ObjectReader& reader) const {
    QuadObject quad;
    quad.corner = position(reader, "corner_m");
    quad.edge_u = position(reader, "edge_u_m");
    quad.edge_v = position(reader, "edge_v_m");
    require_area(reader, quad.edge_u, quad.edge_v);
    return quad;
  }

  Light light(ObjectReader& reader) const {
    Light light;
    const LightKind kind = reader.choice("type", words(kLights));
    if (!reader.clean()) return light;
    switch (kind) {
      case LightKind::directional:
        light.kind = DirectionalLight{.direction = direction(reader)};
        break;
      case LightKind::point:
        light.kind = PointLight{.position = position(reader, "position_m"),
                                .attenuation = attenuation(reader)};
        break;
      case LightKind::spot:
        light.kind = SpotLight{.position = position(reader, "position_m"),
                               .direction = direction(reader),
                               .exponent = reader.number("exponent", {0.0, 1e4}, 1.0),
                               .attenuation = attenuation(reader)};
        break;
      case LightKind::area: {
        const AreaLight area{.corner = position(reader, "corner_m"),
                             .edge_u = position(reader, "edge_u_m"),
                             .edge_v = position(reader, "edge_v_m"),
                             .attenuation = attenuation(reader)};
        require_area(reader, area.edge_u, area.edge_v);
        light.kind = area;
        break;
      }
    }
    light.intensity = rgb(reader.triple("intensity", kRadiance, ""));
    reader.reject_unread_members();
    return light;
  }

  Length largest() const { return Length::si(limits_.assets.max_coordinate); }
  Vec3 position(ObjectReader& reader, std::string_view key) const {
    return reader.vec3(key, limits_.assets.max_coordinate, "m");
  }

  static Vec3 direction(ObjectReader& reader) {
    const Vec3 direction = reader.vec3("direction", 1e6, "");
    if (reader.clean() && norm(direction) == 0.0) reader.fault("direction", "must not be zero");
    return direction;
  }

  static Attenuation attenuation(ObjectReader& reader) {
    const std::array<double, 3> a =
        reader.triple("attenuation", {0.0, 1e6}, "", std::array{1.0, 0.0, 0.0});
    if (reader.clean() && a[0] + a[1] + a[2] <= 0.0) {
      reader.fault("attenuation", "must not be zero in all three");
    }
    return {a[0], a[1], a[2]};
  }

  static void require_area(ObjectReader& reader, Vec3 edge_u, Vec3 edge_v) {
    // The sine between the edges: below 1e-9 the normal is rounding noise.
    if (reader.clean() && !(norm(cross(edge_u, edge_v)) > 1e-9 * norm(edge_u) * norm(edge_v))) {
      reader.fault("edge_v_m", "must span an area with edge_u_m");
    }
  }

  template <typename Item>
  static int index_of(std::string_view name, const std::vector<Item>& items, ObjectReader& reader,
                      std::string_view key) {
    // Sorted, since they come from the members of an object.
    const auto found = std::ranges::lower_bound(items, name, {}, &Item::name);
    if (found != items.end() && found->name == name) return static_cast<int>(found - items.begin());
    reader.fault(key, "names no " + std::string(key) + " of this scene: " + shortened(name, 64));
    return 0;
  }

  const Limits& limits_;
  Scene scene_ = {};
};

}  // namespace

SceneDocument parse_scene(const json& value, std::string_view pointer, const Limits& limits,
                          FaultList& faults, json* normalised) {
  json normal;
  ObjectReader root(value, std::string(pointer), faults, normal);
  SceneDocument document{.scene = SceneReader(limits).read(root), .canonical = {}};
  if (normalised != nullptr) *normalised = normal;
  normal.erase("title");
  normal.erase("description");
  document.canonical = json_text(normal);
  return document;
}

SceneDocument parse_scene_text(std::string_view text, const Limits& limits) {
  FaultList faults(limits.faults);
  SceneDocument document = parse_scene(parse_json(text, limits), "#", limits, faults, nullptr);
  faults.throw_if_any();
  return document;
}

}  // namespace fstop::api
