// Renders that go on as jobs: promotion, progress, events, withdrawal, deadlines, idempotency.
#include <chrono>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/encode/image_codec.h"
#include "core/error.h"
#include "tests/http/contract.h"
#include "tests/http/held_server.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

class Jobs : public testing::Test {
 protected:
  std::uint16_t port() { return server_.server().port(); }
  Answer get(const std::string& target, const Headers& headers = {}) {
    return ask(port(), "GET", target, headers);
  }
  Answer post(int seed, const Headers& headers, const std::string& members = {}) {
    return ask(port(), "POST", "/v1/renders", headers, tiny_request(seed, members));
  }
  bool becomes(const std::string& job, const std::string& state) {
    return eventually(
        [&] { return has(get("/v1/jobs/" + job).body, "\"state\":\"" + state + "\""); });
  }
  HeldServer server_;
};

TEST_F(Jobs, RespondAsyncGivesAJobAtOnceAndItsPictureWhenDone) {
  const Answer accepted = post(1, {{"Prefer", "respond-async"}});
  ASSERT_EQ(accepted.status, 202) << accepted.body;
  EXPECT_EQ(accepted.header("preference-applied"), "respond-async");
  EXPECT_FALSE(accepted.header("retry-after").empty());
  const std::string location = accepted.header("location");
  ASSERT_EQ(location.find("/v1/jobs/"), 0U);
  const std::string job = location.substr(9);
  EXPECT_TRUE(becomes(job, "running"));
  EXPECT_EQ(get(location + "/image").status, 404) << "not done";
  server_.renders.let_go();
  ASSERT_TRUE(becomes(job, "done"));
  const std::string id = accepted.header("fstop-render-id");
  const Answer done = get(location);
  EXPECT_TRUE(has(done.body, "\"render\":\"/v1/renders/" + id + "\"")) << done.body;
  EXPECT_TRUE(has(done.body, "\"fraction\":1.0")) << done.body;
  EXPECT_EQ(get("/v1/renders/" + id).status, 200);
  const Answer picture = get(location + "/image");
  EXPECT_EQ(picture.status, 200);
  EXPECT_EQ(picture.body, get("/v1/renders/" + id + "/image").body);
  // What is there needs no job, whatever was preferred.
  EXPECT_EQ(post(1, {{"Prefer", "respond-async"}}).status, 200);
  EXPECT_EQ(server_.renders.begun(), 1);
}

TEST_F(Jobs, SynchronousRendersAreNotPromotedBeforeTheirTime) {
  Client& client = server_.asking(1, {{"Prefer", "wait=600"}});
  ASSERT_TRUE(server_.reaches(1, 0));
  EXPECT_FALSE(client.read(false, 300ms));
  server_.renders.let_go();
  const auto answer = client.read();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
}

TEST(JobPromotion, RendersPastTheirPatienceGoOnAsJobs) {
  TestServer::Options options;
  options.limits.synchronous_wait = 50ms;
  options.limits.longest_wait = 1000ms;
  HeldServer server(options);
  const auto promoted = server.asking(1).read();
  ASSERT_TRUE(promoted);
  EXPECT_EQ(promoted->status, 202);
  EXPECT_TRUE(promoted->header("preference-applied").empty());
  const auto at_once = server.asking(1, {{"Prefer", "wait=0"}}).read();
  ASSERT_TRUE(at_once);
  EXPECT_EQ(at_once->status, 202);
  EXPECT_EQ(at_once->header("preference-applied"), "wait=0");
  const auto cut = server.asking(1, {{"Prefer", "handling=strict, wait=9999; x"}}).read();
  ASSERT_TRUE(cut);
  EXPECT_EQ(cut->header("preference-applied"), "wait=1") << "no longer than the server's bound";
  EXPECT_EQ(server.counts().joined, 2U) << "three jobs, one render";
  EXPECT_EQ(server.renders.stopped(), 0) << "a promoted client may leave";
}

