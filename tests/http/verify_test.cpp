// fstop verify and fstop baseline as people run them: here and against servers.
#include <chrono>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/http/program.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

using namespace std::chrono_literals;

// Two kinds of check, of few samples: what is tested here is the way of the pictures.
std::string small_suite(const std::string& members = {}) {
  return R"({"format": "fstop-suite/1", "title": "small",
      "cameras": {"a": {"lens": {"focal_length_mm": 50, "f_number": 2, "focus_distance_m": 2},
                        "shutter_s": 0.01, "exposure": {"iso": 100}},
                  "b": {"lens": {"focal_length_mm": 50, "f_number": 2, "focus_distance_m": 2}}},
      "checks": [{"name": "brightness", "kind": "brightness", "camera": "a", "f_numbers": [2, 4, 8]},
                 {"name": "breathing", "kind": "breathing", "camera": "b",
                  "focus_distances_m": [0.5, 2]})" +
         members + "]}";
}

class Verify : public testing::Test {
 protected:
  void SetUp() override {
    write_scenes(folder_);
    folder_.write("suite.json", small_suite());
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  static std::string url(const TestServer& server) {
    return "http://127.0.0.1:" + std::to_string(server.port());
  }
  TemporaryFolder folder_;
};

TEST_F(Verify, MeasuresTheSameHereAndThroughAServer) {
  const Outcome here = run_fstop({"verify", "--suite", path("suite.json")});
  EXPECT_EQ(here.exit_code, 0) << here.output << here.errors;
  EXPECT_NE(here.output.find("6 results, 0 red"), std::string::npos) << here.output;
  TestServer server;
  const Outcome there = run_fstop({"verify", "--suite", path("suite.json"), "--server", url(server),
                                   "--junit", path("out.xml"), "--report", path("out.html")});
  EXPECT_EQ(there.exit_code, 0) << there.output << there.errors;
  EXPECT_EQ(there.output, here.output);
  EXPECT_NE(text_of_file(path("out.xml")).find("<testsuites name=\"small, http://127.0.0.1:"),
            std::string::npos);
  EXPECT_EQ(text_of_file(path("out.html")).find("<!DOCTYPE html>"), 0U);
}

TEST_F(Verify, WaitsForJobs) {
  TestServer::Options options;
  options.limits.synchronous_wait = options.limits.longest_wait = 0ms;
  TestServer server(std::move(options));
  const Outcome outcome =
      run_fstop({"verify", "--suite", path("suite.json"), "--server", url(server)});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output << outcome.errors;
  EXPECT_NE(server.log_text().find("/image"), std::string::npos);
}

TEST_F(Verify, BearsItsToken) {
  TestServer server({.token = "0123456789abcdef"});
  const std::vector<std::string> bare = {"verify", "--suite", path("suite.json"), "--server",
                                         url(server)};
  const Outcome without = run_fstop(bare);
  EXPECT_EQ(without.exit_code, 1);
  EXPECT_NE(without.errors.find("--token-file"), std::string::npos) << without.errors;
  folder_.write("token", "0123456789abcdef\n");
  std::vector<std::string> with = bare;
  with.insert(with.end(), {"--token-file", path("token")});
  EXPECT_EQ(run_fstop(with).exit_code, 0);
}

TEST_F(Verify, SaysThatTheServerIsGone) {
  std::string gone;
  {
    const TestServer server;
    gone = url(server);
  }
  const Outcome outcome = run_fstop({"verify", "--suite", path("suite.json"), "--server", gone,
                                     "--junit", path("gone.xml"), "--report", path("gone.html")});
  EXPECT_EQ(outcome.exit_code, 1);
  const std::string cause = gone + " cannot be reached";
  for (const std::string& text :
       {outcome.output, text_of_file(path("gone.xml")), text_of_file(path("gone.html"))}) {
    EXPECT_NE(text.find(cause), std::string::npos) << text;
  }
  for (const char* wrong : {"ftp://127.0.0.1", "127.0.0.1:8080", "http://", "https://127.0.0.1"}) {
    const Outcome refused = run_fstop({"verify", "--server", wrong});
    EXPECT_EQ(refused.exit_code, 2) << wrong;
    EXPECT_NE(refused.output.find("--server"), std::string::npos) << refused.output;
  }
}

TEST_F(Verify, WhatTheServerRefusesIsRed) {
  TestServer::Options options;
  options.limits.samples_per_pixel = 64;
  TestServer server(std::move(options));
  const Outcome outcome =
      run_fstop({"verify", "--suite", path("suite.json"), "--server", url(server)});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.output.find("red: breathing: the server " + url(server) + " answers 422"),
            std::string::npos)
      << outcome.output;
  EXPECT_NE(outcome.output.find("#/quality/samples"), std::string::npos);
}

