#include "api/sweep_request.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/contract_schema.h"

namespace fstop::api {
namespace {

using nlohmann::json;

constexpr const char* kBase = R"({"scene": "tiny", "camera": {"lens": {"focal_length_mm": 50}},
    "image": {"width": 48, "height": 32}})";

SweepRequest parsed(const std::string& text, const Limits& limits = {}) {
  return parse_sweep_request(text, limits, SceneNames::stored_only);
}

SweepRequest sweep_of(const std::string& members) {
  return parsed(R"({"base": )" + std::string(kBase) + ", " + members + "}");
}

json value_in(const SweepRequest& sweep, std::size_t cell, const std::string& pointer) {
  return json::parse(sweep.cells.at(cell).request).at(json::json_pointer(pointer));
}

std::vector<FieldFault> faults_of(const std::string& text, const Limits& limits = {}) {
  try {
    parsed(text, limits);
  } catch (const InvalidRequest& invalid) {
    return invalid.faults();
  }
  return {};
}

std::string list_of(const std::vector<FieldFault>& faults) {
  std::string text;
  for (const FieldFault& fault : faults) text += fault.pointer + " " + fault.detail + "\n";
  return text;
}

void expect_fault(const std::string& text, const std::string& pointer, const std::string& part) {
  const auto faults = faults_of(text);
  const bool is_there = std::ranges::any_of(faults, [&](const FieldFault& fault) {
    return fault.pointer == pointer && fault.detail.find(part) != std::string::npos;
  });
  EXPECT_TRUE(is_there) << pointer << " " << part << " not in\n" << list_of(faults) << text;
}

constexpr const char* kFNumber = "/camera/lens/f_number";
constexpr const char* kFocus = "/camera/lens/focus_distance_m";

TEST(SweepRequest, CrossesAxesTheLastOneFastest) {
  const SweepRequest sweep = sweep_of(R"("axes": [
      {"member": "/camera/lens/f_number", "values": [2, 4]},
      {"member": "#/camera/lens/focus_distance_m", "values": [1, 2, "infinity"]}])");
  ASSERT_EQ(sweep.cells.size(), 6U);
  const json focus = {1.0, 2.0, "infinity"};
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(value_in(sweep, i, kFNumber), i < 3 ? 2.0 : 4.0) << i;
    EXPECT_EQ(value_in(sweep, i, kFocus), focus[i % 3]) << i;
    EXPECT_EQ(sweep.cells[i].place,
              (std::vector<std::uint32_t>{static_cast<std::uint32_t>(i / 3),
                                          static_cast<std::uint32_t>(i % 3)}));
  }
  ASSERT_EQ(sweep.axes.size(), 2U);
  EXPECT_EQ(sweep.axes[1].member, kFocus);
  EXPECT_EQ(sweep.axes[1].values.back(), "\"infinity\"");
}

TEST(SweepRequest, ZipsAxes) {
  const SweepRequest sweep = sweep_of(R"("combine": "zip", "axes": [
      {"member": "/camera/lens/f_number", "values": [2, 4]},
      {"member": "/camera/lens/focus_distance_m", "values": [1, 3]}])");
  ASSERT_EQ(sweep.cells.size(), 2U);
  EXPECT_EQ(value_in(sweep, 1, kFNumber), 4.0);
  EXPECT_EQ(value_in(sweep, 1, kFocus), 3.0);
}

TEST(SweepRequest, WithoutAxesIsOneRender) {
  const SweepRequest sweep = parsed(R"({"base": )" + std::string(kBase) + "}");
  ASSERT_EQ(sweep.cells.size(), 1U);
  EXPECT_TRUE(sweep.cells[0].place.empty());
}