TEST_F(Jobs, ProgressTellsPlaceFractionAndErrorAndShowsAPreview) {
  const std::string running = server_.job(1);
  ASSERT_TRUE(becomes(running, "running"));
  const std::string other = server_.job(2);
  ASSERT_TRUE(server_.reaches(2, 0));
  ASSERT_TRUE(eventually([&] { return has(get("/v1/jobs/" + running).body, "preview"); }));
  const Answer shown = get("/v1/jobs/" + running);
  EXPECT_TRUE(has(shown.body, "\"fraction\":0.25")) << shown.body;
  EXPECT_TRUE(has(shown.body, "\"upper_95\":0.125")) << shown.body;
  EXPECT_TRUE(has(shown.body, "\"remaining_ms\":")) << shown.body;
  EXPECT_TRUE(has(shown.body, "/preview?number=1\"")) << shown.body;
  const Answer preview = get("/v1/jobs/" + running + "/preview?number=1");
  ASSERT_EQ(preview.status, 200) << preview.body;
  EXPECT_EQ(preview.header("content-type"), "image/png");
  const Picture picture = decode(std::as_bytes(std::span(preview.body)));
  EXPECT_EQ(picture.layers.front().image.width(), 48);
  EXPECT_NEAR(picture.layers.front().image.at(5, 5)[1], 188.0 / 255.0, 1e-3) << "sRGB of 0.5";
  EXPECT_EQ(
      get("/v1/jobs/" + running + "/preview", {{"Accept", "image/webp"}}).header("content-type"),
      "image/webp");
  EXPECT_EQ(
      get("/v1/jobs/" + running + "/preview", {{"If-None-Match", preview.header("etag")}}).status,
      304);
  EXPECT_EQ(get("/v1/jobs/" + running + "/preview?size=1").status, 400);
  server_.renders.let_go();
  ASSERT_TRUE(becomes(running, "done"));
  const Answer late = get("/v1/jobs/" + running + "/preview?number=1", {{"Accept", "image/webp"}});
  EXPECT_EQ(late.status, 303) << "who was told of a preview comes too late for it";
  EXPECT_EQ(get(late.header("location")).header("content-type"), "image/webp");
}

TEST(JobPlaces, QueuedJobsTellTheirPlace) {
  TestServer::Options options;
  options.limits.concurrent_renders = 1;
  HeldServer server(options);
  server.job(1);
  ASSERT_TRUE(server.reaches(1, 0));
  const std::string second = server.job(2);
  const std::string third = server.job(3);
  const auto state = [&](const std::string& job) {
    return ask(server.server().port(), "GET", "/v1/jobs/" + job).body;
  };
  EXPECT_TRUE(has(state(second), "\"state\":\"queued\"")) << state(second);
  EXPECT_TRUE(has(state(second), "\"queue_place\":1")) << state(second);
  EXPECT_TRUE(has(state(third), "\"queue_place\":2")) << state(third);
}

TEST_F(Jobs, EventsTellTheNewestStateAndTheEndAndAreResumable) {
  const std::string job = server_.job(1);
  ASSERT_TRUE(becomes(job, "running"));
  ASSERT_TRUE(eventually([&] { return has(get("/v1/jobs/" + job).body, "preview"); }));
  Client reader(port());
  reader.send(request_text("GET", "/v1/jobs/" + job + "/events", {{"Connection", "close"}}));
  std::this_thread::sleep_for(50ms);
  server_.renders.let_go();
  const auto stream = reader.read_to_end();
  ASSERT_TRUE(stream);
  EXPECT_EQ(stream->status, 200);
  EXPECT_EQ(stream->header("content-type"), "text/event-stream");
  EXPECT_TRUE(has(stream->body, "event: progress\ndata: {\"job\":\"" + job)) << stream->body;
  EXPECT_TRUE(has(stream->body, "\"upper_95\":0.125")) << stream->body;
  const std::size_t last = stream->body.rfind("id: ");
  const std::string end = stream->body.substr(last);
  EXPECT_TRUE(has(end, "event: done\ndata: {")) << end;
  const std::string number = end.substr(4, end.find('\n') - 4);
  const std::string events = "/v1/jobs/" + job + "/events";
  EXPECT_EQ(get(events, {{"Last-Event-ID", number}}).status, 204) << "all is known";
  const std::string life = number.substr(number.find('-'));
  const std::string earlier = std::to_string(std::stoi(number) - 1) + life;
  const Answer resumed = get(events, {{"Last-Event-ID", earlier}});
  EXPECT_EQ(resumed.body, end) << "what is missing, and only that";
  EXPECT_EQ(get(events, {{"Last-Event-ID", "none of ours"}}).body, end);
  EXPECT_EQ(get(events, {{"Last-Event-ID", "999999" + life}}).status, 204);
  EXPECT_EQ(get(events, {{"Last-Event-ID", "999999-00000000"}}).body, end) << "of another life";
  const Answer head = ask(port(), "HEAD", events);
  EXPECT_EQ(head.status, 200);
  EXPECT_TRUE(head.body.empty());
}

