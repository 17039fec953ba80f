#include "api/report_json.h"

#include <limits>

#include <gtest/gtest.h>

#include "api/contract_schema.h"
#include "api/render_request.h"
#include "core/error.h"

namespace fstop::api {
namespace {

using nlohmann::json;

RenderReport report() {
  RenderReport result;
  result.method = "lens-sampling";
  result.model = {{"diffraction", false, 0.0004, "Airy diameter 0.05 px"},
                  {"motion", false, std::numeric_limits<double>::infinity(), "unknown"}};
  result.passed_over = {{"pinhole", "largest blur disc 41 px"}};
  result.error = {0.0071, 0.0082, 0.01, 0.0003, 0.0008};
  CameraSpec camera;
  camera.optics = LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 1.4}};
  result.optics = optical_summary(camera, sensor_of(camera, 960, 640), std::nullopt, {});
  result.cost = {.rays = 61'440'000'000, .samples_mean = 41.2, .samples_max = 256};
  result.warnings = {"the sky is black"};
  return result;
}

json text(const RenderReport& told) {
  const RenderRequest request = parse_render_request(
      R"({"scene": "still-life", "camera": {"lens": {}}})", Limits{}, SceneNames::stored_only);
  const Timing timing{.render_ms = 812.0, .queue_ms = 0.3, .encode_ms = 21.0, .cpu_ms = 3180.0};
  return json::parse(report_json(std::string(64, 'a'), told, timing, request.normalised));
}

// The optics are those of the contract's example: 50 mm, f/1.4 at 2 m, coc limit 0.03 mm.
TEST(ReportJson, HasTheMembersOfTheContract) {
  const json value = text(report());
  EXPECT_EQ(ContractSchema("RenderReport").objection(value), "");
  EXPECT_EQ(value["id"], std::string(64, 'a'));
  EXPECT_EQ(value["model"][0], json::parse(R"({"effect": "diffraction", "modelled": false,
      "bound": 0.0004, "why": "Airy diameter 0.05 px"})"));
  EXPECT_EQ(value["model"][1]["bound"], "infinity");
  EXPECT_EQ(value["passed_over"][0]["why"], "largest blur disc 41 px");
  EXPECT_EQ(value["error"]["upper_95"], 0.0082);
  EXPECT_EQ(value["cost"]["rays"], 61'440'000'000);
  EXPECT_EQ(value["cost"]["queue_ms"], 0.3);
  EXPECT_EQ(value["warnings"][0], "the sky is black");
  EXPECT_EQ(value["request"]["camera"]["lens"]["f_number"], 1.4);
  const json& optics = value["optics"];
  EXPECT_NEAR(optics["near_m"].get<double>(), 1.9365, 1e-4);
  EXPECT_NEAR(optics["far_m"].get<double>(), 2.0677, 1e-4);
  EXPECT_NEAR(optics["hyperfocal_m"].get<double>(), 59.56, 0.02);
  EXPECT_NEAR(optics["image_distance_mm"].get<double>(), 51.28, 0.005);
  EXPECT_NEAR(optics["f_number_effective"].get<double>(), 1.436, 5e-4);
  EXPECT_NEAR(optics["airy_diameter_um"].get<double>(), 1.9, 0.05);
  EXPECT_NEAR(optics["view_angle_deg"][0].get<double>(), 38.7, 0.05);
  EXPECT_NEAR(optics["intrinsics_px"][0][0].get<double>(), 1367.5, 0.05);
  EXPECT_EQ(optics["intrinsics_px"][1][2], 320.0);
}

TEST(ReportJson, KeepsEveryDigit) {
  RenderReport told = report();
  told.error.estimate = 1.0 / 3.0;
  EXPECT_EQ(text(told)["error"]["estimate"].get<double>(), 1.0 / 3.0);
}

TEST(ReportJson, NeverSaysNaN) {
  RenderReport told = report();
  told.error.energy = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(text(told), Error);
  told = report();
  told.optics.near = -kInfinitelyFar;
  EXPECT_THROW(text(told), Error);
}

}  // namespace
}  // namespace fstop::api
