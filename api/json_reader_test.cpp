#include "api/json_reader.h"

#include <functional>

#include <gtest/gtest.h>

#include "api/json_text.h"

namespace fstop::api {
namespace {

using nlohmann::json;

/// What one reading of `text` gave.
struct Reading {
  std::vector<FieldFault> faults = {};
  json normal = {};
};

Reading reading(const std::string& text, const std::function<void(ObjectReader&)>& read) {
  const json value = parse_json(text, Limits{});
  FaultList faults;
  Reading result;
  ObjectReader reader(value, "#", faults, result.normal);
  read(reader);
  result.faults = faults.faults();
  return result;
}

std::string only_detail(const Reading& reading) {
  return reading.faults.size() == 1 ? reading.faults[0].detail
                                    : std::to_string(reading.faults.size()) + " faults";
}

TEST(JsonReader, ConvertsNoValueToANumber) {
  const struct {
    std::string text;
    std::string detail;
  } rows[] = {{R"({"f_number": "2"})", "must be a number, got string"},
              {R"({"f_number": true})", "must be a number, got boolean"},
              {R"({"f_number": null})", "must be a number, got null"},
              {R"({"f_number": [2]})", "must be a number, got array"},
              {R"({"f_number": "NaN"})", "must be a number, got string"},
              {R"({"f_number": "infinity"})", "must be a number, got string"},
              {R"({"f_number": 0.4})", "must lie in 0.5 to 256"},
              {R"({"f_number": 257})", "must lie in 0.5 to 256"},
              {R"({"f_number": -0.0})", "must lie in 0.5 to 256"},
              {"{}", "is required"}};
  for (const auto& row : rows) {
    const Reading result = reading(row.text, [](ObjectReader& root) {
      root.number("f_number", {0.5, 256.0});
    });
    EXPECT_EQ(only_detail(result), row.detail) << row.text;
    EXPECT_EQ(result.faults.at(0).pointer, "#/f_number");
  }
}

TEST(JsonReader, NamesTheUnitThatAMembersNameEndsIn) {
  const std::pair<std::string, std::string> rows[] = {
      {"shutter_s", "must lie in 1 s to 2 s"},
      {"scale_m", "must lie in 1 m to 2 m"},
      {"velocity_m_s", "must lie in 1 m/s to 2 m/s"},
      {"max_time_ms", "must lie in 1 ms to 2 ms"},
      {"cell_px", "must lie in 1 px to 2 px"},
      {"angle_deg", "must lie in 1 degrees to 2 degrees"},
      {"samples", "must lie in 1 to 2"}};
  for (const auto& [key, detail] : rows) {
    const Reading result = reading("{\"" + key + "\": 3}", [&key](ObjectReader& root) {
      root.number(key, {1.0, 2.0});
    });
    EXPECT_EQ(only_detail(result), detail);
  }
}

TEST(JsonReader, TakesWholeNumbersHoweverWritten) {
  const auto integer = [](const std::string& number) {
    std::int64_t value = -1;
    const Reading result = reading("{\"seed\": " + number + "}", [&](ObjectReader& root) {
      value = root.integer("seed", 0, 0xFFFF'FFFF);
    });
    return result.faults.empty() ? std::to_string(value) : only_detail(result);
  };
  EXPECT_EQ(integer("960"), "960");
  EXPECT_EQ(integer("960.0"), "960");
  EXPECT_EQ(integer("9.6e2"), "960");
  EXPECT_EQ(integer("-0"), "0");
  EXPECT_EQ(integer("4294967295"), "4294967295");
  EXPECT_EQ(integer("4294967296"), "must lie in 0 to 4294967295");
  EXPECT_EQ(integer("18446744073709551616"), "must lie in 0 to 4294967295");
  EXPECT_EQ(integer("9223372036854775808"), "must lie in 0 to 4294967295");
  EXPECT_EQ(integer("-1"), "must lie in 0 to 4294967295");
  EXPECT_EQ(integer("0.5"), "must be a whole number, got 0.5");
  EXPECT_EQ(integer("true"), "must be a number, got boolean");
  EXPECT_EQ(integer("\"1\""), "must be a number, got string");
}

TEST(JsonReader, ReadsLengthsInTheUnitOfTheirName) {
  Length focal;
  Length focus;
  const Reading result = reading(R"({"focal_length_mm": 35, "focus_distance_m": "infinity"})",
                                 [&](ObjectReader& root) {
                                   focal = root.length("focal_length_mm", 1.0_mm, 2.0_m);
                                   focus = root.length("focus_distance_m", 0.01_m, kInfinitelyFar);
                                   root.reject_unread_members();
                                 });
  EXPECT_TRUE(result.faults.empty());
  EXPECT_EQ(focal, 35.0_mm);
  EXPECT_EQ(focus, kInfinitelyFar);
  EXPECT_EQ(json_text(result.normal), R"({"focal_length_mm":35.0,"focus_distance_m":"infinity"})");
}

TEST(JsonReader, NamesLimitsAndUnitsOfLengths) {
  const auto detail = [](const std::string& text, Length max) {
    return only_detail(
        reading(text, [&](ObjectReader& root) { root.length("focal_length_mm", 1.0_mm, max); }));
  };
  EXPECT_EQ(detail(R"({"focal_length_mm": 0.5})", 2.0_m), "must lie in 1 mm to 2000 mm");
  EXPECT_EQ(detail(R"({"focal_length_mm": 0.5})", kInfinitelyFar), "must lie in 1 mm to infinity");
  EXPECT_EQ(detail(R"({"focal_length_mm": "infinity"})", 2.0_m), "must be a number, got string");
  EXPECT_EQ(detail(R"({"focal_length_mm": "far"})", kInfinitelyFar),
            "must be a number or \"infinity\", got string");
}

TEST(JsonReader, PointsAtElementsOfArrays) {
  const Reading result =
      reading(R"({"up": [0, "1", 2000000], "sensor_mm": [36], "at_m": [1, "infinity", -1]})",
              [](ObjectReader& root) {
                root.vec3("up", 1e6, "");
                root.two_lengths("sensor_mm", 1.0_mm, 1.0_m, {36.0_mm, 24.0_mm});
                root.lengths("at_m", 0.001_m, kInfinitelyFar, 3);
              });
  const std::vector<FieldFault> expected = {{"#/up/1", "must be a number, got string"},
                                            {"#/up/2", "must lie in -1000000 to 1000000"},
                                            {"#/sensor_mm", "must be an array of 2 numbers"},
                                            {"#/at_m/2", "must lie in 0.001 m to infinity"}};
  EXPECT_EQ(result.faults, expected);
}

TEST(JsonReader, ReadsListsOfNumbers) {
  std::vector<std::int64_t> counts;
  std::vector<double> errors;
  std::vector<std::int64_t> absent;
  const Reading result =
      reading(R"({"counts": [1, 2.5, 4.0], "errors": [0.1, null, 2]})", [&](ObjectReader& root) {
        counts = root.integers("counts", 1, 3, 8, {});
        errors = root.numbers("errors", {0.0, 1.0}, 8, {});
        absent = root.integers("more", 1, 3, 8, {2, 3});
      });
  const std::vector<FieldFault> expected = {{"#/counts/2", "must lie in 1 to 3"},
                                            {"#/counts/1", "must be a whole number"},
                                            {"#/errors/1", "must be a number, got null"},
                                            {"#/errors/2", "must lie in 0 to 1"}};
  EXPECT_EQ(result.faults, expected);
  EXPECT_EQ(absent, (std::vector<std::int64_t>{2, 3}));
}

TEST(JsonReader, ListsTheWordsOfAClosedSet) {
  static constexpr Named<int> kWords[] = {{"auto", 0}, {"on", 1}, {"off", 2}};
  const std::span<const Named<int>> words = kWords;
  const auto detail = [&](const std::string& text) {
    return only_detail(
        reading(text, [&](ObjectReader& root) { root.choice<int>("motion", words, "auto"); }));
  };
  EXPECT_EQ(detail(R"({"motion": "yes"})"), "must be one of auto, on, off; got \"yes\"");
  EXPECT_EQ(detail(R"({"motion": true})"), "must be one of auto, on, off; got true");
  EXPECT_LE(detail("{\"motion\": \"" + std::string(100'000, 'x') + "\"}").size(), 320U);
  EXPECT_EQ(detail("{}"), "0 faults");
}

TEST(JsonReader, RefusesUnknownMembersWhereverTheyStand) {
  const Reading result =
      reading(R"({"lens": {"f_number": 2, "f/stop": 2}, "lense": {}})", [](ObjectReader& root) {
        ObjectReader lens = root.object("lens");
        lens.number("f_number", {0.5, 256.0});
        lens.reject_unread_members();
        root.reject_unread_members();
      });
  const std::vector<FieldFault> expected = {
      {"#/lens/f~1stop", "is unknown here; known are f_number"},
      {"#/lense", "is unknown here; known are lens"}};
  EXPECT_EQ(result.faults, expected);
}

TEST(JsonReader, SaysOnceThatSomethingIsNoObject) {
  const Reading result = reading(R"({"lens": [1]})", [](ObjectReader& root) {
    ObjectReader lens = root.object("lens");
    lens.number("f_number", {0.5, 256.0});
    lens.reject_unread_members();
  });
  EXPECT_EQ(only_detail(result), "must be an object, got array");
}

TEST(JsonReader, ReadsNullAndAbsenceOfOptionalNumbersAlike) {
  for (const std::string text : {R"({"samples": null})", "{}"}) {
    const Reading result = reading(text, [](ObjectReader& root) {
      EXPECT_EQ(root.optional_integer("samples", 1, 10), std::nullopt);
    });
    EXPECT_EQ(json_text(result.normal), R"({"samples":null})");
    EXPECT_TRUE(result.faults.empty());
  }
}

TEST(JsonReader, BoundsArrays) {
  const Reading result = reading(R"({"objects": [{}, {}, {}]})",
                                 [](ObjectReader& root) { root.objects("objects", 2); });
  EXPECT_EQ(only_detail(result), "must have at most 2 elements");
}

}  // namespace
}  // namespace fstop::api