TEST_F(Jobs, DeleteStopsTheRenderOnlyWhenNobodyElseWaits) {
  const std::string first = server_.job(1);
  const std::string second = server_.job(1);
  ASSERT_NE(first, second);
  ASSERT_TRUE(becomes(first, "running"));
  EXPECT_EQ(ask(port(), "DELETE", "/v1/jobs/" + first).status, 204);
  EXPECT_TRUE(becomes(first, "cancelled"));
  EXPECT_EQ(get("/v1/jobs/" + second).status, 200);
  EXPECT_EQ(server_.renders.stopped(), 0);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(ask(port(), "DELETE", "/v1/jobs/" + second).status, 204);
  EXPECT_TRUE(eventually([&] { return server_.renders.stopped() == 1; }));
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
  std::printf("[          ] DELETE to render stopped: %.1f ms\n", took.count());
  EXPECT_TRUE(server_.reaches(0, 0));
  EXPECT_EQ(ask(port(), "DELETE", "/v1/jobs/" + second).status, 204) << "forgets it";
  EXPECT_EQ(get("/v1/jobs/" + second).status, 404);
  EXPECT_EQ(ask(port(), "DELETE", "/v1/jobs/" + second).status, 404);
}

TEST_F(Jobs, StreamsOfAWithdrawnJobEnd) {
  const std::string job = server_.job(1);
  ASSERT_TRUE(becomes(job, "running"));
  Client reader(port());
  reader.send(request_text("GET", "/v1/jobs/" + job + "/events", {{"Connection", "close"}}));
  ask(port(), "DELETE", "/v1/jobs/" + job);
  const auto stream = reader.read_to_end();
  ASSERT_TRUE(stream);
  EXPECT_TRUE(has(stream->body, "event: cancelled\n")) << stream->body;
}

TEST_F(Jobs, JobsAreNotToBeGuessedAndUnknownOnesAreNotFound) {
  EXPECT_NE(server_.job(1), server_.job(1));
  for (const char* path : {"/v1/jobs/1", "/v1/jobs/00000000000000000000000000000000", "/v1/jobs/..",
                           "/v1/jobs/x/events", "/v1/jobs/x/preview", "/v1/jobs/x/image"}) {
    EXPECT_EQ(get(path).status, 404) << path;
  }
  EXPECT_EQ(get("/v1/jobs").status, 404);
  EXPECT_EQ(ask(port(), "POST", "/v1/jobs/x").status, 405);
}

TEST(JobFailures, FailedJobsTellTheirProblem) {
  TestServer::Options options;
  options.simulate = [](const SimulationSpec&, const RayScene&, const RunControl&) -> Photograph {
    throw Error(ErrorCode::no_valid_method, "nothing covers this");
  };
  TestServer server(options);
  const Answer accepted =
      ask(server.port(), "POST", "/v1/renders", {{"Prefer", "respond-async"}}, tiny_request());
  ASSERT_EQ(accepted.status, 202);
  const std::string location = accepted.header("location");
  ASSERT_TRUE(eventually(
      [&] { return has(ask(server.port(), "GET", location).body, "\"state\":\"failed\""); }));
  EXPECT_TRUE(has(ask(server.port(), "GET", location).body, "/problems/no-valid-method"));
  EXPECT_TRUE(has(ask(server.port(), "GET", location + "/events").body, "event: failed\n"));
  EXPECT_EQ(ask(server.port(), "GET", location + "/image").status, 404);
}

TEST(Deadlines, WorkWhoseTimeRanOutIsDroppedBeforeItBegins) {
  TestServer::Options options;
  options.limits.concurrent_renders = 1;
  HeldServer server(options);
  server.asking(1);
  ASSERT_TRUE(server.reaches(1, 0));
  const auto late = server.asking(2, {{"Fstop-Deadline-Ms", "50"}}).read();
  ASSERT_TRUE(late);
  EXPECT_EQ(late->status, 504) << late->body;
  EXPECT_TRUE(has(late->body, "/problems/deadline"));
  const std::string job = server.job(3, {{"Fstop-Deadline-Ms", "1000"}});
  const auto state = [&] { return ask(server.server().port(), "GET", "/v1/jobs/" + job).body; };
  EXPECT_TRUE(eventually([&] { return has(state(), "\"state\":\"failed\""); }));
  EXPECT_TRUE(has(state(), "/problems/deadline")) << state();
  EXPECT_TRUE(server.reaches(1, 0));
  server.renders.let_go();
  EXPECT_TRUE(server.reaches(0, 0));
  EXPECT_EQ(server.renders.begun(), 1);
  for (const char* value : {"", "0", "-1", "1.5", "soon", "99999999999"}) {
    const auto refused = server.asking(4, {{"Fstop-Deadline-Ms", value}}).read();
    ASSERT_TRUE(refused);
    EXPECT_EQ(refused->status, 400) << value;
  }
}

