#include "api/scene_json.h"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "api/json_text.h"

namespace fstop::api {
namespace {

using nlohmann::json;

// The scene of the contract, with the members its prose adds.
const std::string kScene = R"({
  "format": "fstop-scene/1",
  "textures": {"card": {"file": "card.png", "color_space": "linear", "filter": "bilinear", "wrap": "clamp"},
               "bark": {"file": "bark.png"}},
  "materials": {
    "card":  {"model": "unlit", "emission": {"texture": "card", "scale": [1, 0.5, 0.25]}},
    "metal": {"model": "phong", "ambient": [0.1,0.1,0.1], "diffuse": [0.2,0.2,0.2],
              "specular": [0.5,0.5,0.5], "shininess": 90},
    "glass": {"model": "blinn-phong", "transmission": 0.9, "ior": 1.5, "reflection": 0.1}
  },
  "objects": [
    {"type": "mesh", "file": "bars.obj", "material": "card", "interpolation": "gouraud"},
    {"type": "sphere", "center_m": [0,0,-2], "radius_m": 0.1, "material": "metal", "velocity_m_s": [0,0,1]},
    {"type": "quad", "corner_m": [-1,-1,-6], "edge_u_m": [2,0,0], "edge_v_m": [0,2,0], "material": "glass",
     "interpolation": "flat"}
  ],
  "lights": [
    {"type": "directional", "direction": [0,-1,-1], "intensity": [1,1,1]},
    {"type": "point", "position_m": [0,3,0], "intensity": [9,9,9], "attenuation": [0,0,1]},
    {"type": "spot", "position_m": [0,3,0], "direction": [0,-1,0], "exponent": 8, "intensity": [9,9,9]},
    {"type": "area", "corner_m": [0,3,0], "edge_u_m": [1,0,0], "edge_v_m": [0,0,1], "intensity": [9,9,9]}
  ],
  "ambient_light": [0.1,0.1,0.1],
  "background": [0,0,0.5]
})";

std::vector<FieldFault> faults_of(const std::string& text) {
  try {
    parse_scene_text(text, Limits{});
  } catch (const InvalidRequest& invalid) {
    return invalid.faults();
  }
  return {};
}

std::string with(const std::string& pointer, const std::string& value) {
  json scene = json::parse(kScene);
  scene[json::json_pointer(pointer)] = json::parse(value);
  return scene.dump();
}

