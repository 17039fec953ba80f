#include "api/openapi.h"

#include <filesystem>
#include <functional>

#include <gtest/gtest.h>

#include "core/optics/pinhole.h"
#include "tests/references/openapi_agreement.h"

namespace fstop::api {
namespace {

namespace fs = std::filesystem;

void for_each_object(const json& value, const std::function<void(const json&)>& visit) {
  if (value.is_object()) visit(value);
  if (value.is_structured()) {
    for (const json& item : value) for_each_object(item, visit);
  }
}

TEST(OpenApi, IsTheFileAsItStands) {
  EXPECT_EQ(openapi_json(), file_text(FSTOP_SOURCE_DIR "/api/openapi.json"));
}

TEST(OpenApi, RefersOnlyToWhatIsThere) {
  const json document = json::parse(openapi_json());
  int references = 0;
  for_each_object(document, [&](const json& object) {
    if (!object.contains("$ref")) return;
    const std::string pointer = object.at("$ref").get<std::string>().substr(1);
    EXPECT_TRUE(document.contains(json::json_pointer(pointer))) << pointer;
    ++references;
  });
  EXPECT_GT(references, 100);
}

TEST(OpenApi, ClosesEveryObjectItDescribes) {
  const json document = json::parse(openapi_json());
  for_each_object(document.at("components").at("schemas"), [](const json& schema) {
    if (!schema.contains("properties") || !schema.at("properties").is_object()) return;
    EXPECT_TRUE(schema.contains("additionalProperties")) << schema.dump().substr(0, 100);
  });
}

TEST(OpenApi, KnowsTheCriteriaOfTheOptics) {
  const json document = json::parse(openapi_json());
  json names = json::array();
  for (const PinholeCriterion& criterion : pinhole_criteria()) names.push_back(criterion.name);
  EXPECT_EQ(document.at("components").at("schemas").at("PinholeCriterion").at("enum"), names);
}

TEST(OpenApi, KnowsTheMethodsOfTheCharts) {
  const json schema = json::parse(openapi_json()).at("components").at("schemas").at("MethodName");
  EXPECT_EQ(schema.at("enum"), json(method_names()));
}

TEST(OpenApi, AcceptsEveryExampleAsTheParsersDo) {
  int examples = 0;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(FSTOP_SOURCE_DIR "/api/examples")) {
    if (entry.path().extension() != ".json") continue;
    const Kind kind = kind_of_file(entry.path().filename().string());
    const json example = json::parse(file_text(entry.path()));
    EXPECT_EQ(ContractSchema(schema_of(kind)).objection(example), "") << entry.path();
    EXPECT_TRUE(parses(example, kind)) << entry.path();
    ++examples;
  }
  EXPECT_GE(examples, 10);
  const json paths = json::parse(openapi_json()).at("paths");
  for (const auto& [path, kind] : {std::pair{"/v1/renders", Kind::render},
                                   {"/v1/optics", Kind::optics},
                                   {"/v1/psf", Kind::psf},
                                   {"/v1/charts", Kind::chart},
                                   {"/v1/sweeps", Kind::sweep},
                                   {"/v1/measurements", Kind::measurement},
                                   {"/v1/composites", Kind::composite}}) {
    const json& content = paths.at(path).at("post").at("requestBody").at("content");
    const json& example = content.at("application/json").at("example");
    EXPECT_EQ(ContractSchema(schema_of(kind)).objection(example), "") << path;
    EXPECT_TRUE(parses(example, kind)) << path;
  }
}

TEST(OpenApi, AcceptsEveryNormalisedExample) {
  const ContractSchema render("RenderRequest");
  for (const std::string name : {"lens", "pinhole", "layers", "inline-scene"}) {
    const std::string text = file_text(FSTOP_SOURCE_DIR "/api/examples/" + name + ".json");
    const RenderRequest request = parse_render_request(text, Limits{}, SceneNames::stored_only);
    EXPECT_EQ(render.objection(json::parse(request.normalised)), "") << name;
  }
}

TEST(OpenApi, AgreesWithTheParserOnRenders) {
  const json original = json::parse(
      R"({"scene": "charts", "camera": {"lens": {"f_number": 2}, "sensor_mm": [30, 20], "shutter_s": 1},
          "image": {"width": 300, "height": 200}, "quality": {}, "effects": {}})");
  expect_agreement(original, Kind::render,
                   {{"/scene", "\"a-1\"", true},
                    {"/scene", "\"../a\"", false},
                    {"/scene", "\"\"", false},
                    {"/scene", "null", false},
                    {"/unknown", "1", false},
                    {"/seed", "4294967295", true},
                    {"/seed", "4294967296", false},
                    {"/seed", "1.5", false},
                    {"/seed", "true", false},
                    {"/outputs", R"(["depth", "coc"])", true},
                    {"/outputs", R"(["alpha"])", true},
                    {"/outputs", "[]", false},
                    {"/outputs", R"(["depth", "depth"])", false},
                    {"/outputs", R"(["Z"])", false},
                    {"/camera/lens/f_number", "0.5", true},
                    {"/camera/lens/f_number", "0.49", false},
                    {"/camera/lens/f_number", "\"2\"", false},
                    {"/camera/lens/focal_length_mm", "1000", true},
                    {"/camera/lens/focal_length_mm", "2001", false},
                    {"/camera/lens/focus_distance_m", "\"infinity\"", true},
                    {"/camera/lens/focus_distance_m", "\"Infinity\"", false},
                    {"/camera/lens/focus_distance_m", "0.001", false},
                    {"/camera/lens/blades", "0", true},
                    {"/camera/lens/blades", "3", true},
                    {"/camera/lens/blades", "2", false},
                    {"/camera/lens/blades", "65", false},
                    {"/camera/lens/blade_rotation_deg", "-361", false},
                    {"/camera/lens/zoom", "1", false},
                    {"/camera/lens", "[]", false},
                    {"/camera/pinhole", "{}", false},
                    {"/camera/breathing", "\"yes\"", false},
                    {"/camera/up", "[0, 1]", false},
                    {"/camera/up", "[0, 1, 0, 0]", false},
                    {"/camera/up", "[0, \"1\", 0]", false},
                    {"/camera/position_m", "[1e7, 0, 0]", true},
                    {"/camera/position_m", "[1.1e7, 0, 0]", false},
                    {"/camera/wavelength_nm", "99", false},
                    {"/camera/spectrum", "\"monochromatic\"", true},
                    {"/camera/spectrum", "\"white\"", false},
                    {"/camera/exposure", "\"relative\"", true},
                    {"/camera/exposure", "{\"iso\": 100}", true},
                    {"/camera/exposure", "{\"iso\": 0}", false},
                    {"/camera/exposure", "{}", false},
                    {"/camera/exposure", "100", false},
                    {"/camera/shutter_s", "-1", false},
                    {"/camera/velocity_m_s", "[0.5, 0, -2]", true},
                    {"/camera/velocity_m_s", "[0, 0, 1e6]", false},
                    {"/camera/velocity_m_s", "2", false},
                    {"/image/width", "0", false},
                    {"/image/width", "16385", false},
                    {"/image/format", "\"exr\"", true},
                    {"/image/format", "\"gif\"", false},
                    {"/image/precision", "\"double\"", false},
                    {"/quality/samples", "null", true},
                    {"/quality/samples", "16", true},
                    {"/quality/samples", "0", false},
                    {"/quality/max_time_ms", "null", true},
                    {"/quality/max_time_ms", "600001", false},
                    {"/quality/max_error", "null", false},
                    {"/quality/max_error", "1.01", false},
                    {"/quality/method", "\"pinhole\"", true},
                    {"/quality/method", "\"wave\"", true},
                    {"/quality/method", "\"guess\"", false},
                    {"/effects/falloff", "\"on\"", true},
                    {"/effects/falloff", "true", false},
                    {"/effects/vignetting", "\"on\"", false},
                    {"/illumination", "\"local\"", true},
                    {"/illumination", "\"recursive\"", true},
                    {"/illumination", "\"global\"", true},
                    {"/illumination", "\"radiosity\"", false},
                    {"/illumination", "null", false}});
}