// Members that the base lacks, whole objects, texts, and what lies in arrays.
TEST(SweepRequest, SetsAnyMember) {
  const SweepRequest sweep = sweep_of(R"("axes": [
      {"member": "/quality/samples", "range": {"from": 1, "to": 4, "step": 2, "spacing": "log"}},
      {"member": "/camera/position_m", "values": [[0, 0, 1]]},
      {"member": "/image/format", "values": ["exr", "png"]}])");
  ASSERT_EQ(sweep.cells.size(), 6U);
  EXPECT_EQ(value_in(sweep, 4, "/quality/samples"), 4);
  EXPECT_EQ(value_in(sweep, 0, "/camera/position_m"), json::parse("[0.0, 0.0, 1.0]"));
  EXPECT_EQ(value_in(sweep, 1, "/image/format"), "png");
  const SweepRequest inside = parsed(R"({"base": {"scene": "tiny", "camera": {"lens": {},
      "position_m": [0, 0, 0]}}, "axes": [{"member": "/camera/position_m/2", "values": [0, 1]}]})");
  EXPECT_EQ(value_in(inside, 1, "/camera/position_m"), json::parse("[0.0, 0.0, 1.0]"));
}

TEST(SweepRequest, RangesAreThoseOfTheirSpacing) {
  const SweepRequest sweep = sweep_of(R"("axes": [{"member": "/camera/lens/f_number",
      "range": {"from": 1.4, "to": 16, "step": 3, "spacing": "third-stop"}}])");
  ASSERT_EQ(sweep.cells.size(), 8U);  // 1.4 2 2.8 4 5.6 8 11 16
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_NEAR(value_in(sweep, i, kFNumber).get<double>(),
                std::pow(2.0, (static_cast<double>(i) + 1.0) / 2.0), 1e-12);
  }
}

TEST(SweepRequest, CellsAreWholeRequestsThatMeanTheSame) {
  const SweepRequest sweep = sweep_of(R"("axes": [{"member": "/camera/lens/blades",
      "values": [0, 6]}], "seed": 5)");
  const ContractSchema render("RenderRequest");
  for (const PlannedCell& cell : sweep.cells) {
    EXPECT_EQ(render.objection(json::parse(cell.request)), "");
    const RenderRequest again = parse_render_request(cell.request, {}, SceneNames::stored_only);
    const json whole = json::parse(again.normalised);
    json told = json::parse(cell.request);
    told["image"].erase("format");
    told["image"].erase("precision");
    EXPECT_EQ(whole, told) << "nothing is left to be filled";
  }
}

TEST(SweepRequest, SeedsOfCellsDifferWhereTheSweepHasOne) {
  const std::string axes = R"("axes": [{"member": "/camera/lens/f_number", "values": [2, 4, 8]}])";
  EXPECT_EQ(value_in(sweep_of(axes), 2, "/seed"), 0);
  const SweepRequest seeded = sweep_of(axes + R"(, "seed": 7)");
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(value_in(seeded, i, "/seed"), cell_seed(7, i));
  EXPECT_NE(cell_seed(7, 0), cell_seed(7, 1));
  EXPECT_NE(cell_seed(7, 1), cell_seed(8, 1));
  // SplitMix64 seeded with 0 begins with 0xE220A8397B1DCDAF (the authors' code at
  // prng.di.unimi.it).
  EXPECT_EQ(cell_seed(0, 0), 0xE220A839U);
  const SweepRequest own =
      sweep_of(R"("axes": [{"member": "/seed", "values": [3, 4]}], "seed": 7)");
  EXPECT_EQ(value_in(own, 1, "/seed"), 4);
}

TEST(SweepRequest, IdsFollowWhatIsAskedFor) {
  const std::string axis = R"("axes": [{"member": "/seed", "values": [1, 2]}])";
  const std::vector<std::string> scene = {"a"};
  const std::string id = sweep_id(sweep_of(axis), scene);
  EXPECT_EQ(id.size(), 64U);
  EXPECT_EQ(sweep_id(sweep_of(axis + R"(, "dry_run": true, "combine": "cross")"), scene), id);
  EXPECT_NE(sweep_id(sweep_of(axis + R"(, "combine": "zip")"), scene), id);
  EXPECT_NE(sweep_id(sweep_of(axis), std::vector<std::string>{"b"}), id);
}

