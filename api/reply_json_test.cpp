#include "api/reply_json.h"

#include <gtest/gtest.h>

#include "api/problem.h"

namespace fstop::api {
namespace {

TEST(ReplyJson, TellsAProblemInOneLine) {
  const Problem problem{.status = 422,
                        .type = "/problems/invalid-request",
                        .title = "Invalid request",
                        .detail = "has faults",
                        .errors = {{"#/camera", "is required"}, {"#/seed", "must be positive"}}};
  EXPECT_EQ(told_problem(to_json(problem)),
            "Invalid request: has faults; #/camera is required; #/seed must be positive");
}

// A proxy's page, and documents of other shapes, are shown as they are and never trusted.
TEST(ReplyJson, ShowsWhatIsNoProblem) {
  EXPECT_EQ(told_problem("<html>Bad gateway</html>"), "<html>Bad gateway</html>");
  EXPECT_EQ(told_problem("[1, 2]"), "[1, 2]");
  EXPECT_EQ(told_problem(R"({"title": 5, "errors": "none"})"), R"({"title": 5, "errors": "none"})");
  EXPECT_EQ(told_problem(R"({"title": "t", "errors": [5, {"pointer": "#"}]})"), "t;  ; # ");
  EXPECT_LE(told_problem(std::string(100'000, 'x')).size(), 1000U);
}

TEST(ReplyJson, ReadsAJobsState) {
  EXPECT_EQ(told_job(R"({"job": "a", "state": "done"})").state, "done");
  const ToldJob failed =
      told_job(R"({"state": "failed", "problem": {"title": "Internal", "detail": "it broke"}})");
  EXPECT_EQ(failed.problem, "Internal: it broke");
  EXPECT_EQ(told_job("[]").state, "");
  EXPECT_THROW(told_job("<html>"), InvalidRequest);
}

}  // namespace
}  // namespace fstop::api
