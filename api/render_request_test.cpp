#include "api/render_request.h"

#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include "api/json_text.h"
#include "core/optics/pinhole.h"

namespace fstop::api {
namespace {

using nlohmann::json;

const std::string kSmallest = R"({"scene": "still-life", "camera": {"lens": {}}})";

RenderRequest parsed(const std::string& body, SceneNames names = SceneNames::stored_only) {
  return parse_render_request(body, Limits{}, names);
}

/// The smallest request with the value at `pointer` ("/camera/lens/f_number") replaced.
std::string with(const std::string& pointer, const std::string& value) {
  json body = json::parse(kSmallest);
  body[json::json_pointer(pointer)] = json::parse(value);
  return body.dump();
}

struct Refusal {
  int status = 0;
  std::vector<FieldFault> faults = {};
};

Refusal refusal(const std::string& body, SceneNames names = SceneNames::stored_only) {
  try {
    parsed(body, names);
  } catch (const InvalidRequest& invalid) {
    return {problem(invalid).status, invalid.faults()};
  }
  return {};
}

TEST(RenderRequest, FillsTheDefaultsOfTheContract) {
  const RenderRequest request = parsed(kSmallest);
  const SimulationSpec& spec = request.spec;
  EXPECT_EQ(std::get<std::string>(request.scene), "still-life");
  EXPECT_EQ(spec.camera.position, (Vec3{0, 0, 0}));
  EXPECT_EQ(spec.camera.look_at, (Vec3{0, 0, -1}));
  EXPECT_EQ(spec.camera.up, (Vec3{0, 1, 0}));
  EXPECT_EQ(spec.camera.sensor_width, 36.0_mm);
  EXPECT_EQ(spec.camera.sensor_height, 24.0_mm);
  const auto& lens = std::get<LensSpec>(spec.camera.optics);
  EXPECT_EQ(lens.lens.focal_length, 50.0_mm);
  EXPECT_EQ(lens.lens.f_number, 1.4);
  EXPECT_EQ(lens.focus_distance, 2.0_m);
  EXPECT_EQ(lens.aperture, Aperture{});
  EXPECT_EQ(spec.camera.wavelength, 550.0_nm);
  EXPECT_TRUE(spec.camera.breathing);
  EXPECT_EQ(spec.camera.shutter_seconds, 0.0);
  EXPECT_FALSE(spec.camera.exposure);
  EXPECT_EQ(spec.width, 960);
  EXPECT_EQ(spec.height, 640);
  EXPECT_EQ(request.format, ImageFormat::png);
  EXPECT_EQ(request.precision, Precision::single);
  EXPECT_EQ(spec.quality.max_error, 0.01);
  EXPECT_EQ(spec.quality.method, "auto");
  EXPECT_FALSE(spec.quality.samples);
  EXPECT_FALSE(spec.quality.max_time_ms);
  EXPECT_EQ(spec.effects.defocus, EffectChoice::automatic);
  EXPECT_EQ(spec.effects.falloff, EffectChoice::off);
  EXPECT_EQ(spec.illumination, Illumination::recursive);
  EXPECT_EQ(spec.outputs, std::vector{Output::color});
  EXPECT_EQ(spec.seed, 0U);
}

TEST(RenderRequest, ReadsEveryMember) {
  const RenderRequest request = parsed(R"({
    "scene": "charts", "seed": 4294967295, "outputs": ["coc", "depth"],
    "camera": {"position_m": [1, 2, 3], "look_at_m": [1, 2, 2], "up": [0, 2, 0.5],
      "sensor_mm": [24, 24], "wavelength_nm": 500, "breathing": false, "shutter_s": 0.008,
      "exposure": {"iso": 200},
      "lens": {"focal_length_mm": 35, "f_number": 2.8, "focus_distance_m": "infinity", "blades": 6,
               "blade_rotation_deg": 90}},
    "image": {"width": 64, "height": 64, "format": "exr", "precision": "half"},
    "quality": {"max_error": 0.1, "max_time_ms": 500, "method": "lens-sampling", "samples": 16},
    "effects": {"defocus": "on", "diffraction": "off", "motion": "off", "falloff": "auto"},
    "illumination": "global"})");
  const CameraSpec& camera = request.spec.camera;
  EXPECT_EQ(camera.position, (Vec3{1, 2, 3}));
  EXPECT_EQ(camera.exposure->iso, 200.0);
  EXPECT_EQ(camera.shutter_seconds, 0.008);
  EXPECT_FALSE(camera.breathing);
  const auto& lens = std::get<LensSpec>(camera.optics);
  EXPECT_EQ(lens.focus_distance, kInfinitelyFar);
  EXPECT_EQ(lens.aperture.blades, 6);
  EXPECT_DOUBLE_EQ(lens.aperture.rotation, std::numbers::pi / 2.0);
  EXPECT_EQ(request.format, ImageFormat::exr);
  EXPECT_EQ(request.precision, Precision::half);
  EXPECT_EQ(request.spec.quality.samples, 16);
  EXPECT_EQ(request.spec.quality.max_time_ms, 500.0);
  EXPECT_EQ(request.spec.quality.method, "lens-sampling");
  EXPECT_EQ(request.spec.effects.defocus, EffectChoice::on);
  EXPECT_EQ(request.spec.effects.falloff, EffectChoice::automatic);
  EXPECT_EQ(request.spec.illumination, Illumination::global);
  EXPECT_EQ(request.spec.outputs, (std::vector{Output::color, Output::depth, Output::coc}));
  EXPECT_EQ(request.spec.seed, 4294967295U);
}

// Requests keep the ids that they had when there was nothing else.
TEST(RenderRequest, RecursiveIlluminationIsLeftOutOfTheNormalForm) {
  EXPECT_EQ(parsed(with("/illumination", "\"recursive\"")).canonical,
            parsed(with("/seed", "0")).canonical);
  EXPECT_NE(parsed(with("/illumination", "\"global\"")).canonical,
            parsed(with("/illumination", "\"local\"")).canonical);
}

// d = c sqrt(f' lambda): 2 sqrt(0.05 m 550e-9 m) = 0.33166 mm, and Rayleigh's sqrt(3.6) for 2.
TEST(RenderRequest, ReadsPinholes) {
  const auto diameter = [](const std::string& pinhole) {
    const RenderRequest request =
        parsed(R"({"scene": "charts", "camera": {"pinhole": )" + pinhole + "}}");
    return std::get<PinholeSpec>(request.spec.camera.optics).diameter.si();
  };
  EXPECT_EQ(diameter("{}"), 0.35e-3);
  EXPECT_EQ(diameter(R"({"diameter_mm": 1})"), 1e-3);
  EXPECT_NEAR(diameter(R"({"diameter_mm": "optimal"})"), 0.33166e-3, 5e-9);
  EXPECT_NEAR(diameter(R"({"diameter_mm": "optimal", "criterion": "rayleigh"})"),
              0.33166e-3 * std::sqrt(3.6) / 2.0, 5e-9);
}

TEST(RenderRequest, RefusesWithPointerLimitAndUnit) {
  const struct {
    std::string body;
    std::string pointer;
    std::string detail;  // a part of it
  } rows[] = {
      {with("/camera/lens/focal_length_mm", "0.5"), "#/camera/lens/focal_length_mm",
       "1 mm to 2000 mm"},
      {with("/camera/lens/f_number", "\"2\""), "#/camera/lens/f_number", "got string"},
      {with("/camera/lens/f_number", "\"NaN\""), "#/camera/lens/f_number", "got string"},
      {with("/camera/lens/focus_distance_m", "0.05"), "#/camera/lens/focus_distance_m", "50 mm"},
      {with("/camera/lens/focus_distance_m", "0.05000001"), "#/camera/lens/focus_distance_m",
       "by a millionth"},
      {with("/camera/lens/focus_distance_m", "0.03"), "#/camera/lens/focus_distance_m", "exceed"},
      {with("/camera/lens/focus_distance_m", "-2"), "#/camera/lens/focus_distance_m", "0.01 m"},
      {with("/camera/lens/focus_distance_m", "\"Infinity\""), "#/camera/lens/focus_distance_m",
       "infinity"},
      {with("/camera/lens/blades", "2"), "#/camera/lens/blades", "3 to 64"},
      {with("/camera/lens/blades", "5.5"), "#/camera/lens/blades", "whole"},
      {with("/camera/lens/aperture", "2"), "#/camera/lens/aperture", "unknown"},
      {with("/camera/pinhole", "{}"), "#/camera", "exactly one"},
      {R"({"scene": "charts", "camera": {}})", "#/camera", "exactly one"},
      {R"({"scene": "charts"})", "#/camera", "exactly one"},
      {with("/camera/up", "[0, 0, 3]"), "#/camera/up", "parallel"},
      {with("/camera/up", "[0, 0, 0]"), "#/camera/up", "zero"},
      {with("/camera/look_at_m", "[0, 0, 0]"), "#/camera/look_at_m", "differ"},
      {with("/camera/position_m", "[1e8, 0, 0]"), "#/camera/position_m/0", "10000000 m"},
      {with("/camera/sensor_mm", "[36, 0.5]"), "#/camera/sensor_mm/1", "1 mm to 1000 mm"},
      {with("/camera/wavelength_nm", "0.55"), "#/camera/wavelength_nm", "100 nm to 20000 nm"},
      {with("/camera/exposure", "{\"iso\": 100}"), "#/camera/shutter_s", "positive"},
      {with("/camera/exposure", "\"auto\""), "#/camera/exposure", "relative"},
      {with("/camera/breathing", "1"), "#/camera/breathing", "true or false"},
      {with("/image", R"({"width": 960, "height": 641})"), "#/image", "640"},
      {with("/image", R"({"width": 1000000, "height": 1000000})"), "#/image/width", "16384"},
      {with("/image", R"({"width": 0, "height": 0})"), "#/image/width", "1 to 16384"},
      {with("/image/format", "\"gif\""), "#/image/format", "png, jpeg, webp, tiff, exr"},
      {with("/image/precision", "\"half\""), "#/image/precision", "exr or tiff"},
      {with("/quality/max_error", "0"), "#/quality/max_error", "1e-06 to 1"},
      {with("/quality/samples", "65537"), "#/quality/samples", "1 to 65536"},
      {with("/quality/method", "\"scatter\""), "#/quality/method",
       "auto, pinhole, lens-reconstruction"},
      {with("/effects/motion", "true"), "#/effects/motion", "auto, on, off"},
      {with("/effects/illumination", "\"global\""), "#/effects/illumination", "unknown"},
      {with("/illumination", "\"radiosity\""), "#/illumination", "local, recursive, global"},
      {with("/illumination", "true"), "#/illumination", "local, recursive, global"},
      {with("/outputs", "[]"), "#/outputs", "at least 1"},
      {with("/outputs", R"(["color", "color"])"), "#/outputs/1", "twice"},
      {with("/outputs", R"(["colour"])"), "#/outputs/0", "color, depth"},
      {with("/seed", "4294967296"), "#/seed", "4294967295"},
      {with("/scene", "\"../still-life\""), "#/scene", "a-z"},
      {with("/scene", "\"still-life.json\""), "#/scene", "a-z"},
      {with("/scene", "\"Still\""), "#/scene", "a-z"},
      {with("/scene", "\"\""), "#/scene", "a-z"},
      {with("/scene", "3"), "#/scene", "got number"},
      {R"({"camera": {"lens": {}}})", "#/scene", "required"},
      {with("/Scene", "\"charts\""), "#/Scene", "unknown"},
      {"[]", "#", "must be an object"},
  };
  for (const auto& row : rows) {
    const Refusal told = refusal(row.body);
    EXPECT_EQ(told.status, 422) << row.body;
    ASSERT_FALSE(told.faults.empty()) << row.body;
    EXPECT_EQ(told.faults[0].pointer, row.pointer) << row.body;
    EXPECT_NE(told.faults[0].detail.find(row.detail), std::string::npos) << told.faults[0].detail;
  }
}

// Motion is known for 64 s: of the camera, and of a scene that comes with the request.
TEST(RenderRequest, RefusesLongShuttersWhereThingsMove) {
  const std::string moving = with("/camera/velocity_m_s", "[0.1, 0, 0]");
  const auto open_for = [](const std::string& body, double seconds) {
    json request = json::parse(body);
    request["camera"]["shutter_s"] = seconds;
    return request;
  };
  EXPECT_NO_THROW(parsed(open_for(moving, 64.0).dump()));
  EXPECT_NO_THROW(parsed(open_for(with("/seed", "1"), 65.0).dump()));
  EXPECT_EQ(refusal(open_for(moving, 65.0).dump()).faults.at(0).pointer, "#/camera/shutter_s");
  json frozen = open_for(moving, 65.0);
  frozen["effects"]["motion"] = "off";
  EXPECT_NO_THROW(parsed(frozen.dump()));
  const std::string scene =
      with("/scene",
           R"({"format": "fstop-scene/1", "objects": [{"type": "sphere", "center_m": [0, 0, -3],
      "radius_m": 1, "material": "m", "velocity_m_s": [1, 0, 0]}], "materials": {"m": {"model": "unlit"}}})");
  EXPECT_EQ(refusal(open_for(scene, 65.0).dump()).faults.at(0).pointer, "#/camera/shutter_s");
}