TEST(OpenApi, AgreesWithTheParserOnScenes) {
  const json original = json::parse(file_text(FSTOP_SOURCE_DIR "/api/examples/inline-scene.json"));
  expect_agreement(
      original, Kind::render,
      {{"/scene/format", "\"fstop-scene/2\"", false},
       {"/scene/title", "3", false},
       {"/scene/textures", R"({"a": {"file": "charts/a.png"}})", true},
       {"/scene/textures", R"({"a": {}})", false},
       {"/scene/textures", R"({"a": {"file": "a.png", "wrap": "mirror"}})", false},
       {"/scene/materials/red/model", "\"lambert\"", false},
       {"/scene/materials/red/diffuse", "[0, 0, -1]", false},
       {"/scene/materials/red/diffuse", "0.5", false},
       {"/scene/materials/red/ior", "null", true},
       {"/scene/materials/red/ior", "11", false},
       {"/scene/materials/red/reflection", "1.1", false},
       {"/scene/materials/red/gloss", "1", false},
       {"/scene/objects/0/type", "\"cube\"", false},
       {"/scene/objects/0/radius_m", "0", false},
       {"/scene/objects/0/interpolation", "\"flat\"", true},
       {"/scene/objects/0/velocity_m_s", "[0, 0, 1]", true},
       {"/scene/objects/0/velocity_m_s", "[0, 0]", false},
       {"/scene/objects/0/file", "\"a.obj\"", false},
       {"/scene/objects/0", "{\"type\": \"sphere\"}", false},
       {"/scene/objects/0/mapping", R"({"type": "uv"})", true},
       {"/scene/objects/0/mapping", R"({"type": "screen"})", true},
       {"/scene/objects/0/mapping", R"({"type": "cubic"})", false},
       {"/scene/objects/0/mapping", "\"screen\"", false},
       {"/scene/objects/0/mapping", "null", false},
       {"/scene/objects/0/mapping",
        R"({"type": "planar", "origin_m": [0, 0, 0], "edge_u_m": [1, 0, 0],
                         "edge_v_m": [0, 1, 0]})",
        true},
       {"/scene/objects/0/mapping", R"({"type": "planar", "origin_m": [0, 0, 0]})", false},
       {"/scene/objects/3/mapping", R"({"type": "spherical", "origin_m": [0, 0, 0]})", true},
       {"/scene/objects/3/mapping", R"({"type": "spherical"})", false},
       {"/scene/objects/3/mapping",
        R"({"type": "spherical", "origin_m": [0, 0, 0], "around": 1001})", false},
       {"/scene/objects/3/mapping",
        R"({"type": "cylindrical", "origin_m": [0, 0, 0], "height_m": 1,
                         "axis": [1, 0, 0], "front": [0, 1, 0], "around": 2})",
        true},
       {"/scene/objects/3/mapping",
        R"({"type": "cylindrical", "origin_m": [0, 0, 0], "height_m": 0})", false},
       {"/scene/textures", R"({"a": {"file": "a.png", "filter": "anisotropic"}})", true},
       {"/scene/lights/0/attenuation", "[1, 0, 0]", false},
       {"/scene/lights/1/attenuation", "[1, 0, 1]", true},
       {"/scene/lights/1/attenuation", "[1, 0]", false},
       {"/scene/lights/1/intensity", "[1, 0, 2e6]", false},
       {"/scene/background", "[0, 0, 0, 1]", false},
       {"/scene/sky", "{}", false}});
}