TEST_F(Jobs, AKeyGivesTheSameJobAndRefusesAnotherRequest) {
  const Headers headers = {{"Prefer", "respond-async"}, {"Idempotency-Key", "a1"}};
  const Answer first = post(1, headers);
  ASSERT_EQ(first.status, 202);
  EXPECT_EQ(post(1, headers).header("location"), first.header("location"));
  const Answer other = post(2, headers);
  EXPECT_EQ(other.status, 422);
  EXPECT_TRUE(has(other.body, "/problems/idempotency-key-reused")) << other.body;
  EXPECT_NE(post(1, {{"Prefer", "respond-async"}, {"Idempotency-Key", "a2"}}).header("location"),
            first.header("location"));
  EXPECT_TRUE(eventually([&] { return server_.counts().started == 1U; }));
  for (const char* value : {"", "with blank", "\xc3\xa9"})
    EXPECT_EQ(post(1, {{"Idempotency-Key", value}}).status, 400) << value;
  EXPECT_EQ(post(1, {{"Idempotency-Key", std::string(256, 'a')}}).status, 400);
  server_.renders.let_go();
  ASSERT_TRUE(becomes(first.header("location").substr(9), "done"));
  EXPECT_EQ(post(1, headers).status, 200);
  EXPECT_EQ(server_.renders.begun(), 1);
}

TEST(JobRetention, TimeBoundResultsStayWithTheirJob) {
  TestServer server;
  const std::string request = R"({"scene": "tiny", "camera": {"lens": {"f_number": 2}},
      "image": {"width": 48, "height": 32}, "quality": {"max_error": 0.05, "max_time_ms": 1000}})";
  const Answer accepted =
      ask(server.port(), "POST", "/v1/renders", {{"Prefer", "respond-async"}}, request);
  ASSERT_EQ(accepted.status, 202) << accepted.body;
  const std::string location = accepted.header("location");
  ASSERT_TRUE(eventually(
      [&] { return has(ask(server.port(), "GET", location).body, "\"state\":\"done\""); }));
  EXPECT_FALSE(has(ask(server.port(), "GET", location).body, "/v1/renders/"));
  EXPECT_EQ(ask(server.port(), "GET", location + "/image").status, 200);
  EXPECT_EQ(ask(server.port(), "GET", "/v1/renders/" + accepted.header("fstop-render-id")).status,
            404);
}

TEST(JobRetention, EndedJobsAreForgottenAndTheNumberIsBounded) {
  TestServer::Options options;
  options.limits.job_retention = 100ms;
  options.limits.jobs = 3;
  HeldServer server(options);
  const std::string job = server.job(1);
  server.job(1);
  server.job(1);
  const auto full = server.asking(1, {{"Prefer", "respond-async"}}).read();
  ASSERT_TRUE(full);
  EXPECT_EQ(full->status, 503);
  server.renders.let_go();
  EXPECT_TRUE(eventually(
      [&] { return ask(server.server().port(), "GET", "/v1/jobs/" + job).status == 404; }));
}

TEST(Draining, AcceptedJobsAreFinishedBeforeTheServerEnds) {
  TemporaryFolder results;
  TestServer::Options options;
  options.result_folder = results.path();
  HeldServer server(options);
  server.job(1);
  ASSERT_TRUE(server.reaches(1, 0));
  server.server().server().stop();
  EXPECT_FALSE(server.server().ends_within(100ms)) << "a job is under way";
  server.renders.let_go();
  EXPECT_TRUE(server.server().ends_within(10s));
  EXPECT_EQ(results.files(), 1);
}

