// POST /v1/sweeps: jobs, progress, manifests and files, sharing, withdrawal, restarts, refusals.
#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/render_id.h"
#include "tests/http/contract.h"
#include "tests/http/http_client.h"
#include "tests/http/program.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using nlohmann::json;

std::string sweep_request(int seeds, int samples = 16, const std::string& members = {}) {
  return R"({"base": {"scene": "tiny", "camera": {"lens": {"f_number": 2}},
      "image": {"width": 48, "height": 32}, "quality": {"samples": )" +
         std::to_string(samples) +
         R"(}}, "axes": [{"member": "/seed", "range": {"from": 1, "to": )" + std::to_string(seeds) +
         R"(, "step": 1}}])" + members + "}";
}

class Sweeps : public testing::Test {
 protected:
  TestServer::Options options() const {
    TestServer::Options options;
    options.data_folder = data_.path();
    return options;
  }
  static Answer ask_well(std::uint16_t port, const std::string& method, const std::string& target,
                         const std::string& body = {}, const Headers& headers = {}) {
    Answer answer = ask(port, method, target, headers, body);
    EXPECT_EQ(contract_objection(method, target, answer), "") << target << answer.body;
    return answer;
  }
  static bool job_is(std::uint16_t port, const std::string& location, const std::string& state) {
    return eventually(
        [&] {
          return ask_well(port, "GET", location).body.find("\"state\":\"" + state) !=
                 std::string::npos;
        },
        180s);
  }
  TemporaryFolder data_;
};

TEST_F(Sweeps, AJobMakesManifestAndFiles) {
  TestServer server(options());
  const Answer accepted = ask_well(server.port(), "POST", "/v1/sweeps", sweep_request(5));
  ASSERT_EQ(accepted.status, 202) << accepted.body;
  const std::string location = accepted.header("location");
  ASSERT_TRUE(job_is(server.port(), location, "done"));
  const json job = json::parse(ask_well(server.port(), "GET", location).body);
  EXPECT_EQ(job.at("fraction"), 1.0);
  EXPECT_EQ(ask_well(server.port(), "GET", location + "/image").status, 404);
  const std::string self = job.at("links").at("sweep");
  const json sweep = json::parse(ask_well(server.port(), "GET", self).body);
  EXPECT_EQ(sweep.at("state"), "done");
  EXPECT_EQ(sweep.at("cells"), 5);
  EXPECT_EQ(sweep.at("done"), 5);
  EXPECT_EQ(sweep.at("failed"), 0);
  const Answer manifest = ask_well(server.port(), "GET", job.at("links").at("manifest"));
  ASSERT_EQ(manifest.status, 200) << manifest.body;
  const json told = json::parse(manifest.body);
  ASSERT_EQ(told.at("images").size(), 5U);
  for (const json& file : told.at("files")) {
    const std::string hash = file.at("sha256");
    const Answer answer = ask_well(server.port(), "GET", self + "/files/" + hash);
    ASSERT_EQ(answer.status, 200);
    EXPECT_EQ(api::sha256_hex(answer.body), hash);
    EXPECT_EQ(answer.header("content-type"), "image/png");
  }
  EXPECT_EQ(ask_well(server.port(), "GET", self + "/manifest", {},
                     {{"If-None-Match", manifest.header("etag")}})
                .status,
            304);
  // The very pictures that single requests give.
  const Answer single =
      ask(server.port(), "POST", "/v1/renders", {}, told.at("images")[2].at("request").dump());
  EXPECT_EQ(api::sha256_hex(single.body), told.at("files")[2].at("sha256"));
  const Answer again = ask_well(server.port(), "POST", "/v1/sweeps", sweep_request(5));
  EXPECT_EQ(again.status, 200) << "it is done";
  EXPECT_EQ(again.header("location"), self);
}