TEST_F(Verify, RedResultsAndBadSuitesHaveTheirExitCodes) {
  folder_.write("wrong.json", small_suite(R"(, {"name": "data sheet", "kind": "brightness",
      "camera": "a", "f_numbers": [2], "expected": [1.2], "expected_tolerance_percent": 0.1})"));
  const Outcome red =
      run_fstop({"verify", "--suite", path("wrong.json"), "--junit", path("a.xml")});
  EXPECT_EQ(red.exit_code, 1);
  EXPECT_NE(red.output.find("red: data sheet: value of radiance 1 at f/2"), std::string::npos)
      << red.output;
  EXPECT_NE(text_of_file(path("a.xml")).find("<failure message=\"red\">"), std::string::npos);
  folder_.write("bad.json", small_suite(R"(, {"name": "x", "kind": "sharp", "camera": "a"})"));
  const Outcome bad = run_fstop({"verify", "--suite", path("bad.json")});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_NE(bad.output.find("#/checks/2/kind"), std::string::npos) << bad.output;
  EXPECT_EQ(run_fstop({"verify", "--suite", path("none.json")}).exit_code, 2);
  EXPECT_NE(run_fstop({"verify", "--print-schema"}).output.find("draft-07"), std::string::npos);
  EXPECT_NE(run_fstop({"verify", "--print-suite"}).output.find("fstop-suite/1"), std::string::npos);
}

// A card that glows unevenly, out of focus: every pixel of it has noise.
std::string card_scene(double light) {
  return R"({"format": "fstop-scene/1", "materials": {"m": {"model": "unlit", "emission": [)" +
         std::to_string(light) + ", " + std::to_string(light) + ", " + std::to_string(0.5 * light) +
         R"(]}}, "objects": [)"
         R"({"type": "quad", "corner_m": [-0.06, -0.04, -3], "edge_u_m": [0.1, 0.03, 0],
             "edge_v_m": [0, 0.1, 0], "material": "m"},
            {"type": "sphere", "center_m": [0.05, 0, -1], "radius_m": 0.03, "material": "m"}]})";
}

// The same request, its scene's light 1 % more: what an engine that has changed would do.
TEST_F(Verify, BaselinesTellChangesFromNoise) {
  folder_.write("card.json", card_scene(0.8));
  const auto write_request = [&](int seed) {
    folder_.write("shot.json", R"({"scene": "./card.json", "image": {"width": 48, "height": 32},
        "camera": {"lens": {"f_number": 1.4}, "sensor_mm": [6, 4]},
        "quality": {"samples": 64, "method": "lens-sampling"}, "seed": )" +
                                   std::to_string(seed) + "}");
  };
  write_request(7);
  const std::vector<std::string> check = {"baseline", "check", path("shot.json"), "--baselines",
                                          path("kept")};
  const Outcome none = run_fstop(check);
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.output.find("has no baseline"), std::string::npos) << none.output;
  const auto accept = [&](const std::string& why) {
    return run_fstop({"baseline", "accept", path("shot.json"), "--baselines", path("kept"), "--who",
                      "a test", "--why", why});
  };
  const Outcome first = accept("the first");
  EXPECT_EQ(first.exit_code, 0) << first.output << first.errors;
  const Outcome same = run_fstop(check);
  EXPECT_EQ(same.exit_code, 0) << same.output;

  folder_.write("card.json", card_scene(0.808));
  std::vector<std::string> evident = check;
  evident.insert(evident.end(), {"--out", path("evidence")});
  const Outcome changed = run_fstop(evident);
  EXPECT_EQ(changed.exit_code, 1) << changed.output;
  EXPECT_NE(changed.output.find("red: shot"), std::string::npos) << changed.output;
  EXPECT_NE(changed.output.find("\n  picture: |t| up to 1"), std::string::npos) << changed.output;
  for (const char* ending : {".result.exr", ".baseline.exr", ".deviation.exr"}) {
    EXPECT_GT(text_of_file(path("evidence/shot") + ending).size(), 1000U) << ending;
  }
  EXPECT_EQ(accept("a brighter card").exit_code, 0);
  EXPECT_EQ(run_fstop(check).exit_code, 0);
  const std::string record = text_of_file(path("kept/shot.json"));
  EXPECT_NE(record.find("\"why\": \"a brighter card\""), std::string::npos) << record;
  EXPECT_NE(record.find("\"why\": \"the first\""), std::string::npos);
  EXPECT_NE(record.find("\"rmse\""), std::string::npos);

  write_request(8);
  const Outcome other = run_fstop(check);
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.output.find("another than the one that was accepted"), std::string::npos);
  EXPECT_EQ(
      run_fstop({"baseline", "accept", path("shot.json"), "--baselines", path("kept")}).exit_code,
      2);  // who and why are asked for
}

}  // namespace
}  // namespace fstop::test