// Two lives of a server whose renders wait, with what it keeps between them. The first one's jobs
// are stopped with it.
class JobsOfTwoLives : public testing::Test {
 protected:
  TestServer::Options options() const {
    TestServer::Options options;
    options.result_folder = results_.path();
    options.job_folder = jobs_.path();
    options.limits.concurrent_renders = 1;
    options.limits.drain_deadline = 1ms;
    return options;
  }
  static void end(HeldServer& server) {
    server.server().server().stop();
    ASSERT_TRUE(server.server().ends_within(10s));
  }
  static json told(HeldServer& server, const std::string& job) {
    return json::parse(ask(server.server().port(), "GET", "/v1/jobs/" + job).body);
  }

  TemporaryFolder results_, jobs_;
};

TEST_F(JobsOfTwoLives, WhatWasAcceptedIsMadeByTheNextServer) {
  std::vector<std::string> jobs;
  {
    HeldServer first(options());
    jobs = {first.job(1), first.job(2, {{"Idempotency-Key", "two"}}), first.job(3)};
    ASSERT_TRUE(first.reaches(1, 2));
    ASSERT_EQ(ask(first.server().port(), "DELETE", "/v1/jobs/" + jobs[2]).status, 204);
    end(first);
  }
  // Clocks are coarse and go backwards: the order is not theirs to tell.
  const auto written = std::filesystem::last_write_time(jobs_.path() / jobs[0]);
  std::filesystem::last_write_time(jobs_.path() / jobs[1], written - 1s);
  HeldServer second(options());
  ASSERT_TRUE(second.reaches(1, 1));
  EXPECT_EQ(ask(second.server().port(), "GET", "/v1/jobs/" + jobs[2]).status, 404) << "withdrawn";
  EXPECT_EQ(told(second, jobs[0]).at("state"), "running");
  EXPECT_EQ(told(second, jobs[1]).at("state"), "queued");
  EXPECT_EQ(second.job(2, {{"Idempotency-Key", "two"}}), jobs[1]);
  second.renders.let_go();
  for (int i = 0; i < 2; ++i) {
    const std::string& job = jobs[static_cast<std::size_t>(i)];
    ASSERT_TRUE(eventually([&] { return told(second, job).at("state") == "done"; }));
    EXPECT_EQ(ask(second.server().port(), "GET", "/v1/jobs/" + job + "/image").status, 200);
  }
}

TEST_F(JobsOfTwoLives, FinishedOnesAreStillKnown) {
  std::string job;
  {
    HeldServer first(options());
    job = first.job(1);
    first.renders.let_go();
    ASSERT_TRUE(eventually([&] { return told(first, job).at("state") == "done"; }));
    end(first);
  }
  HeldServer second(options());
  ASSERT_TRUE(eventually([&] { return told(second, job).at("state") == "done"; }));
  EXPECT_EQ(ask(second.server().port(), "GET", "/v1/jobs/" + job + "/image").status, 200);
  EXPECT_EQ(second.renders.begun(), 0);
}

// What their note says no longer holds, or nothing can be read from it.
TEST_F(JobsOfTwoLives, ChangedAndDamagedNotesAreTold) {
  std::string job;
  {
    HeldServer first(options());
    job = first.job(1);
    ASSERT_TRUE(first.reaches(1, 0));
    end(first);
  }
  json note = json::parse(text_of_file(jobs_.path() / job));
  note["render"] = std::string(64, 'a');
  jobs_.write(job, note.dump());
  jobs_.write("abad", "{");
  jobs_.write("0000.part", "{");
  HeldServer second(options());
  ASSERT_TRUE(eventually([&] { return told(second, job).at("state") == "failed"; }));
  EXPECT_NE(told(second, job).dump().find("scene-changed"), std::string::npos);
  EXPECT_EQ(ask(second.server().port(), "GET", "/v1/jobs/abad").status, 404);
  EXPECT_NE(second.server().log_text().find("job_note_left"), std::string::npos);
}

TEST_F(JobsOfTwoLives, OldJobsLeaveNoNote) {
  TestServer::Options limited = options();
  limited.limits.job_retention = 1ms;
  HeldServer server(limited);
  const std::string job = server.job(1);
  EXPECT_EQ(jobs_.files(), 1);
  server.renders.let_go();
  EXPECT_TRUE(eventually(
      [&] { return ask(server.server().port(), "GET", "/v1/jobs/" + job).status == 404; }));
  EXPECT_EQ(jobs_.files(), 0);
}

}  // namespace
}  // namespace fstop::test