TEST(SceneJson, ReadsTheWholeFormat) {
  const Scene scene = parse_scene_text(kScene, Limits{}).scene;
  ASSERT_EQ(scene.textures.size(), 2U);  // in the order of their names
  EXPECT_EQ(scene.textures[0].name, "bark");
  EXPECT_EQ(scene.textures[0].filter, TextureFilter::mipmap);
  EXPECT_EQ(scene.textures[0].wrap, TextureWrap::repeat);
  EXPECT_EQ(scene.textures[0].color_space, ColorSpace::srgb);
  EXPECT_EQ(scene.textures[1].file, "card.png");
  EXPECT_EQ(scene.textures[1].color_space, ColorSpace::linear);
  EXPECT_EQ(scene.textures[1].filter, TextureFilter::bilinear);
  EXPECT_EQ(scene.textures[1].wrap, TextureWrap::clamp);

  ASSERT_EQ(scene.materials.size(), 3U);
  const Material& card = scene.materials[0];
  EXPECT_EQ(card.model, ShadingModel::unlit);
  EXPECT_EQ(card.emission.texture, 1);
  EXPECT_EQ(card.emission.value, (Rgb{1.0F, 0.5F, 0.25F}));
  EXPECT_EQ(card.diffuse.value, (Rgb{0.0F, 0.0F, 0.0F}));
  const Material& glass = scene.materials[1];
  EXPECT_EQ(glass.name, "glass");
  EXPECT_EQ(glass.model, ShadingModel::blinn_phong);
  EXPECT_EQ(glass.transmission, 0.9);
  EXPECT_EQ(glass.reflection, 0.1);
  EXPECT_EQ(glass.ior, 1.5);
  EXPECT_EQ(glass.shininess, 1.0);
  EXPECT_EQ(scene.materials[2].shininess, 90.0);
  EXPECT_FALSE(scene.materials[2].ior);

  ASSERT_EQ(scene.objects.size(), 3U);
  EXPECT_EQ(std::get<MeshObject>(scene.objects[0].shape).interpolation, Interpolation::gouraud);
  EXPECT_EQ(scene.objects[0].material, 0);
  EXPECT_EQ(std::get<SphereObject>(scene.objects[1].shape).center, (Vec3{0, 0, -2}));
  EXPECT_EQ(scene.objects[1].velocity, (Vec3{0, 0, 1}));
  EXPECT_EQ(scene.objects[1].material, 2);
  EXPECT_EQ(std::get<QuadObject>(scene.objects[2].shape).edge_v, (Vec3{0, 2, 0}));

  ASSERT_EQ(scene.lights.size(), 4U);
  EXPECT_EQ(std::get<DirectionalLight>(scene.lights[0].kind).direction, (Vec3{0, -1, -1}));
  EXPECT_EQ(std::get<PointLight>(scene.lights[1].kind).attenuation.a2, 1.0);
  EXPECT_EQ(std::get<PointLight>(scene.lights[1].kind).attenuation.a0, 0.0);
  EXPECT_EQ(std::get<SpotLight>(scene.lights[2].kind).exponent, 8.0);
  EXPECT_EQ(std::get<SpotLight>(scene.lights[2].kind).attenuation.a0, 1.0);
  EXPECT_EQ(std::get<AreaLight>(scene.lights[3].kind).edge_v, (Vec3{0, 0, 1}));
  EXPECT_EQ(scene.lights[3].intensity, (Rgb{9.0F, 9.0F, 9.0F}));
  EXPECT_EQ(scene.background, (Rgb{0.0F, 0.0F, 0.5F}));
}

TEST(SceneJson, RefusesWithPointer) {
  const struct {
    std::string text;
    std::string pointer;
    std::string detail;
  } rows[] = {
      {with("/format", "\"fstop-scene/2\""), "#/format", "fstop-scene/1"},
      {with("/textures/card/file", "3"), "#/textures/card/file", "string"},
      {with("/textures/card/filter", "\"linear\""), "#/textures/card/filter", "mipmap"},
      {with("/textures/a b", "{}"), "#/textures/a%20b/file", "required"},
      {with("/materials/card/emission/texture", "\"wood\""), "#/materials/card/emission/texture",
       "wood"},
      {with("/materials/card/emission", "[1, 2]"), "#/materials/card/emission", "3 numbers"},
      {with("/materials/metal/diffuse/1", "-0.1"), "#/materials/metal/diffuse/1", "0 to 1000000"},
      {with("/materials/metal/model", "\"lambert\""), "#/materials/metal/model", "blinn-phong"},
      {with("/materials/glass/transmission", "1.5"), "#/materials/glass/transmission", "0 to 1"},
      {with("/materials/glass/ior", "0"), "#/materials/glass/ior", "0.1 to 10"},
      {with("/materials/glass/roughness", "0"), "#/materials/glass/roughness", "unknown"},
      {with("/objects/0/material", "\"wood\""), "#/objects/0/material", "wood"},
      {with("/objects/0/type", "\"torus\""), "#/objects/0/type", "mesh, sphere, quad"},
      {with("/objects/1/radius_m", "0"), "#/objects/1/radius_m", "1e-06 m"},
      {with("/objects/1/file", "\"x.obj\""), "#/objects/1/file", "unknown"},
      {with("/objects/2/edge_v_m", "[4, 0, 0]"), "#/objects/2/edge_v_m", "area"},
      {with("/objects/2", "7"), "#/objects/2", "object"},
      {with("/lights/0/direction", "[0, 0, 0]"), "#/lights/0/direction", "zero"},
      {with("/lights/0/attenuation", "[1, 0, 0]"), "#/lights/0/attenuation", "unknown"},
      {with("/lights/1/attenuation", "[0, 0, 0]"), "#/lights/1/attenuation", "zero"},
      {with("/lights/2/exponent", "-1"), "#/lights/2/exponent", "0 to 10000"},
      {with("/ambient_light", "0.1"), "#/ambient_light", "3 numbers"},
      {with("/camera", "{}"), "#/camera", "unknown"},
  };
  for (const auto& row : rows) {
    const std::vector<FieldFault> faults = faults_of(row.text);
    ASSERT_EQ(faults.size(), 1U) << row.pointer;
    EXPECT_EQ(faults[0].pointer, row.pointer);
    EXPECT_NE(faults[0].detail.find(row.detail), std::string::npos) << faults[0].detail;
  }
}

