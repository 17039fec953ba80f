#include "api/verify_suite.h"

#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include "api/chart_photograph.h"
#include "api/contract_schema.h"
#include "api/problem.h"
#include "api/render_request.h"
#include "core/study/verification_chart.h"

namespace fstop::api {
namespace {

using nlohmann::json;

bool fits_schema(const json& suite) {
  const json document = json::parse(suite_schema_json());
  valijson::Schema schema;
  valijson::SchemaParser parser(valijson::SchemaParser::kDraft7);
  parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(document), schema);
  valijson::Validator validator;
  return validator.validate(schema, valijson::adapters::NlohmannJsonAdapter(suite), nullptr);
}

std::vector<FieldFault> faults_of(const json& suite) {
  try {
    parse_verify_suite(suite.dump(), Limits{});
  } catch (const InvalidRequest& refusal) {
    return refusal.faults();
  }
  return {};
}

json small_suite() {
  return json::parse(R"({"format": "fstop-suite/1",
      "cameras": {"a": {"lens": {"focal_length_mm": 50, "f_number": 2, "focus_distance_m": 2}},
                  "hole": {"pinhole": {"diameter_mm": 0.3}}},
      "checks": [{"name": "one", "kind": "blur", "camera": "a", "object_distances_m": [5],
                  "f_numbers": [2, 4], "expected": [null, 0.4], "expected_tolerance_percent": 2}]})");
}

TEST(VerifySuite, TheBundledOneHasEveryKindAndFitsTheSchema) {
  const VerifySuite suite = parse_verify_suite(default_suite_json(), Limits{});
  EXPECT_TRUE(fits_schema(json::parse(default_suite_json())));
  const json kinds = json::parse(suite_schema_json())
                         .at("definitions")
                         .at("check")
                         .at("properties")
                         .at("kind")
                         .at("enum");
  for (const json& kind : kinds) {
    EXPECT_TRUE(std::ranges::any_of(suite.checks, [&](const VerificationCheck& check) {
      return verification_kind_name(check.kind) == kind.get<std::string>();
    })) << kind;
  }
  EXPECT_EQ(kinds.size(), 9U);
}

TEST(VerifySuite, ReadsCamerasListsAndNumbersOfItsOwn) {
  EXPECT_TRUE(fits_schema(small_suite()));
  const VerifySuite suite = parse_verify_suite(small_suite().dump(), Limits{});
  ASSERT_EQ(suite.checks.size(), 1U);
  const VerificationCheck& check = suite.checks[0];
  EXPECT_EQ(check.kind, VerificationKind::blur);
  EXPECT_EQ(std::get<LensSpec>(check.camera.optics).lens.focal_length, 50.0_mm);
  EXPECT_EQ(check.f_numbers, (std::vector<double>{2.0, 4.0}));
  ASSERT_EQ(check.expected.size(), 2U);
  EXPECT_FALSE(check.expected[0]);
  EXPECT_EQ(check.expected[1], 0.4);
  EXPECT_NEAR(check.further_tolerance, 0.02, 1e-15);
}

struct BadSuite {
  const char* pointer = nullptr;  // of what is changed
  const char* value = nullptr;
  const char* fault = nullptr;  // where it shows
  bool schema_sees_it = true;
};

TEST(VerifySuite, RefusesEveryFaultWithItsPointer) {
  const BadSuite cases[] = {
      {"/format", "\"fstop-suite/2\"", "#/format"},
      {"/checks", "[]", "#/checks"},
      {"/checks/0/kind", "\"bokeh\"", "#/checks/0/kind"},
      {"/checks/0/camera", "\"b\"", "#/checks/0/camera", false},
      {"/checks/0/camera", "\"hole\"", "#/checks/0/camera", false},
      {"/checks/0/colour", "1", "#/checks/0/colour"},
      {"/checks/0/blades", "[5]", "#/checks/0/blades", false},  // of another kind
      {"/checks/0/f_numbers", "[0.1]", "#/checks/0/f_numbers/0"},
      {"/checks/0/focus_distances_m", "[0.04]", "#/checks/0/focus_distances_m", false},
      {"/checks/0/expected", "[\"wide\"]", "#/checks/0/expected/0"},
      {"/checks/0/samples", "-1", "#/checks/0/samples"},
      {"/cameras/a/lens/f_number", "\"wide\"", "#/cameras/a/lens/f_number", false},
      {"/cameras/a/colour", "1", "#/cameras/a/colour", false}};
  for (const BadSuite& bad : cases) {
    json suite = small_suite();
    suite[json::json_pointer(bad.pointer)] = json::parse(bad.value);
    const std::vector<FieldFault> faults = faults_of(suite);
    ASSERT_EQ(faults.size(), 1U) << bad.pointer;
    EXPECT_EQ(faults[0].pointer, bad.fault) << faults[0].detail;
    EXPECT_EQ(fits_schema(suite), !bad.schema_sees_it) << bad.pointer;
  }
  json twice = small_suite();
  twice["checks"].push_back(twice["checks"][0]);
  EXPECT_EQ(faults_of(twice).size(), 1U);
  EXPECT_THROW(parse_verify_suite("{", Limits{}), InvalidRequest);
}

// What is sent says what the shot says: read back, it is the same shot.
TEST(ChartPhotograph, RequestsSayWhatTheShotSays) {
  const VerifySuite suite = parse_verify_suite(default_suite_json(), Limits{});
  for (const VerificationCheck& check : suite.checks) {
    SimulationSpec shot = chart_shot(check, 11.0_um, 100, 96);
    shot.quality.samples = 7;
    shot.seed = 3;
    const Scene scene = edge_chart(shot, 3.0_m);
    const std::string text = chart_request_text({.shot = shot, .scene = scene});
    EXPECT_EQ(ContractSchema("RenderRequest").objection(json::parse(text)), "");
    const RenderRequest read = parse_render_request(text, Limits{}, SceneNames::stored_only);
    EXPECT_EQ(read.format, ImageFormat::exr);
    EXPECT_EQ(read.spec.width, 100);
    EXPECT_EQ(read.spec.seed, 3U);
    EXPECT_EQ(read.spec.quality.samples, 7);
    EXPECT_EQ(read.spec.quality.method, shot.quality.method);
    EXPECT_EQ(read.spec.effects.diffraction, EffectChoice::off);
    EXPECT_EQ(read.spec.effects.defocus, EffectChoice::on);
    EXPECT_EQ(read.spec.camera.breathing, check.camera.breathing);
    EXPECT_EQ(read.spec.camera.exposure.has_value(), check.camera.exposure.has_value());
    EXPECT_NEAR(read.spec.camera.sensor_width / shot.camera.sensor_width, 1.0, 1e-15);
    EXPECT_NEAR(pupil_diameter(read.spec.camera) / pupil_diameter(check.camera), 1.0, 1e-15);
    EXPECT_NEAR(sensor_distance(read.spec.camera) / sensor_distance(check.camera), 1.0, 1e-14);
    const auto& objects = std::get<SceneDocument>(read.scene).scene.objects;
    ASSERT_EQ(objects.size(), 1U);
    EXPECT_EQ(std::get<QuadObject>(objects[0].shape).corner,
              std::get<QuadObject>(scene.objects[0].shape).corner);
  }
}

}  // namespace
}  // namespace fstop::api