TEST(RenderRequest, RefusesPinholesThatTheoryDoesNotCover) {
  const auto pointer = [](const std::string& camera) {
    return refusal(R"({"scene": "charts", "camera": )" + camera + "}").faults.at(0).pointer;
  };
  EXPECT_EQ(pointer(R"({"pinhole": {"diameter_mm": 0.005}})"), "#/camera/pinhole/diameter_mm");
  EXPECT_EQ(pointer(R"({"pinhole": {"diameter_mm": "best"}})"), "#/camera/pinhole/diameter_mm");
  EXPECT_EQ(pointer(R"({"pinhole": {"criterion": "fwhm"}})"), "#/camera/pinhole/criterion");
  EXPECT_EQ(pointer(R"({"pinhole": {"diameter_mm": "optimal", "criterion": "x"}})"),
            "#/camera/pinhole/criterion");
}

TEST(RenderRequest, RefusesTextThatIsNotJsonWith400) {
  const Refusal large = refusal(R"({"scene": "charts", "camera": {"lens": {"f_number": 1e999}}})");
  EXPECT_EQ(large.status, 400);
  EXPECT_EQ(large.faults.at(0).pointer, "#/camera/lens/f_number");
  EXPECT_EQ(refusal(R"({"scene": NaN})").status, 400);
  EXPECT_EQ(refusal("").status, 400);
}

