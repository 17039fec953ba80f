#include "api/chart_request.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "api/contract_schema.h"

namespace fstop::api {
namespace {

using nlohmann::json;

const std::string kSmallest = R"({"scene": "still-life", "camera": {"lens": {}}})";

ChartRequest parsed(const std::string& body, const Limits& limits = {}) {
  return parse_chart_request(body, limits, SceneNames::stored_only);
}

/// The smallest request with the value at `pointer` set.
std::string with(const std::string& pointer, const std::string& value) {
  json body = json::parse(kSmallest);
  body[json::json_pointer(pointer)] = json::parse(value);
  return body.dump();
}

struct Refusal {
  ErrorCode code = ErrorCode::internal;
  std::vector<FieldFault> faults = {};
};

Refusal refusal(const std::string& body, const Limits& limits = {}) {
  try {
    parsed(body, limits);
  } catch (const InvalidRequest& invalid) {
    return {invalid.code(), invalid.faults()};
  }
  return {};
}

TEST(ChartRequest, FillsItsDefaults) {
  const ChartRequest request = parsed(kSmallest);
  EXPECT_EQ(std::get<std::string>(request.picture.scene), "still-life");
  EXPECT_EQ(request.chart.shot.width, 192);
  EXPECT_EQ(request.chart.shot.height, 128);
  EXPECT_EQ(request.chart.methods, method_names());
  EXPECT_EQ(request.chart.samples, (std::vector{1, 2, 4, 8, 16, 32, 64}));
  EXPECT_EQ(request.chart.max_errors, (std::vector{0.03, 0.01}));
  EXPECT_EQ(request.chart.reference.method, "");
  EXPECT_EQ(request.chart.reference.samples, 256);
  EXPECT_EQ(request.chart.reference.replicates, 4);
  EXPECT_EQ(request.chart.shot.seed, 0U);
}

TEST(ChartRequest, ReadsEveryMember) {
  const ChartRequest request = parsed(R"({"scene": "charts", "seed": 7,
    "camera": {"lens": {"f_number": 4}, "sensor_mm": [24, 24]},
    "image": {"width": 64, "height": 64}, "effects": {"diffraction": "off"}, "illumination": "global",
    "methods": ["lens-sampling", "pinhole"], "samples": [64, 4.0], "max_errors": [0.02],
    "reference": {"method": "lens-sampling", "samples": 512, "replicates": 8}})");
  const AccuracyChartSpec& chart = request.chart;
  EXPECT_EQ(chart.shot.seed, 7U);
  EXPECT_EQ(chart.shot.width, 64);
  EXPECT_EQ(chart.shot.effects.diffraction, EffectChoice::off);
  EXPECT_EQ(chart.shot.illumination, Illumination::global);
  EXPECT_EQ(chart.methods, (std::vector<std::string>{"pinhole", "lens-sampling"}));
  EXPECT_EQ(chart.samples, (std::vector{64, 4}));
  EXPECT_EQ(chart.max_errors, std::vector{0.02});
  EXPECT_EQ(chart.reference.method, "lens-sampling");
  EXPECT_EQ(chart.reference.samples, 512);
  EXPECT_EQ(chart.reference.replicates, 8);
}

TEST(ChartRequest, RefusesWithPointerAndLimit) {
  struct Case {
    const char* pointer;
    const char* value;
    const char* where;
    const char* detail;
  };
  const std::vector<Case> table = {
      {"/methods", R"(["lens-sampling", "guess"])", "#/methods/1",
       "must be one of pinhole, lens-reconstruction"},
      {"/methods", "[]", "#/methods", "at least 1"},
      {"/samples", "[1, 0]", "#/samples/1", "must lie in 1 to 65536"},
      {"/samples", "[1.5]", "#/samples/0", "must be a whole number"},
      {"/samples", "[4, 8, 4]", "#/samples/2", "must not stand twice"},
      {"/samples", "16", "#/samples", "must be an array"},
      {"/max_errors", "[0]", "#/max_errors/0", "must lie in 1e-06 to 1"},
      {"/max_errors", "[0.1, 0.1]", "#/max_errors/1", "must not stand twice"},
      {"/reference/replicates", "1", "#/reference/replicates", "must lie in 2 to 64"},
      {"/reference/method", "\"truth\"", "#/reference/method", "must be one of auto, pinhole"},
      {"/reference/seed", "1", "#/reference/seed", "is unknown here"},
      {"/image/format", "\"png\"", "#/image/format", "is unknown here"},
      {"/image/width", "200", "#/image", "must have square pixels"},
      {"/quality", "{}", "#/quality", "is unknown here"},
      {"/illumination", "\"all\"", "#/illumination", "must be one of local, recursive, global"},
      {"/outputs", "[]", "#/outputs", "is unknown here"},
      {"/camera/lens/f_number", "0", "#/camera/lens/f_number", "must lie in 0.5 to 256"},
  };
  for (const Case& test : table) {
    const Refusal refused = refusal(with(test.pointer, test.value));
    ASSERT_EQ(refused.faults.size(), 1U) << test.pointer << " = " << test.value;
    EXPECT_EQ(refused.faults.front().pointer, test.where);
    EXPECT_NE(refused.faults.front().detail.find(test.detail), std::string::npos)
        << refused.faults.front().detail;
  }
  EXPECT_EQ(refusal(R"({"scene": "a", "camera": {"lens": {}}, "samples": [], "max_errors": []})")
                .faults.front()
                .pointer,
            "#/samples");
  EXPECT_EQ(refusal(R"({"samples": [0], "reference": []})").faults.size(), 4U);
}

// 192 x 128 pixels; 4 replicates of 256 samples and, for each method, 127 of the default counts.
TEST(ChartRequest, BoundsTheWork) {
  const auto methods = static_cast<std::int64_t>(method_names().size());
  Limits limits;
  limits.chart_samples = (4 * 256 + methods * 127) * 192 * 128;
  EXPECT_NO_THROW(parsed(kSmallest, limits));
  --limits.chart_samples;
  const Refusal too_many = refusal(kSmallest, limits);
  EXPECT_EQ(too_many.code, ErrorCode::over_budget);
  EXPECT_EQ(too_many.faults.front().pointer, "#/samples");
  const Refusal too_large = refusal(with("/image", R"({"width": 1536, "height": 1024})"));
  EXPECT_EQ(too_large.code, ErrorCode::over_budget);
  EXPECT_EQ(too_large.faults.front().pointer, "#/image");
  EXPECT_NE(too_large.faults.front().detail.find("1048576"), std::string::npos);
}

TEST(ChartRequest, NormalFormIsARequestOfTheSameKind) {
  const ChartRequest request = parsed(kSmallest);
  const json normal = json::parse(request.picture.normalised);
  EXPECT_EQ(ContractSchema("ChartRequest").objection(normal), "");
  EXPECT_EQ(normal.at("reference").at("method"), "auto");
  const ChartRequest again = parsed(request.picture.normalised);
  EXPECT_EQ(again.picture.normalised, request.picture.normalised);
  EXPECT_EQ(again.picture.canonical, request.picture.canonical);
  EXPECT_FALSE(json::parse(request.picture.canonical).contains("scene"));
  EXPECT_NE(parsed(with("/samples", "[1]")).picture.canonical, request.picture.canonical);
}

AccuracyChart measured_chart() {
  AccuracyPoint point{.method = "lens-sampling", .estimate = 0.012, .upper_95 = 0.014};
  point.cost = {.rays = 98'304, .samples_mean = 4.0, .cpu_seconds = 0.01, .wall_seconds = 0.006};
  point.truth = {.rmse = 0.011, .rel_mse = 0.002, .energy = -0.001, .rmse_at_most = 0.011};
  AccuracyPoint unknown{.method = "pinhole"};
  unknown.truth = {.rmse = 0.0, .resolved = false, .rmse_at_most = 2e-4};
  AccuracyChart chart;
  chart.reference = {.method = "lens-sampling", .samples = 1024, .replicates = 4, .noise = 2e-4};
  chart.points = {unknown, point};
  chart.picks = {{.max_error = 0.02,
                  .point = point,
                  .model = {{"diffraction", false, 0.0004, "Airy diameter 0.05 px"}},
                  .passed_over = {{"pinhole", "largest blur disc 41 px"}},
                  .warnings = {"w"}},
                 {.max_error = 0.01, .point = point}};
  chart.refused = {{"wave", "has no field"}};
  return chart;
}

TEST(ChartJson, HasTheMembersOfTheContract) {
  const json value = json::parse(chart_json(parsed(kSmallest), measured_chart()));
  EXPECT_EQ(ContractSchema("ChartReport").objection(value), "");
  EXPECT_EQ(value["reference"]["noise"], 2e-4);
  EXPECT_EQ(value["points"][0]["estimate"], nullptr);
  EXPECT_EQ(value["points"][0]["true_error"]["resolved"], false);
  EXPECT_EQ(value["points"][1]["rays"], 98'304);
  EXPECT_EQ(value["points"][1]["true_error"]["energy"], -0.001);
  EXPECT_EQ(value["picks"][0]["meets_target"], true);
  EXPECT_EQ(value["picks"][1]["meets_target"], false);
  EXPECT_EQ(value["picks"][0]["keeps_bound"], true);
  EXPECT_EQ(value["picks"][0]["passed_over"][0]["why"], "largest blur disc 41 px");
  EXPECT_EQ(value["refused"][0]["method"], "wave");
  EXPECT_EQ(value["request"]["image"]["width"], 192);
}

TEST(ChartSvgOfRequest, SaysWhatWasPhotographed) {
  const std::string svg = chart_svg(parsed(kSmallest), measured_chart());
  EXPECT_NE(svg.find("Time against true error: still-life</text>"), std::string::npos);
  EXPECT_NE(svg.find("50 mm f/1.4 focused at 2 m, 192 x 128 pixels, 1 thread<"), std::string::npos);
  const ChartRequest pinhole = parsed(R"({"scene": {"format": "fstop-scene/1", "title": "A & B"},
      "camera": {"pinhole": {"diameter_mm": 0.35}}})");
  const std::string other = chart_svg(pinhole, measured_chart());
  EXPECT_NE(other.find(": A &amp; B</text>"), std::string::npos);
  EXPECT_NE(other.find("pinhole of 0.35 mm, 50 mm from the sensor"), std::string::npos);
}

}  // namespace
}  // namespace fstop::api