TEST(SceneJson, ReadsMappings) {
  const auto mapping = [](const std::string& text) {
    return parse_scene_text(with("/objects/2/mapping", text), Limits{}).scene.objects[2].mapping;
  };
  EXPECT_TRUE(std::holds_alternative<OwnMapping>(mapping(R"({"type": "uv"})")));
  EXPECT_TRUE(std::holds_alternative<ScreenMapping>(mapping(R"({"type": "screen"})")));
  const auto planar = std::get<PlanarMapping>(mapping(
      R"({"type": "planar", "origin_m": [1,2,3], "edge_u_m": [0,0,2], "edge_v_m": [0,4,0]})"));
  EXPECT_EQ(planar.origin, (Vec3{1, 2, 3}));
  EXPECT_EQ(planar.edge_u, (Vec3{0, 0, 2}));
  EXPECT_EQ(planar.edge_v, (Vec3{0, 4, 0}));
  const auto plain =
      std::get<SphericalMapping>(mapping(R"({"type": "spherical", "origin_m": [1,2,3]})"));
  EXPECT_EQ(plain.origin, (Vec3{1, 2, 3}));
  EXPECT_EQ(plain.axis, (Vec3{0, 1, 0}));
  EXPECT_EQ(plain.front, (Vec3{0, 0, 1}));
  EXPECT_EQ(plain.around, 1);
  const auto tube = std::get<CylindricalMapping>(
      mapping(R"({"type": "cylindrical", "origin_m": [1,2,3], "axis": [1,0,0], "front": [0,1,0],
                  "height_m": 0.5, "around": 3})"));
  EXPECT_EQ(tube.axis, (Vec3{1, 0, 0}));
  EXPECT_EQ(tube.front, (Vec3{0, 1, 0}));
  EXPECT_EQ(tube.height, 0.5);
  EXPECT_EQ(tube.around, 3);
}

TEST(SceneJson, ReadsRelief) {
  json value = json::parse(kScene);
  value["materials"]["metal"]["bump"] = json::parse(R"({"texture": "card", "scale_m": -0.002})");
  value["materials"]["glass"]["normal_map"] = json::parse(R"({"texture": "card"})");
  const Scene scene = parse_scene_text(value.dump(), Limits{}).scene;
  EXPECT_EQ(scene.materials[2].bump.texture, 1);
  EXPECT_EQ(scene.materials[2].bump.scale, -0.002);
  EXPECT_EQ(scene.materials[2].normal_map.texture, -1);
  EXPECT_EQ(scene.materials[1].normal_map.texture, 1);
  EXPECT_EQ(scene.materials[1].normal_map.scale, 1.0);
  EXPECT_EQ(scene.materials[1].bump.texture, -1);
}

std::string with_mapping(const std::string& members) {
  return with("/objects/2/mapping", "{\"origin_m\": [0, 0, 0], " + members + "}");
}