TEST(RenderRequest, TellsAllFaultsAtOnce) {
  const Refusal told = refusal(R"({"scene": "../x", "colour": 1,
    "camera": {"lens": {"f_number": "2", "focal_length_mm": 0, "zoom": 2}, "sensor_mm": [36]},
    "image": {"width": 1e6, "height": 1.5}, "seed": -1})");
  std::vector<std::string> pointers;
  for (const FieldFault& fault : told.faults) pointers.push_back(fault.pointer);
  std::ranges::sort(pointers);
  const std::vector<std::string> expected = {"#/camera/lens/f_number",
                                             "#/camera/lens/focal_length_mm",
                                             "#/camera/lens/zoom",
                                             "#/camera/sensor_mm",
                                             "#/colour",
                                             "#/image/height",
                                             "#/image/width",
                                             "#/scene",
                                             "#/seed"};
  EXPECT_EQ(pointers, expected);
}

TEST(RenderRequest, BoundsTheWorkAskedFor) {
  const auto code = [](const std::string& body) {
    try {
      parsed(body);
    } catch (const InvalidRequest& invalid) {
      return std::to_string(problem(invalid).status) + invalid.faults().at(0).pointer +
             (invalid.code() == ErrorCode::over_budget ? " over budget" : "");
    }
    return std::string("accepted");
  };
  const std::string square =
      R"({"scene": "charts", "camera": {"sensor_mm": [24, 24], "lens": {}}, )";
  EXPECT_EQ(code(square + R"("image": {"width": 8192, "height": 8192}})"), "accepted");
  EXPECT_EQ(code(square + R"("image": {"width": 8193, "height": 8193}})"),
            "422#/image over budget");
  EXPECT_EQ(
      code(square + R"("image": {"width": 1000, "height": 1000}, "quality": {"samples": 2000}})"),
      "accepted");
  EXPECT_EQ(
      code(square + R"("image": {"width": 1000, "height": 1000}, "quality": {"samples": 2001}})"),
      "422#/quality/samples over budget");
}