// The command line makes the same files and the same manifest.
TEST_F(Sweeps, AreThoseOfTheCommandLine) {
  TestServer server(options());
  const Answer accepted = ask_well(server.port(), "POST", "/v1/sweeps", sweep_request(3));
  ASSERT_TRUE(job_is(server.port(), accepted.header("location"), "done"));
  const std::string id = json::parse(accepted.body).at("sweep");
  data_.write("recipe.json", sweep_request(3));
  const std::string out = (data_.path() / "out").string();
  const Outcome outcome = run_fstop({"sweep", (data_.path() / "recipe.json").string(), "--out", out,
                                     "--scenes", (server.folder().path() / "scenes").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output << outcome.errors;
  EXPECT_EQ(text_of_file(data_.path() / "out/manifest.json"),
            ask_well(server.port(), "GET", "/v1/sweeps/" + id + "/manifest").body);
}

TEST_F(Sweeps, DryRunsTellTheCost) {
  TestServer server(options());
  const Answer answer =
      ask_well(server.port(), "POST", "/v1/sweeps", sweep_request(5, 16, R"(, "dry_run": true)"));
  ASSERT_EQ(answer.status, 200) << answer.body;
  const json cost = json::parse(answer.body);
  EXPECT_EQ(cost.at("cells"), 5);
  EXPECT_EQ(cost.at("predicted").at("samples"), 5.0 * 48 * 32 * 16);
  EXPECT_EQ(
      ask_well(server.port(), "GET", "/v1/sweeps/" + cost.at("sweep").get<std::string>()).status,
      404)
      << "nothing was begun";
}

class HeldSweeps : public Sweeps {
 protected:
  void SetUp() override {
    TestServer::Options held = options();
    held.simulate = renders_.simulate();
    server_ = std::make_unique<TestServer>(held);
  }
  void TearDown() override { renders_.let_go(); }
  std::uint16_t port() const { return server_->port(); }
  HeldRenders renders_;
  std::unique_ptr<TestServer> server_;
};

TEST_F(HeldSweeps, EqualSweepsShareAndDeleteStopsTheLast) {
  const Answer first = ask_well(port(), "POST", "/v1/sweeps", sweep_request(9));
  const Answer second = ask_well(port(), "POST", "/v1/sweeps", sweep_request(9));
  ASSERT_EQ(first.status, 202) << first.body;
  ASSERT_EQ(second.status, 202);
  EXPECT_NE(first.header("location"), second.header("location"));
  ASSERT_TRUE(job_is(port(), first.header("location"), "running"));
  ASSERT_TRUE(eventually([&] { return renders_.running() == 2; })) << "as many as there are slots";
  EXPECT_EQ(server_->server().sweep_counts().running, 1);
  EXPECT_EQ(ask_well(port(), "DELETE", first.header("location")).status, 204);
  EXPECT_TRUE(job_is(port(), first.header("location"), "cancelled"));
  EXPECT_EQ(renders_.stopped(), 0) << "the other one wants it";
  EXPECT_EQ(ask_well(port(), "DELETE", second.header("location")).status, 204);
  EXPECT_TRUE(eventually([&] { return renders_.stopped() == 2; }));
  EXPECT_TRUE(eventually([&] { return server_->server().sweep_counts().running == 0; }));
  const std::string self = "/v1/sweeps/" + json::parse(first.body).at("sweep").get<std::string>();
  EXPECT_TRUE(eventually([&] {
    return ask_well(port(), "GET", self).body.find("\"state\":\"stopped\"") != std::string::npos;
  }));
  EXPECT_EQ(ask_well(port(), "GET", self + "/manifest").status, 404);
}

TEST_F(HeldSweeps, EventsTellOfItsProgress) {
  const Answer accepted = ask_well(port(), "POST", "/v1/sweeps", sweep_request(4));
  ASSERT_TRUE(job_is(port(), accepted.header("location"), "running"));
  Client reader(port());
  reader.send(
      request_text("GET", accepted.header("location") + "/events", {{"Connection", "close"}}));
  renders_.let_go();
  const auto stream = reader.read_to_end();
  ASSERT_TRUE(stream);
  EXPECT_NE(stream->body.find("event: done\ndata: {"), std::string::npos) << stream->body;
  EXPECT_NE(stream->body.find("/manifest"), std::string::npos) << stream->body;
}

TEST_F(HeldSweeps, SingleRendersTakeTurnsWithCells) {
  const Answer accepted = ask_well(port(), "POST", "/v1/sweeps", sweep_request(50));
  ASSERT_TRUE(eventually([&] { return renders_.running() == 2; }));
  Client client(port());
  client.send(request_text("POST", "/v1/renders", {}, tiny_request(999)));
  renders_.let_go();
  const auto answer = client.read();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
  ASSERT_TRUE(job_is(port(), accepted.header("location"), "done"));
}

TEST_F(Sweeps, KilledServersGoOnUnasked) {
  const auto serve = [&] {
    fs::remove(data_.path() / "port");  // of the one before
    return std::make_unique<ServerProcess>(
        data_.path(), std::vector<std::string>{"--data-dir", (data_.path() / "data").string()});
  };
  std::string request = sweep_request(24, 256);
  request.replace(request.find("\"tiny\""), 6, "\"spheres\"");
  auto server = serve();
  const Answer accepted = ask_well(server->port(), "POST", "/v1/sweeps", request);
  ASSERT_EQ(accepted.status, 202) << accepted.body;
  const std::string location = accepted.header("location");
  const std::string self =
      "/v1/sweeps/" + json::parse(accepted.body).at("sweep").get<std::string>();
  const auto done = [&] {
    return json::parse(ask_well(server->port(), "GET", self).body).at("done").get<int>();
  };
  ASSERT_TRUE(eventually([&] { return done() >= 2; }, 180s));
  server->signal(SIGKILL);
  server->wait();
  server = serve();
  ASSERT_TRUE(eventually([&] { return ask(server->port(), "GET", location).status == 200; }))
      << "under its old name";
  ASSERT_TRUE(eventually([&] { return done() >= 6; }, 180s));
  server->signal(SIGTERM);
  EXPECT_EQ(server->wait(), 0) << "it does not wait for the whole sweep";
  server = serve();
  ASSERT_TRUE(job_is(server->port(), location, "done"))
      << ask(server->port(), "GET", location).body;
  EXPECT_EQ(done(), 24);
  const std::string manifest = ask_well(server->port(), "GET", self + "/manifest").body;
  data_.write("recipe.json", request);
  ASSERT_EQ(run_fstop({"sweep", (data_.path() / "recipe.json").string(), "--out",
                       (data_.path() / "out").string()})
                .exit_code,
            0);
  EXPECT_EQ(text_of_file(data_.path() / "out/manifest.json"), manifest);
}

TEST_F(Sweeps, RefusesBadRequests) {
  TestServer::Options small = options();
  small.limits.sweep_cells = 100;
  small.limits.sweep_time = 1000ms;
  TestServer server(small);
  struct Case {
    std::string body;
    int status;
    std::string part;
  };
  for (const Case& wrong : std::initializer_list<Case>{
           {"{", 400, "json-invalid"},
           {"{}", 422, "#/base"},
           {sweep_request(101), 422, "at most 100 are allowed"},
           {sweep_request(3, 0), 422, "#/base/quality/samples"},
           {R"({"base": {"scene": "gone", "camera": {"lens": {}}}})", 422, "#/base/scene"},
           {R"({"base": {"scene": "a/b.json", "camera": {"lens": {}}}})", 422, "#/base/scene"},
           {R"({"base": {"scene": "broken-mesh", "camera": {"lens": {}}}})", 422, "cut.ply"},
           {sweep_request(50, 65536), 422, "over-budget"},
           {sweep_request(50, 65536), 422, "\"prediction\":{"}}) {
    const Answer answer = ask_well(server.port(), "POST", "/v1/sweeps", wrong.body);
    EXPECT_EQ(answer.status, wrong.status) << answer.body;
    EXPECT_NE(answer.body.find(wrong.part), std::string::npos) << answer.body;
  }
  const std::string none(64, '0');
  for (const std::string& target : std::vector<std::string>{
           "/v1/sweeps/" + none, "/v1/sweeps/none", "/v1/sweeps/" + none + "/manifest",
           "/v1/sweeps/" + none + "/files/" + none, "/v1/sweeps/..%2F/manifest"}) {
    EXPECT_EQ(ask(server.port(), "GET", target).status, 404) << target;
  }
}

TEST(SweepsWithoutData, AreRefused) {
  TestServer server;
  const Answer answer = ask(server.port(), "POST", "/v1/sweeps", {}, sweep_request(2));
  EXPECT_EQ(answer.status, 503) << answer.body;
  EXPECT_NE(answer.body.find("--data-dir"), std::string::npos);
  const std::string dry = sweep_request(2, 16, R"(, "dry_run": true)");
  EXPECT_EQ(ask(server.port(), "POST", "/v1/sweeps", {}, dry).status, 200);
}

}  // namespace
}  // namespace fstop::test
