#include "api/optics_request.h"

#include <gtest/gtest.h>

#include "api/contract_schema.h"
#include "api/problem.h"

namespace fstop::api {
namespace {

using nlohmann::json;

json answer(const std::string& body) {
  const json value = json::parse(optics_json(parse_optics_request(body, Limits{})));
  EXPECT_EQ(ContractSchema("OpticsReport").objection(value), "") << body;
  return value;
}

std::string first_pointer(const std::string& body) {
  try {
    parse_optics_request(body, Limits{});
  } catch (const InvalidRequest& invalid) {
    return invalid.faults().at(0).pointer;
  }
  return "accepted";
}

// By hand: v = 50 * 2000/1950 mm; c = (f/N) v |1/s - 1/d|: at infinity 35.714 * 51.282/2000 mm,
// at 1 m the same with the sign turned; pixel pitch 36/960 mm.
TEST(OpticsRequest, AnswersForALens) {
  const json value = answer(R"({"camera": {"lens": {"f_number": 1.4, "focus_distance_m": 2}},
      "coc_limit_mm": 0.03, "object_distances_m": [1, 2, "infinity", 0.04]})");
  EXPECT_NEAR(value["image_distance_mm"].get<double>(), 50.0 * 2000.0 / 1950.0, 1e-9);
  EXPECT_NEAR(value["magnification"].get<double>(), -50.0 / 1950.0, 1e-12);
  EXPECT_EQ(value["coc_limit_mm"], 0.03);
  const double coc_mm = (50.0 / 1.4) * (50.0 * 2000.0 / 1950.0) / 2000.0;
  const json& at = value["at"];
  ASSERT_EQ(at.size(), 4U);
  EXPECT_EQ(at[0]["object_distance_m"], 1.0);
  EXPECT_NEAR(at[0]["coc_mm"].get<double>(), -coc_mm, 1e-9);
  EXPECT_NEAR(at[1]["coc_mm"].get<double>(), 0.0, 1e-12);
  EXPECT_EQ(at[2]["object_distance_m"], "infinity");
  EXPECT_NEAR(at[2]["coc_mm"].get<double>(), coc_mm, 1e-9);
  EXPECT_NEAR(at[2]["coc_px"].get<double>(), coc_mm / (36.0 / 960.0), 1e-7);
  EXPECT_NEAR(at[2]["image_distance_mm"].get<double>(), 50.0, 1e-9);
  EXPECT_NEAR(at[3]["image_distance_mm"].get<double>(), -200.0, 1e-9);  // virtual: 1/50 - 1/40
  EXPECT_FALSE(value["pinhole"].contains("fresnel_number"));
  EXPECT_EQ(value["plan"]["method"], "lens-sampling");
  // A flat disc on the axis: 1/(4 N_w^2 + 1).
  const double working = 1.4 * (1.0 + 50.0 / 1950.0);
  EXPECT_NEAR(value["relative_illuminance"]["on_axis"].get<double>(),
              1.0 / (4.0 * working * working + 1.0), 1e-12);
}

// By hand: 2 sqrt(0.05 m 550e-9 m) = 0.331662 mm; N_F = a^2/(lambda f') = 1.11364 for a hole of
// 0.35 mm, 1 for the brightest.
TEST(OpticsRequest, AnswersForAPinhole) {
  const json value =
      answer(R"({"camera": {"pinhole": {"image_distance_mm": 50, "diameter_mm": 0.35}},
      "object_distances_m": ["infinity"]})");
  EXPECT_EQ(value["f_number_effective"].get<double>(), 50.0 / 0.35);
  EXPECT_NEAR(value["at"][0]["coc_mm"].get<double>(), 0.35, 1e-12);
  const json& pinhole = value["pinhole"];
  EXPECT_NEAR(pinhole["optimal_diameter_mm"].get<double>(), 0.331662, 1e-6);
  EXPECT_EQ(pinhole["diameter_mm"], 0.35);
  EXPECT_NEAR(pinhole["fresnel_number"].get<double>(), 1.11364, 1e-5);
  ASSERT_EQ(pinhole["criteria"].size(), 10U);
  EXPECT_EQ(pinhole["criteria"][0]["criterion"], "brightest");
  for (const json& criterion : pinhole["criteria"]) {
    EXPECT_NEAR(criterion["diameter_mm"].get<double>(),
                criterion["coefficient"].get<double>() * 0.331662 / 2.0, 1e-6);
  }
  const json brightest = answer(R"({"camera": {"pinhole": {"diameter_mm": "optimal"}}})");
  EXPECT_NEAR(brightest["pinhole"]["fresnel_number"].get<double>(), 1.0, 1e-12);
}

TEST(OpticsRequest, GivesInfinityAsAWord) {
  const json value = answer(R"({"camera": {"lens": {"focus_distance_m": "infinity"}},
                                "object_distances_m": [0.05]})");
  EXPECT_EQ(value["far_m"], "infinity");
  EXPECT_EQ(value["magnification"].get<double>(), 0.0);
  EXPECT_EQ(value["at"][0]["image_distance_mm"], "infinity");
}

TEST(OpticsRequest, RefusesWithPointer) {
  EXPECT_EQ(first_pointer("{}"), "#/camera");
  EXPECT_EQ(first_pointer(R"({"camera": {"lens": {"focus_distance_m": 0.02}}})"),
            "#/camera/lens/focus_distance_m");
  EXPECT_EQ(first_pointer(R"({"camera": {"lens": {}}, "object_distances_m": [1, 0]})"),
            "#/object_distances_m/1");
  EXPECT_EQ(first_pointer(R"({"camera": {"lens": {}}, "object_distances_m": ["far"]})"),
            "#/object_distances_m/0");
  EXPECT_EQ(first_pointer(R"({"camera": {"lens": {}}, "coc_limit_mm": 0})"), "#/coc_limit_mm");
  EXPECT_EQ(first_pointer(R"({"camera": {"lens": {}}, "image": {"width": 960, "height": 100}})"),
            "#/image");
  EXPECT_EQ(first_pointer(R"({"camera": {"lens": {}}, "scene": "charts"})"), "#/scene");
  std::string many = "0.5";
  for (int i = 0; i < 1000; ++i) many += ",0.5";
  EXPECT_EQ(first_pointer(R"({"camera": {"lens": {}}, "object_distances_m": [)" + many + "]}"),
            "#/object_distances_m");
}

}  // namespace
}  // namespace fstop::api