TEST(RenderRequest, TakesFilesOnTheCommandLineOnly) {
  for (const std::string name : {"slats.json", "../scenes/slats.json", "scenes/slats"}) {
    const std::string body = with("/scene", json(name).dump());
    EXPECT_EQ(refusal(body).status, 422);
    EXPECT_EQ(std::get<std::string>(parsed(body, SceneNames::stored_or_files).scene), name);
  }
}

TEST(RenderRequest, HasOneCanonicalFormForOneMeaning) {
  const std::string canonical = parsed(kSmallest).canonical;
  const std::string same[] = {
      R"({"camera": {"lens": {}}, "scene": "still-life"})",
      R"({"scene": "still-life", "camera": {"lens": {"f_number": 1.4, "focal_length_mm": 50.0},
          "breathing": true, "sensor_mm": [36.0, 24]}, "image": {"height": 640, "width": 960.0},
          "quality": {"samples": null}, "outputs": ["color"], "seed": -0})",
      with("/image/format", "\"exr\""),
      R"({"scene": "still-life", "camera": {"lens": {}}, "image": {"format": "exr", "precision": "half"}})",
      with("/camera/position_m", "[-0.0, 0, -0.0]"),
      R"({"scene": "still-life", "camera": {"lens": {"f_number": 1.39999999999999991}}})",
      with("/camera/exposure", "\"relative\""),
      with("/scene", "\"charts\"")};
  for (const std::string& body : same) EXPECT_EQ(parsed(body).canonical, canonical) << body;
  const std::string different[] = {with("/camera/lens/f_number", "1.4000000000000001332"),
                                   with("/camera/breathing", "false"),
                                   with("/seed", "1"),
                                   with("/outputs", R"(["depth"])"),
                                   with("/quality/max_time_ms", "100"),
                                   R"({"scene": "still-life", "camera": {"pinhole": {}}})"};
  for (const std::string& body : different) EXPECT_NE(parsed(body).canonical, canonical) << body;
  EXPECT_EQ(parsed(with("/outputs", R"(["coc", "depth", "color"])")).canonical,
            parsed(with("/outputs", R"(["depth", "coc"])")).canonical);
  EXPECT_EQ(parsed(R"({"scene": "a", "camera": {"pinhole": {}, "breathing": false}})").canonical,
            parsed(R"({"scene": "a", "camera": {"pinhole": {}}})").canonical);
}

TEST(RenderRequest, NormalisesToARequestThatMeansTheSame) {
  const RenderRequest request = parsed(with("/camera/lens/focus_distance_m", "\"infinity\""));
  const RenderRequest again = parsed(request.normalised);
  EXPECT_EQ(again.normalised, request.normalised);
  EXPECT_EQ(again.canonical, request.canonical);
  EXPECT_EQ(json::parse(request.normalised).at("scene"), "still-life");
}

}  // namespace
}  // namespace fstop::api