TEST(SceneJson, RefusesMappingsAndReliefWithPointer) {
  json screen = json::parse(kScene);
  screen["materials"]["glass"]["bump"] = json::parse(R"({"texture": "card", "scale_m": 0.01})");
  screen["objects"][2]["mapping"] = json::parse(R"({"type": "screen"})");
  const std::string edges = R"("edge_u_m": [1,0,0], "edge_v_m": [0,1,0])";
  const struct {
    std::string text;
    std::string pointer;
    std::string detail;
  } rows[] = {
      {with("/objects/2/mapping", "\"screen\""), "#/objects/2/mapping", "object"},
      {with("/objects/2/mapping", "{}"), "#/objects/2/mapping/type", "required"},
      {with_mapping(R"("type": "cubic")"), "#/objects/2/mapping/type", "cylindrical, screen"},
      {with_mapping(R"("type": "uv")"), "#/objects/2/mapping/origin_m", "unknown"},
      {with_mapping(R"("type": "screen")"), "#/objects/2/mapping/origin_m", "unknown"},
      {with("/objects/2/mapping", "{\"type\": \"planar\", " + edges + "}"),
       "#/objects/2/mapping/origin_m", "required"},
      {with_mapping(R"("type": "planar", "edge_u_m": [1,0,0], "edge_v_m": [2,0,0])"),
       "#/objects/2/mapping/edge_v_m", "area"},
      {with_mapping(R"("type": "planar", "edge_u_m": [0,0,0], "edge_v_m": [2,0,0])"),
       "#/objects/2/mapping/edge_u_m", "1e-06 m"},
      {with_mapping(R"("type": "planar", "edge_u_m": [1,0,0], "edge_v_m": [0,1e-7,0])"),
       "#/objects/2/mapping/edge_v_m", "1e-06 m"},
      {with_mapping(R"("type": "planar", "edge_u_m": [2e7,0,0], "edge_v_m": [0,1,0])"),
       "#/objects/2/mapping/edge_u_m/0", "m"},
      {with_mapping(R"("type": "spherical", "axis": [0,0,0])"), "#/objects/2/mapping/axis", "zero"},
      {with_mapping(R"("type": "spherical", "axis": [0,0,2])"), "#/objects/2/mapping/front",
       "parallel"},
      {with_mapping(R"("type": "spherical", "front": [0,0,0])"), "#/objects/2/mapping/front",
       "zero"},
      {with_mapping(R"("type": "spherical", "axis": [0,null,0])"), "#/objects/2/mapping/axis/1",
       "number"},
      {with_mapping(R"("type": "spherical", "around": 0)"), "#/objects/2/mapping/around",
       "1 to 1000"},
      {with_mapping(R"("type": "spherical", "around": 1.5)"), "#/objects/2/mapping/around",
       "whole"},
      {with_mapping(R"("type": "spherical", "height_m": 1)"), "#/objects/2/mapping/height_m",
       "unknown"},
      {with_mapping(R"("type": "cylindrical")"), "#/objects/2/mapping/height_m", "required"},
      {with_mapping(R"("type": "cylindrical", "height_m": 0)"), "#/objects/2/mapping/height_m",
       "1e-06 m"},
      {screen.dump(), "#/objects/2/mapping", "bump"},
      {with("/materials/metal/bump", "{\"texture\": \"card\"}"), "#/materials/metal/bump/scale_m",
       "required"},
      {with("/materials/metal/bump", R"({"texture": "wood", "scale_m": 1})"),
       "#/materials/metal/bump/texture", "wood"},
      {with("/materials/metal/bump", R"({"texture": "bark", "scale_m": 1})"),
       "#/materials/metal/bump/texture", "linear"},
      {with("/materials/metal/bump", R"({"texture": "card", "scale_m": 1001})"),
       "#/materials/metal/bump/scale_m", "1000"},
      {with("/materials/metal/normal_map", "\"card\""), "#/materials/metal/normal_map", "object"},
      {with("/materials/metal/normal_map", R"({"texture": "card", "scale": null})"),
       "#/materials/metal/normal_map/scale", "number"},
      {with("/materials/metal/normal_map", R"({"texture": "bark"})"),
       "#/materials/metal/normal_map/texture", "linear"},
      {with("/materials/metal/normal_map", R"({"texture": "card", "scale_m": 1})"),
       "#/materials/metal/normal_map/scale_m", "unknown"},
  };
  for (const auto& row : rows) {
    const std::vector<FieldFault> faults = faults_of(row.text);
    ASSERT_EQ(faults.size(), 1U) << row.text;
    EXPECT_EQ(faults[0].pointer, row.pointer);
    EXPECT_NE(faults[0].detail.find(row.detail), std::string::npos) << faults[0].detail;
  }
}