TEST(SweepRequest, KnowsItsDifferentScenes) {
  const SweepRequest sweep =
      sweep_of(R"("axes": [{"member": "/scene", "values": ["a", "b", "a"]}])");
  ASSERT_EQ(sweep.scenes.size(), 2U);
  EXPECT_EQ(sweep.cells[1].scene, 1U);
  EXPECT_EQ(sweep.cells[2].scene, 0U);
}

TEST(SweepRequest, FaultsNameAxisValueAndCell) {
  const std::string base = R"({"base": )" + std::string(kBase) + ", ";
  expect_fault(base + R"("axes": [{"member": "/seed", "values": [1, 2]},
      {"member": "/camera/lens/f_number", "values": [2, 4, 8, 500]}]})",
               "#/axes/1/values/3",
               "in cell 3 and 1 more: #/camera/lens/f_number = 500 must lie in");
  expect_fault(base + R"("axes": [{"member": "/camera/lens", "values": [{"f_number": "wide"}]}]})",
               "#/axes/0/values/0/f_number", "in cell 0");
  expect_fault(base + R"("axes": [{"member": "/camera/lens/f_number",
      "range": {"from": 100, "to": 300, "count": 3}}]})",
               "#/axes/0", "in cell 2: #/camera/lens/f_number = 300 must lie in");
  expect_fault(base + R"("axes": [{"member": "/camera/zoom", "values": [1]}]})",
               "#/axes/0/values/0", "is unknown here");
  expect_fault(R"({"base": {"scene": "tiny", "camera": {"lens": {"f_number": 0}}},
      "axes": [{"member": "/seed", "values": [1, 2, 3]}]})",
               "#/base/camera/lens/f_number", "in cell 0 and 2 more");
  // What is wrong between a value and the base belongs to where the parser sees it.
  expect_fault(
      base + R"("axes": [{"member": "/camera/lens/focal_length_mm", "values": [50, 2000]}]})",
      "#/base/camera/lens/focus_distance_m", "in cell 1: must exceed focal_length_mm");
  expect_fault(R"({"base": {"scene": "tiny", "camera": {"lens": {}},
      "quality": {"max_time_ms": 100}}})",
               "#/base/quality/max_time_ms", "must be null in a sweep");
}