TEST(OpenApi, AgreesWithTheParserOnRelief) {
  json original = json::parse(file_text(FSTOP_SOURCE_DIR "/api/examples/inline-scene.json"));
  original["scene"]["textures"] =
      json::parse(R"({"heights": {"file": "charts/a.png", "color_space": "linear"}})");
  expect_agreement(
      original, Kind::render,
      {{"/scene/materials/red/bump", R"({"texture": "heights", "scale_m": 0.01})", true},
       {"/scene/materials/red/bump", R"({"texture": "heights"})", false},
       {"/scene/materials/red/bump", R"({"texture": "heights", "scale_m": 1e4})", false},
       {"/scene/materials/red/bump", "null", false},
       {"/scene/materials/red/normal_map", R"({"texture": "heights"})", true},
       {"/scene/materials/red/normal_map", R"({"texture": "heights", "scale": -2})", true},
       {"/scene/materials/red/normal_map", R"({"scale": 1})", false},
       {"/scene/materials/red/normal_map", R"({"texture": "heights", "scale": []})", false}});
}

TEST(OpenApi, AgreesWithTheParserOnOptics) {
  const json original = json::parse(R"({"camera": {"pinhole": {}}})");
  expect_agreement(
      original, Kind::optics,
      {{"/camera/pinhole/diameter_mm", "\"optimal\"", true},
       {"/camera/pinhole/diameter_mm", "\"best\"", false},
       {"/camera/pinhole/diameter_mm", "101", false},
       {"/camera/pinhole/image_distance_mm", "0.05", false},
       {"/camera/pinhole", R"({"diameter_mm": "optimal", "criterion": "fwhm"})", true},
       {"/camera/pinhole", R"({"diameter_mm": "optimal", "criterion": "sharp"})", false},
       {"/camera/lens", "{}", false},
       {"/coc_limit_mm", "0.02", true},
       {"/coc_limit_mm", "0", false},
       {"/coc_limit_mm", "null", false},
       {"/object_distances_m", R"([1, "infinity"])", true},
       {"/object_distances_m", "[0]", false},
       {"/object_distances_m", "1", false},
       {"/scene", "\"charts\"", false},
       {"/quality", R"({"max_error": 0.1})", true}});
}

