#include "api/problem.h"

#include <new>

#include <gtest/gtest.h>

#include "api/contract_schema.h"

namespace fstop::api {
namespace {

using nlohmann::json;

TEST(Problem, GivesEachCodeItsStatusAndType) {
  const struct {
    ErrorCode code;
    int status;
    std::string slug;
  } rows[] = {{ErrorCode::outside_domain, 422, "outside-domain"},
              {ErrorCode::invalid_request, 422, "invalid-request"},
              {ErrorCode::malformed_json, 400, "json-invalid"},
              {ErrorCode::not_found, 404, "not-found"},
              {ErrorCode::bad_geometry, 422, "bad-geometry"},
              {ErrorCode::bad_image, 422, "bad-image"},
              {ErrorCode::bad_path, 422, "bad-path"},
              {ErrorCode::over_budget, 422, "over-budget"},
              {ErrorCode::no_valid_method, 422, "no-valid-method"},
              {ErrorCode::cancelled, 503, "cancelled"},
              {ErrorCode::unsupported, 422, "unsupported"},
              {ErrorCode::io_failure, 500, "internal"},
              {ErrorCode::internal, 500, "internal"}};
  for (const auto& row : rows) {
    const Problem told = problem(Error(row.code, "why"));
    EXPECT_EQ(told.status, row.status) << row.slug;
    EXPECT_EQ(told.type, "/problems/" + row.slug);
    EXPECT_FALSE(told.title.empty());
    EXPECT_EQ(told.detail == "why", row.status != 500);
  }
}

TEST(Problem, KeepsInternalsToItself) {
  for (const Problem& told : {problem(std::runtime_error("/secret/path")),
                              problem(Error(ErrorCode::io_failure, "/secret/path"))}) {
    EXPECT_EQ(told.status, 500);
    EXPECT_EQ(to_json(told).find("secret"), std::string::npos);
  }
  EXPECT_EQ(problem(std::bad_alloc()).status, 503);
}

TEST(Problem, CarriesEveryFault) {
  const InvalidRequest invalid(std::vector<FieldFault>{{"#/a", "one"}, {"#/b", "two"}});
  const json value = json::parse(to_json(problem(invalid)));
  EXPECT_EQ(value.at("status"), 422);
  EXPECT_EQ(value.at("errors"), json::parse(R"([{"pointer": "#/a", "detail": "one"},
                                                {"pointer": "#/b", "detail": "two"}])"));
  EXPECT_EQ(ContractSchema("Problem").objection(value), "");
}

TEST(Problem, StaysBelowItsSizeAndCountsWhatItLeavesOut) {
  FaultList faults(1000);
  for (int i = 0; i < 5000; ++i) faults.add("#/" + std::to_string(i), std::string(300, '\x01'));
  try {
    faults.throw_if_any();
    FAIL();
  } catch (const InvalidRequest& invalid) {
    EXPECT_EQ(invalid.faults().size(), 1000U);
    EXPECT_EQ(invalid.unlisted(), 4000U);
    const std::string text = to_json(problem(invalid));
    EXPECT_LE(text.size(), Limits{}.problem_bytes);
    EXPECT_GT(text.size(), Limits{}.problem_bytes / 2);
    const json value = json::parse(text);
    const std::size_t listed = value.at("errors").size() - 1;
    EXPECT_EQ(value.at("errors").back().at("detail"),
              std::to_string(5000 - listed) + " more faults are not listed");
  }
}

TEST(Problem, IsValidTextWhateverWasSent) {
  const Problem told =
      http_problem(400, "bad-framing", "header \xff\xfe " + std::string(9000, 'x'));
  const json value = json::parse(to_json(told));
  EXPECT_EQ(value.at("title"), "Bad framing");
  EXPECT_LE(value.at("detail").get<std::string>().size(), 1100U);
}

TEST(Problem, ShortensBetweenCharacters) {
  EXPECT_EQ(shortened("short", 5), "short");
  EXPECT_EQ(shortened("longer text", 8), "longe...");
  EXPECT_EQ(shortened("ééééé", 8), "éé...");  // two bytes each: five would end inside one
  EXPECT_EQ(shortened("abcdef", 2), "..");
}

}  // namespace
}  // namespace fstop::api