TEST(SweepRequest, RefusesBadRequests) {
  const std::string base = R"({"base": )" + std::string(kBase) + ", ";
  struct Case {
    const char* members;
    const char* pointer;
    const char* part;
  };
  for (
      const Case& wrong : std::initializer_list<Case>{
          {R"("axes": [{"member": "seed", "values": [1]}])", "#/axes/0/member", "JSON pointer"},
          {R"("axes": [{"member": "/a~2", "values": [1]}])", "#/axes/0/member", "JSON pointer"},
          {R"("axes": [{"member": "", "values": [1]}])", "#/axes/0/member", "not all of it"},
          {R"("axes": [{"member": 3, "values": [1]}])", "#/axes/0/member", "must be a string"},
          {R"("axes": [{"values": [1]}])", "#/axes/0/member", "is required"},
          {R"("axes": [{"member": "/seed"}])", "#/axes/0", "either values or range"},
          {R"("axes": [{"member": "/seed", "values": [1], "range": {"from": 1, "to": 2, "count": 2}}])",
           "#/axes/0", "either values or range"},
          {R"("axes": [{"member": "/seed", "values": []}])", "#/axes/0/values", "array of 1 to"},
          {R"("axes": [{"member": "/seed", "values": 3}])", "#/axes/0/values", "array of 1 to"},
          {R"("axes": [{"member": "/seed", "values": [1], "step": 1}])", "#/axes/0/step",
           "unknown"},
          {R"("axes": [{"member": "/seed", "range": {"from": 1, "to": 2}}])", "#/axes/0/range",
           "either count or step"},
          {R"("axes": [{"member": "/seed", "range": {"from": 1, "to": 2, "step": -1}}])",
           "#/axes/0/range", "leads from"},
          {R"("axes": [{"member": "/seed", "range": {"from": 1, "to": 2, "step": 1e-9}}])",
           "#/axes/0/range", "at most 10000 are allowed"},
          {R"("axes": [{"member": "/seed", "range": {"from": 1, "to": "infinity", "count": 2}}])",
           "#/axes/0/range/to", "must be a number"},
          {R"("axes": [{"member": "/seed", "range": {"from": 1, "to": 2, "count": 2,
                "spacing": "even"}}])",
           "#/axes/0/range/spacing", "must be one of"},
          {R"("axes": [{"member": "/seed", "values": [1]}, {"member": "/seed", "values": [2]}])",
           "#/axes/1/member", "sets what axis 0 sets"},
          {R"("axes": [{"member": "/camera", "values": [{}]},
                {"member": "/camera/lens/f_number", "values": [2]}])",
           "#/axes/1/member", "sets what axis 0 sets"},
          {R"("axes": [{"member": "/scene/objects", "values": [1]}])", "#/axes/0/member",
           "leads through a string"},
          {R"("axes": [{"member": "/camera/lens/f_number", "values": [2, 3]},
                {"member": "/seed", "values": [1]}], "combine": "zip")",
           "#/axes/1", "zipped axes are equally long"},
          {R"("axes": {})", "#/axes", "must be an array"},
          {R"("combine": "mix")", "#/combine", "must be one of cross, zip"},
          {R"("seed": -1)", "#/seed", "must lie in"},
          {R"("dry_run": 1)", "#/dry_run", "true or false"},
          {R"("axis": [])", "#/axis", "is unknown here"},
          {R"("recipe": "stack")", "#/recipe", "must be one of"},
          {R"("recipe": "focus-stack", "near_m": 1, "far_m": 2)", "#/count", "is required"},
          {R"("recipe": "focus-stack", "near_m": 0, "far_m": 2, "count": 2)", "#/near_m",
           "must lie in"},
          {R"("recipe": "focus-stack", "near_m": 1, "far_m": 2, "count": 2, "axes": [])", "#/axes",
           "is unknown here"},
          {R"("recipe": "pinhole-series", "from_mm": 0.1, "to_mm": 1, "count": 3)", "#/base/camera",
           "needs exactly one of lens and pinhole"},
          {R"("recipe": "through-focus-mtf", "target_m": 2, "near_m": 1, "far_m": 3, "count": 2)",
           "#/base/scene", "must be absent"},
          {R"("recipe": "defocus-dataset", "count": 2)", "#/base/camera", "must be absent"}}) {
    expect_fault(base + wrong.members + "}", wrong.pointer, wrong.part);
  }
  expect_fault("{}", "#/base", "is required");
  expect_fault(R"({"base": 3})", "#/base", "must be an object");
  expect_fault("[]", "#", "must be an object");
}

// Of a base of 900 kB that is wrong in every cell five are read, 4.5 MB.
TEST(SweepRequest, AWrongBaseIsNotReadForEveryCell) {
  const std::string junk(900'000, 'x');
  std::string values;
  for (int i = 0; i < 9000; ++i) values += (i > 0 ? "," : "") + std::to_string(i);
  expect_fault(R"({"base": {"scene": "tiny", "camera": {"lens": {}}, "junk": ")" + junk +
                   R"("}, "axes": [{"member": "/seed", "values": [)" + values + "]}]}",
               "#/base/junk", "in cell 0 and 4 more");
}

TEST(SweepRequest, BoundsItsWork) {
  Limits limits;
  limits.sweep_cells = 5;
  const std::string many = R"({"base": )" + std::string(kBase) + R"(, "axes": [
      {"member": "/seed", "values": [1, 2, 3]},
      {"member": "/camera/lens/f_number", "values": [2, 4]}]})";
  auto faults = faults_of(many, limits);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0], (FieldFault{"#/axes", "make 6 cells; at most 5 are allowed"}));
  limits.sweep_cells = 6;
  EXPECT_TRUE(faults_of(many, limits).empty());
  limits.sweep_bytes = 3000;
  faults = faults_of(many, limits);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_NE(faults[0].detail.find("more than 3000 bytes in all"), std::string::npos);
}