TEST(OpenApi, AgreesWithTheParserOnPointSpreads) {
  const json original = json::parse(R"({"camera": {"pinhole": {}}, "image": {}})");
  expect_agreement(original, Kind::psf,
                   {{"/object_distance_m", "\"infinity\"", true},
                    {"/object_distance_m", "0.0001", true},
                    {"/object_distance_m", "0", false},
                    {"/object_distance_m", "null", false},
                    {"/wavelength_nm", "450.5", true},
                    {"/wavelength_nm", "20001", false},
                    {"/spectrum", "\"rgb\"", true},
                    {"/spectrum", "\"cie\"", false},
                    {"/field_angle_deg", "-90", true},
                    {"/field_angle_deg", "90.5", false},
                    {"/radii_um", "[]", true},
                    {"/radii_um", "[0, 1000000]", true},
                    {"/radii_um", "[1000001]", false},
                    {"/radii_um", "[null]", false},
                    {"/radii_um", "{}", false},
                    {"/frequencies_per_mm", "[0, 1e6]", true},
                    {"/frequencies_per_mm", "[-1]", false},
                    {"/frequencies_per_mm", "[true]", false},
                    {"/frequencies_per_mm", "\"all\"", false},
                    {"/fractions", "[0.001, 0.99]", true},
                    {"/fractions", "[0]", false},
                    {"/fractions", "[0.995]", false},
                    {"/image/width", "1024", true},
                    {"/image/width", "1025", false},
                    {"/image/height", "0", false},
                    {"/image/pixel_um", "0.001", true},
                    {"/image/pixel_um", "0.0009", false},
                    {"/image/format", "\"exr\"", true},
                    {"/image/format", "\"gif\"", false},
                    {"/image/stretch", "\"square-root\"", true},
                    {"/image/stretch", "\"gamma\"", false},
                    {"/image/precision", "\"half\"", false},
                    {"/image", "[]", false},
                    {"/quality", "{}", false},
                    {"/camera/lens", "{}", false}});
}

TEST(OpenApi, AgreesWithTheParserOnCharts) {
  const json original =
      json::parse(R"({"scene": "charts", "camera": {"lens": {}}, "image": {}, "reference": {}})");
  expect_agreement(original, Kind::chart,
                   {{"/scene", "\"a.json\"", false},
                    {"/seed", "4294967295", true},
                    {"/seed", "-1", false},
                    {"/methods", R"(["wave", "pinhole"])", true},
                    {"/methods", "[]", false},
                    {"/methods", R"(["wave", "wave"])", false},
                    {"/methods", R"(["auto"])", false},
                    {"/methods", "\"wave\"", false},
                    {"/samples", "[1024, 1]", true},
                    {"/samples", "[]", true},
                    {"/samples", "[0]", false},
                    {"/samples", "[65537]", false},
                    {"/samples", "[1.5]", false},
                    {"/samples", "[2, 2]", false},
                    {"/samples", "null", false},
                    {"/max_errors", "[1, 1e-6]", true},
                    {"/max_errors", "[]", true},
                    {"/max_errors", "[1.1]", false},
                    {"/max_errors", "[\"0.1\"]", false},
                    {"/max_errors", "[0.1, 0.1]", false},
                    {"/reference/method", "\"auto\"", true},
                    {"/reference/method", "\"wave\"", true},
                    {"/reference/method", "\"truth\"", false},
                    {"/reference/method", "null", false},
                    {"/reference/samples", "4096", true},
                    {"/reference/samples", "0", false},
                    {"/reference/replicates", "2", true},
                    {"/reference/replicates", "1", false},
                    {"/reference/replicates", "65", false},
                    {"/reference/seed", "1", false},
                    {"/image/width", "0", false},
                    {"/image/format", "\"png\"", false},
                    {"/effects", R"({"diffraction": "off"})", true},
                    {"/illumination", "\"global\"", true},
                    {"/illumination", "2", false},
                    {"/quality", "{}", false},
                    {"/outputs", R"(["color"])", false}});
}

}  // namespace
}  // namespace fstop::api