TEST(SceneJson, HasOneCanonicalFormForOneMeaning) {
  const std::string canonical = parse_scene_text(kScene, Limits{}).canonical;
  EXPECT_EQ(parse_scene_text(canonical, Limits{}).canonical, canonical);
  EXPECT_EQ(parse_scene_text(with("/title", "\"Bars\""), Limits{}).canonical, canonical);
  EXPECT_EQ(parse_scene_text(with("/textures/bark/wrap", "\"repeat\""), Limits{}).canonical,
            canonical);
  EXPECT_EQ(parse_scene_text(with("/objects/2/interpolation", "\"phong\""), Limits{}).canonical,
            canonical);
  EXPECT_EQ(parse_scene_text(with("/materials/metal/ior", "null"), Limits{}).canonical, canonical);
  // What scenes had no word for leaves their form, and so their hash, as it was.
  EXPECT_EQ(canonical.find("mapping"), std::string::npos);
  EXPECT_EQ(canonical.find("bump"), std::string::npos);
  EXPECT_EQ(canonical.find("normal_map"), std::string::npos);
  EXPECT_EQ(parse_scene_text(with("/objects/2/mapping", R"({"type": "uv"})"), Limits{}).canonical,
            canonical);
  const std::string spherical =
      parse_scene_text(with_mapping(R"("type": "spherical")"), Limits{}).canonical;
  EXPECT_NE(spherical, canonical);
  EXPECT_EQ(
      parse_scene_text(with_mapping(R"("type": "spherical", "around": 1)"), Limits{}).canonical,
      spherical);
  EXPECT_NE(parse_scene_text(with("/textures/bark/wrap", "\"clamp\""), Limits{}).canonical,
            canonical);
  EXPECT_NE(parse_scene_text(with("/background", "[0, 0, 0]"), Limits{}).canonical, canonical);
}

TEST(SceneJson, BoundsHowMuchASceneHolds) {
  Limits limits;
  limits.scene_objects = 2;
  limits.scene_lights = 3;
  limits.scene_materials = 2;
  try {
    parse_scene_text(kScene, limits);
    FAIL();
  } catch (const InvalidRequest& invalid) {
    std::vector<std::string> pointers;
    for (const FieldFault& fault : invalid.faults()) pointers.push_back(fault.pointer);
    EXPECT_EQ(pointers, (std::vector<std::string>{"#/materials", "#/objects", "#/lights"}));
  }
}

TEST(SceneJson, ReadsEveryBundledScene) {
  namespace fs = std::filesystem;
  int scenes = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(FSTOP_SOURCE_DIR "/core/scenes")) {
    std::ifstream file(entry.path() / "scene.json");
    if (!file) continue;
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    const Scene scene = parse_scene_text(text, Limits{}).scene;
    EXPECT_FALSE(scene.title.empty()) << entry.path();
    EXPECT_FALSE(scene.description.empty()) << entry.path();
    ++scenes;
  }
  EXPECT_GE(scenes, 1);
}

}  // namespace
}  // namespace fstop::api
