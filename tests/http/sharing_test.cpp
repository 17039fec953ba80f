// Who shares a render, who waits, who is refused, and when a render stops: counted with renders
// that go on until the test lets them go.
#include <chrono>
#include <cstdio>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/http/held_server.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

TEST(Sharing, EqualRequestsInFlightShareOneRender) {
  HeldServer server;
  std::vector<Client*> clients;
  for (int i = 0; i < 8; ++i) clients.push_back(&server.asking(1));
  ASSERT_TRUE(eventually([&] { return server.counts().joined == 7; }));
  EXPECT_TRUE(server.reaches(1, 0));
  server.renders.let_go();
  std::string body;
  for (Client* client : clients) {
    const auto answer = client->read();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 200);
    if (body.empty()) body = answer->body;
    EXPECT_TRUE(answer->body == body);
  }
  EXPECT_EQ(server.renders.begun(), 1);
}

TEST(Sharing, RenderStopsWhenTheLastClientHasGone) {
  HeldServer server;
  Client& first = server.asking(1);
  Client& second = server.asking(1);
  ASSERT_TRUE(eventually([&] { return server.counts().joined == 1; }));
  ASSERT_TRUE(eventually([&] { return server.renders.running() == 1; }));
  first.close();
  // The server has seen the end once it has logged the request; the render must still go on.
  ASSERT_TRUE(eventually(
      [&] { return server.server().log_text().find("\"status\":499") != std::string::npos; }));
  EXPECT_EQ(server.renders.stopped(), 0);
  const auto start = Clock::now();
  second.close();
  ASSERT_TRUE(eventually([&] { return server.renders.stopped() == 1; }));
  const auto took = std::chrono::duration<double, std::milli>(Clock::now() - start);
  std::printf("[          ] last client gone to render stopped: %.1f ms\n", took.count());
  EXPECT_TRUE(server.reaches(0, 0));
  EXPECT_EQ(server.counts().withdrawn, 1U);
}

TEST(Sharing, ResetsAndPipelinedBytesDoNotHideThatAClientHasGone) {
  HeldServer server;
  server.asking(1).reset();
  ASSERT_TRUE(eventually([&] { return server.counts().withdrawn == 1; }));
  Client& client = server.asking(2);
  ASSERT_TRUE(eventually([&] { return server.renders.running() == 1; }));
  client.send(request_text("GET", "/livez"));  // it waits before the end of the stream
  client.close();
  EXPECT_TRUE(eventually([&] { return server.counts().withdrawn == 2; }));
  EXPECT_TRUE(server.reaches(0, 0));
}

TEST(Sharing, ClientsThatVanishWhileQueuedNeverStartARender) {
  TestServer::Options options;
  options.limits.concurrent_renders = 1;
  HeldServer server(options);
  server.asking(1);
  ASSERT_TRUE(server.reaches(1, 0));
  Client& queued = server.asking(2);
  ASSERT_TRUE(server.reaches(1, 1));
  queued.close();
  ASSERT_TRUE(server.reaches(1, 0));
  server.renders.let_go();
  ASSERT_TRUE(server.reaches(0, 0));
  EXPECT_EQ(server.renders.begun(), 1);
}

TEST(Sharing, RequestAfterAWithdrawnOneGetsARenderOfItsOwn) {
  HeldServer server;
  Client& first = server.asking(1);
  ASSERT_TRUE(eventually([&] { return server.renders.running() == 1; }));
  first.close();
  ASSERT_TRUE(eventually([&] { return server.counts().withdrawn == 1; }));
  Client& again = server.asking(1);
  ASSERT_TRUE(eventually([&] { return server.counts().started == 2; }));
  server.renders.let_go();
  const auto answer = again.read();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
}

TEST(Queue, FullQueueIs503WithRetryAfterAndFreesAgain) {
  TestServer::Options options;
  options.limits.concurrent_renders = 2;
  options.limits.queued_renders = 3;
  HeldServer server(options);
  std::vector<Client*> admitted;
  for (int seed = 0; seed < 5; ++seed) admitted.push_back(&server.asking(seed));
  ASSERT_TRUE(server.reaches(2, 3));
  const auto refused = server.asking(99).read();
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->status, 503);
  EXPECT_NE(refused->body.find("/problems/queue-full"), std::string::npos) << refused->body;
  const std::string retry_after = refused->header("retry-after");
  ASSERT_FALSE(retry_after.empty());
  EXPECT_GE(std::stoi(retry_after), 1);
  EXPECT_LE(std::stoi(retry_after), 120);
  EXPECT_EQ(server.counts().refused, 1U);
  // A request that shares a render needs no room.
  Client& shared = server.asking(0);
  ASSERT_TRUE(eventually([&] { return server.counts().joined == 1; }));
  server.renders.let_go();
  admitted.push_back(&shared);
  for (Client* client : admitted) {
    const auto answer = client->read();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 200);
  }
  EXPECT_EQ(server.asking(99).read()->status, 200);
}

TEST(Queue, OtherCallsAreAnsweredWhileEveryPlaceIsTaken) {
  TestServer::Options options;
  options.limits.queued_renders = 1;
  HeldServer server(options);
  for (int seed = 0; seed < 3; ++seed) server.asking(seed);
  ASSERT_TRUE(server.reaches(2, 1));
  const auto port = server.server().port();
  EXPECT_EQ(ask(port, "GET", "/livez").status, 200);
  EXPECT_EQ(ask(port, "GET", "/readyz").status, 200);
  EXPECT_EQ(ask(port, "GET", "/v1/scenes").status, 200);
  EXPECT_EQ(ask(port, "GET", "/").status, 200);
}

