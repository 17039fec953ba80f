#include "api/json_text.h"

#include <string>

#include <gtest/gtest.h>

#include "api/problem.h"

namespace fstop::api {
namespace {

using namespace std::string_literals;

FieldFault fault_of(const std::string& text) {
  try {
    parse_json(text, Limits{});
  } catch (const InvalidRequest& invalid) {
    EXPECT_EQ(invalid.code(), ErrorCode::malformed_json);
    EXPECT_EQ(invalid.faults().size(), 1U);
    return invalid.faults().front();
  }
  return {"", "accepted"};
}

TEST(JsonText, NamesThePlaceOfWhatIsNotJson) {
  const struct {
    std::string text;
    std::string pointer;
    std::string detail;  // a part of it
  } rows[] = {
      {R"({"camera": {"lens": {"f_number": 1e999}}})", "#/camera/lens/f_number", "too large"},
      {R"({"camera": {"lens": {"f_number": -1e999}}})", "#/camera/lens/f_number", "too large"},
      {R"({"a": 1e-999})", "#/a", "too small"},
      {R"({"a": [0, {"b": NaN}]})", "#/a/1/b", "not JSON"},
      {R"({"a": Infinity})", "#/a", "not JSON"},
      {R"({"a": 01})", "#/a", "not JSON"},
      {R"({"a": 1, "b": 2, "a": 3})", "#/a", "twice"},
      {R"({"a": {"x": 1}, "b": [{"x": 1, "x": 1}]})", "#/b/0/x", "twice"},
      {R"({"a": 1,})", "#/a", "not JSON"},
      {R"({"a": 1} x)", "#", "not JSON"},
      {R"({"a": 1 /* why */})", "#/a", "not JSON"},
      {"{\"a\": \"\xff\"}", "#/a", "not JSON"},
      {"{\"a\": \"\xc0\x80\"}", "#/a", "not JSON"},
      {"{\"a\": \"\0\"}"s, "#/a", "not JSON"},
      {R"({"a": "\ud800"})", "#/a", "not JSON"},
      {R"({"a": [1, 2)", "#/a/2", "not JSON"},
      {"{\"a\": 1}\0 x"s, "#", "NUL"},
      {"", "#", "not JSON"},
      {"{", "#", "not JSON"},
      {"nul", "#", "not JSON"},
  };
  for (const auto& row : rows) {
    const FieldFault fault = fault_of(row.text);
    EXPECT_EQ(fault.pointer, row.pointer) << row.text;
    EXPECT_NE(fault.detail.find(row.detail), std::string::npos) << row.text << ": " << fault.detail;
    EXPECT_LE(fault.detail.size(), Limits{}.echo_bytes);
  }
}

TEST(JsonText, TakesWhatDoublesHold) {
  for (const std::string text :
       {"0", "-0", "0.0", "0e5", "1e308", "5e-324", "123456789012345678901", "\"\\ud83d\\ude00\"",
        "[]", "null", " {} \n"}) {
    EXPECT_NO_THROW(parse_json(text, Limits{})) << text;
  }
}

TEST(JsonText, BoundsDepthBeforeATreeIsBuilt) {
  const auto nested = [](std::size_t depth) {
    return std::string(depth, '[') + std::string(depth, ']');
  };
  EXPECT_NO_THROW(parse_json(nested(32), Limits{}));
  EXPECT_NE(fault_of(nested(33)).detail.find("32"), std::string::npos);
  EXPECT_NE(fault_of(std::string(1'000'000, '[')).detail.find("32"), std::string::npos);
}

TEST(JsonText, EchoesLittleOfALongToken) {
  const FieldFault fault = fault_of("{\"a\": " + std::string(500'000, '7') + "}");
  EXPECT_EQ(fault.pointer, "#/a");
  EXPECT_LE(fault.detail.size(), Limits{}.echo_bytes);
}

// RFC 6901 section 6 gives the fragment forms of these members.
TEST(JsonText, EscapesPointersAsTheStandardDoes) {
  const struct {
    std::string key;
    std::string step;
  } rows[] = {{"foo", "foo"},    {"a/b", "a~1b"},  {"c%d", "c%25d"},
              {"e^f", "e%5Ef"},  {"g|h", "g%7Ch"}, {"i\\j", "i%5Cj"},
              {"k\"l", "k%22l"}, {" ", "%20"},     {"m~n", "m~0n"}};
  for (const auto& row : rows) EXPECT_EQ(pointer_step(row.key), row.step);
  EXPECT_EQ(pointer_step("é"), "%C3%A9");
}

TEST(JsonText, WritesValidTextOfInvalidBytes) {
  EXPECT_EQ(json_text(nlohmann::json("a\xff")), "\"a\xEF\xBF\xBD\"");
}

TEST(JsonText, WritesDoublesThatReadBackTheSame) {
  for (const double number : {0.1, 1.0 / 3.0, 51.282051282051285, 5e-324, 1.7976931348623157e308}) {
    EXPECT_EQ(parse_json(json_text(nlohmann::json(number)), Limits{}).get<double>(), number);
  }
}

}  // namespace
}  // namespace fstop::api