TEST(SweepRecipe, FocusStackIsEvenInDioptres) {
  const SweepRequest sweep =
      sweep_of(R"("recipe": "focus-stack", "near_m": 0.5, "far_m": "infinity", "count": 5)");
  ASSERT_EQ(sweep.cells.size(), 5U);
  const json expected = {0.5, 2.0 / 3.0, 1.0, 2.0, "infinity"};
  for (std::size_t i = 0; i < 5; ++i) {
    const json focus = value_in(sweep, i, kFocus);
    if (expected[i].is_string()) {
      EXPECT_EQ(focus, expected[i]);
    } else {
      EXPECT_NEAR(focus.get<double>(), expected[i].get<double>(), 1e-15) << i;
    }
  }
}

TEST(SweepRecipe, ApertureBracketAndPinholeSeries) {
  const SweepRequest bracket = sweep_of(R"("recipe": "aperture-bracket", "from": 2, "to": 8)");
  ASSERT_EQ(bracket.cells.size(), 5U);
  EXPECT_NEAR(value_in(bracket, 1, kFNumber).get<double>(), std::sqrt(8.0), 1e-15);
  const SweepRequest holes = parsed(R"({"recipe": "pinhole-series", "from_mm": 0.1, "to_mm": 0.4,
      "count": 3, "base": {"scene": "tiny", "camera": {"pinhole": {"image_distance_mm": 50}}}})");
  ASSERT_EQ(holes.cells.size(), 3U);
  EXPECT_NEAR(value_in(holes, 1, "/camera/pinhole/diameter_mm").get<double>(), 0.2, 1e-15);
}

TEST(SweepRecipe, ThroughFocusBringsItsTarget) {
  const SweepRequest sweep = parsed(R"({"recipe": "through-focus-mtf", "target_m": 2, "near_m": 1.5,
      "far_m": 3, "count": 3, "base": {"camera": {"lens": {}}, "image": {"width": 240, "height": 160}}})");
  ASSERT_EQ(sweep.cells.size(), 3U);
  EXPECT_EQ(value_in(sweep, 0, "/image/format"), "exr");
  EXPECT_NEAR(value_in(sweep, 1, kFocus).get<double>(), 2.0, 1e-15);
  ASSERT_TRUE(sweep.edge);
  EXPECT_EQ(sweep.edge->region.width, 180);
  EXPECT_EQ(sweep.scenes.size(), 1U);
}

TEST(SweepRecipe, DatasetIsItsSeed) {
  const std::string text =
      R"({"recipe": "defocus-dataset", "count": 6, "images_per_scene": 2, "seed": )";
  const SweepRequest sweep = parsed(text + "1}");
  const SweepRequest again = parsed(text + "1}");
  const SweepRequest other = parsed(text + "2}");
  ASSERT_EQ(sweep.cells.size(), 6U);
  EXPECT_TRUE(sweep.generates_scenes);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(sweep.cells[i].request, again.cells[i].request);
    EXPECT_NE(value_in(sweep, i, "/scene"), value_in(other, i, "/scene"));
    EXPECT_EQ(value_in(sweep, i, "/image/format"), "exr");
    const double thirds = 6.0 * std::log2(value_in(sweep, i, kFNumber).get<double>());
    EXPECT_NEAR(thirds, std::round(thirds), 1e-9);
    const bool begins = i % 2 == 0;
    if (i == 0) continue;
    EXPECT_EQ(value_in(sweep, i, "/scene") == value_in(sweep, i - 1, "/scene"), !begins) << i;
    EXPECT_NE(value_in(sweep, i, kFocus), value_in(sweep, i - 1, kFocus)) << i;
  }
  // A longer set begins with the shorter one.
  const SweepRequest longer = parsed(R"({"recipe": "defocus-dataset", "count": 40, "seed": 1,
      "images_per_scene": 2, "base": {"image": {"width": 48, "height": 32, "format": "png"}}})");
  EXPECT_EQ(value_in(longer, 5, "/scene"), value_in(sweep, 5, "/scene"));
  EXPECT_EQ(value_in(longer, 39, "/image/format"), "png");
}

}  // namespace
}  // namespace fstop::api