TEST(Queue, RendersThatFailAreProblemsAndTheServerGoesOn) {
  TestServer::Options options;
  options.simulate = [](const SimulationSpec& spec, const RayScene&,
                        const RunControl&) -> Photograph {
    if (spec.seed == 1) throw Error(ErrorCode::no_valid_method, "nothing covers this");
    if (spec.seed == 2) throw std::runtime_error("secret of the house");
    throw std::bad_alloc();
  };
  TestServer server(options);
  const auto post = [&](int seed) {
    return ask(server.port(), "POST", "/v1/renders", {}, tiny_request(seed));
  };
  EXPECT_EQ(post(1).status, 422);
  const Answer internal = post(2);
  EXPECT_EQ(internal.status, 500);
  EXPECT_EQ(internal.body.find("secret"), std::string::npos);
  EXPECT_TRUE(eventually(
      [&] { return server.log_text().find("secret of the house") != std::string::npos; }));
  EXPECT_EQ(post(3).status, 503);
  EXPECT_EQ(ask(server.port(), "GET", "/readyz").status, 200);
}

// What is made against the clock is not kept, so that nobody asks for it as EXR later.
TEST(Queue, DepthAndBlurAreMadeForWhatIsKeptOrAskedForAsExr) {
  std::vector<std::vector<Output>> made;
  TestServer::Options options;
  options.simulate = [&](const SimulationSpec& spec, const RayScene&, const RunControl&) {
    made.push_back(spec.outputs);
    return Photograph{.color = Image(spec.width, spec.height, 3)};
  };
  TestServer server(options);
  const auto post = [&](const std::string& quality, const std::string& accepted) {
    const std::string request = R"({"scene": "tiny", "camera": {"lens": {"f_number": 2}},
        "image": {"width": 48, "height": 32}, "quality": )" +
                                quality + "}";
    EXPECT_EQ(ask(server.port(), "POST", "/v1/renders", {{"Accept", accepted}}, request).status,
              200);
    return made.back();
  };
  const std::vector<Output> with_layers = {Output::color, Output::depth, Output::coc};
  const std::string in_time = R"({"max_time_ms": 50})";
  EXPECT_EQ(post("{}", "image/jpeg"), with_layers);
  EXPECT_EQ(post(in_time, "image/jpeg"), std::vector{Output::color});
  EXPECT_EQ(post(in_time, "image/x-exr"), with_layers);
}

TEST(Queue, RendersPastTheirTimeAreStoppedWith504) {
  TestServer::Options options;
  options.limits.render_time = 50ms;
  options.simulate = [](const SimulationSpec&, const RayScene&, const RunControl& run) {
    for (double done = 0.0;; done += 1e-6) {
      run.progress(done);
      throw_if_stopped(run);
      std::this_thread::sleep_for(1ms);
    }
    return Photograph{};
  };
  TestServer server(options);
  const Answer answer = ask(server.port(), "POST", "/v1/renders", {}, tiny_request());
  EXPECT_EQ(answer.status, 504) << answer.body;
  EXPECT_NE(answer.body.find("/problems/deadline"), std::string::npos) << answer.body;
}

TEST(Draining, AdmittedRendersAreAnsweredAndNewOnesRefused) {
  TestServer::Options options;
  options.limits.concurrent_renders = 1;
  HeldServer server(options);
  std::vector<Client*> admitted;
  for (int seed = 0; seed < 3; ++seed) admitted.push_back(&server.asking(seed));
  ASSERT_TRUE(server.reaches(1, 2));
  // Three that have begun to ask when the stop comes.
  const auto port = server.server().port();
  Client probe(port);
  probe.send("GET /readyz HTTP/1.1\r\n");
  Client late(port);
  const std::string request = request_text("POST", "/v1/renders", {}, tiny_request(9));
  late.send(request.substr(0, 40));
  Client idle(port);
  EXPECT_EQ(idle.ask("GET", "/livez").status, 200);
  server.server().server().stop();
  EXPECT_TRUE(idle.is_closed_by_server());
  EXPECT_TRUE(eventually([&] {
    try {
      return Client(port).is_closed_by_server();
    } catch (const std::runtime_error&) {
      return true;  // nothing listens
    }
  }));
  probe.send("Host: localhost\r\n\r\n");
  const auto not_ready = probe.read();
  ASSERT_TRUE(not_ready);
  EXPECT_EQ(not_ready->status, 503);
  EXPECT_NE(not_ready->body.find("draining"), std::string::npos);
  EXPECT_EQ(not_ready->header("connection"), "close");
  late.send(request.substr(40));
  const auto refused = late.read();
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->status, 503);
  EXPECT_NE(refused->body.find("draining"), std::string::npos);
  EXPECT_FALSE(server.server().ends_within(50ms)) << "renders are still under way";
  server.renders.let_go();
  for (Client* client : admitted) {
    const auto answer = client->read();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 200);
  }
  EXPECT_TRUE(server.server().ends_within(10s));
}

TEST(Draining, RendersPastTheDrainDeadlineAreCancelledAndTheirClientsTold) {
  TestServer::Options options;
  options.limits.concurrent_renders = 1;
  options.limits.drain_deadline = 100ms;
  HeldServer server(options);
  Client& running = server.asking(1);
  Client& queued = server.asking(2);
  ASSERT_TRUE(server.reaches(1, 1));
  server.server().server().stop();
  for (Client* client : {&running, &queued}) {
    const auto answer = client->read();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 503);
  }
  EXPECT_TRUE(server.server().ends_within(10s));
  EXPECT_EQ(server.renders.stopped(), 1);
}

}  // namespace
}  // namespace fstop::test
