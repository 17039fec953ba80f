#include "api/optics_request.h"

#include <cmath>
#include <map>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "api/contract_schema.h"
#include "api/problem.h"
#include "tests/references/oracle.h"

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

const json& figure_of(const json& figures, const std::string& criterion) {
  static const json kNone;
  for (const json& figure : figures) {
    if (figure["criterion"] == criterion) return figure;
  }
  ADD_FAILURE() << "no figure " << criterion;
  return kNone;
}

// What the fixture says of c = 2, 1.414 and the optima, in units of sqrt(f' lambda) = 0.165831 mm;
// its tolerances of 1e-9 (area under the MTF 1e-5), twice for ratios. The other losses of c = 2 are
// those of the optimum's published table, to the digits it has.
TEST(OpticsRequest, TellsWhatEachPinholeCriterionCosts) {
  const json pinhole = answer(R"({"camera": {"pinhole": {"diameter_mm": "optimal",
      "criterion": "petzval"}}})")["pinhole"];
  const double scale_mm = std::sqrt(50.0 * 550e-6);
  const std::map<std::string, std::pair<std::string, double>> metrics = {
      {"peak_incident_normalised", {"brightest", 1.0}},
      {"peak_energy_normalised", {"peak-per-energy", 1.0 / (scale_mm * scale_mm)}},
      {"ee50_radius", {"energy50", scale_mm}},
      {"mtf50", {"mtf50", 1.0 / scale_mm}},
      {"area_abs_mtf_1d", {"line-spread", 1.0 / scale_mm}}};
  int compared = 0;
  const nlohmann::json table = oracle::fixture("pinhole_optimum");
  ASSERT_GE(table.at("rows").size(), 5U);
  for (const json& row : table.at("rows")) {
    const auto metric = metrics.find(row.at("metric").get<std::string>());
    if (metric == metrics.end()) continue;  // windowed radii are no criterion
    const auto& [criterion, unit] = metric->second;
    const double best = row.at("value");
    const double at_2 = row.at("value_at_c_2");
    const double at_petzval = row.at("value_at_c_1_414");
    const double tolerance = criterion == "line-spread" ? 2e-5 : 2e-9;
    const auto loss = [&](double value) {
      return row.at("sense") == "max" ? 1.0 - value / best : value / best - 1.0;
    };
    const json& brightest = figure_of(pinhole["criteria"][0]["figures"], criterion);
    EXPECT_NEAR(brightest["value"].get<double>(), at_2 * unit, tolerance * at_2 * unit);
    EXPECT_NEAR(brightest["loss"].get<double>(), loss(at_2), tolerance) << criterion;
    const json& own = figure_of(pinhole["figures"], criterion);
    EXPECT_NEAR(own["value"].get<double>(), at_petzval * unit, tolerance * at_petzval * unit);
    EXPECT_NEAR(own["loss"].get<double>(), loss(at_petzval), tolerance) << criterion;
    ++compared;
  }
  EXPECT_EQ(compared, 5);
  for (const auto& [criterion, loss] : {std::pair{"peak-per-energy", 0.12},
                                        {"energy50", 0.39},
                                        {"energy80", 0.07},
                                        {"mtf50", 0.17},
                                        {"mtf10", 0.31},
                                        {"line-spread", 0.12},
                                        {"fwhm", 0.05}}) {
    const json& figure = figure_of(pinhole["criteria"][0]["figures"], criterion);
    EXPECT_NEAR(figure["loss"].get<double>(), loss, 0.005) << criterion;
  }
  for (const json& criterion : pinhole["criteria"]) {
    ASSERT_EQ(criterion["figures"].size(), 8U);
    for (const json& figure : criterion["figures"]) {
      const double loss = figure["loss"];
      EXPECT_GE(loss, 0.0);
      // Coefficients of four digits lie within 0.001 of the optimum, where the loss is its square.
      if (figure["criterion"] == criterion["criterion"]) {
        EXPECT_LE(loss, 1e-5);
      }
    }
  }
}

// Behind two Fresnel zones the axis is dark: no width at half its maximum. Beyond c = 20 nothing is
// computed.
TEST(OpticsRequest, LeavesOutFiguresThatAHoleHasNot) {
  const double two_zones = 2.0 * std::sqrt(2.0 * 50.0 * 550e-6);
  const json dark = answer(R"({"camera": {"pinhole": {"diameter_mm": )" +
                           std::to_string(two_zones) + "}}}")["pinhole"]["figures"];
  EXPECT_TRUE(figure_of(dark, "fwhm")["value"].is_null());
  EXPECT_TRUE(figure_of(dark, "fwhm")["loss"].is_null());
  EXPECT_NEAR(figure_of(dark, "brightest")["loss"].get<double>(), 1.0, 1e-6);
  const json wide = answer(R"({"camera": {"pinhole": {"diameter_mm": 10}}})")["pinhole"]["figures"];
  for (const json& figure : wide) EXPECT_TRUE(figure["value"].is_null());
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
