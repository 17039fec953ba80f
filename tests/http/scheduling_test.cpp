// Whose turn it is, what is refused before it costs anything, and what small renders need not wait
// for.
#include <cmath>
#include <condition_variable>
#include <list>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "server/cost_model.h"
#include "server/http_message.h"
#include "server/measured_costs.h"
#include "server/render_queue.h"
#include "tests/http/held_server.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

using server::RenderQueue;

// Notes the order in which renders begin.
class Order {
 public:
  RenderQueue::Work noting(const std::string& name) {
    return [this, name](const RenderQueue::Turn& turn) -> RenderQueue::Result {
      {
        std::unique_lock lock(mutex_);
        begun_.push_back(name + (turn.is_express ? "!" : ""));
        while (!is_open_ && !turn.stop.stop_requested())
          changed_.wait_for(lock, std::chrono::milliseconds(1));
      }
      return nullptr;
    };
  }
  void let_go() {
    const std::lock_guard lock(mutex_);
    is_open_ = true;
    changed_.notify_all();
  }
  std::vector<std::string> begun() {
    const std::lock_guard lock(mutex_);
    return begun_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_open_ = false;
  std::vector<std::string> begun_ = {};
};

TEST(Turns, ClientsTakeThemWhateverEachHasWaiting) {
  Order order;
  RenderQueue queue({.slots = 1, .most_queued = 100, .most_queued_per_client = 100});
  std::list<RenderQueue::Ticket> tickets;
  const auto submit = [&](const std::string& client, const std::string& name) {
    tickets.push_back(queue.submit({.id = name, .client = client, .work = order.noting(name)}));
  };
  submit("first", "running");
  ASSERT_TRUE(eventually([&] { return order.begun().size() == 1; }));
  for (const char* name : {"a1", "a2", "a3", "a4"}) submit("a", name);
  submit("b", "b1");
  submit("c", "c1");
  submit("c", "c2");
  std::vector<int> places;
  for (auto ticket = std::next(tickets.begin()); ticket != tickets.end(); ++ticket)
    places.push_back(ticket->place());
  EXPECT_EQ(places, (std::vector<int>{1, 4, 6, 7, 2, 3, 5}));
  order.let_go();
  ASSERT_TRUE(eventually([&] { return order.begun().size() == 8; }));
  EXPECT_EQ(order.begun(),
            (std::vector<std::string>{"running", "a1", "b1", "c1", "a2", "c2", "a3", "a4"}));
}

TEST(Turns, SmallWorkGoesBesideTheLarge) {
  Order order;
  RenderQueue queue(
      {.slots = 1, .express_slots = 1, .most_queued = 300, .most_queued_per_client = 300});
  std::list<RenderQueue::Ticket> tickets;
  for (int i = 0; i < 200; ++i) {
    const std::string name = "elephant " + std::to_string(i);
    tickets.push_back(queue.submit({.id = name, .client = "a", .work = order.noting(name)}));
  }
  ASSERT_TRUE(eventually([&] { return order.begun().size() == 1; }));
  tickets.push_back(queue.submit(
      {.id = "mouse", .client = "a", .is_small = true, .work = order.noting("mouse")}));
  ASSERT_TRUE(eventually([&] { return order.begun().size() == 2; })) << "199 others wait before it";
  EXPECT_EQ(order.begun().back(), "mouse!");
  EXPECT_EQ(queue.counts().queued, 199);
  queue.close();
  queue.cancel_all();
}

TEST(Turns, SmallWorkKeepsToTheExpressSlotWhileThatIsFree) {
  Order order;
  order.let_go();
  RenderQueue queue(
      {.slots = 2, .express_slots = 1, .most_queued = 9, .most_queued_per_client = 9});
  for (std::size_t i = 0; i < 50; ++i) {
    const std::string name = std::to_string(i);
    const RenderQueue::Ticket ticket =
        queue.submit({.id = name, .client = "a", .is_small = true, .work = order.noting(name)});
    ASSERT_TRUE(eventually([&] { return queue.counts().running == 0 && ticket.has_ended(); }));
    EXPECT_EQ(order.begun().at(i), name + "!");
  }
}

TEST(Turns, SmallWorkGoesElsewhereWhereTheExpressSlotIsTaken) {
  Order order;
  RenderQueue queue(
      {.slots = 1, .express_slots = 1, .most_queued = 9, .most_queued_per_client = 9});
  std::list<RenderQueue::Ticket> tickets;
  for (const char* name : {"first", "second"}) {
    tickets.push_back(
        queue.submit({.id = name, .client = "a", .is_small = true, .work = order.noting(name)}));
  }
  EXPECT_TRUE(eventually([&] { return order.begun().size() == 2; }));
  order.let_go();
}

TEST(Turns, OneClientsLineIsBoundedAndOthersStillHaveRoom) {
  Order order;
  RenderQueue queue({.slots = 1, .most_queued = 4, .most_queued_per_client = 2});
  std::list<RenderQueue::Ticket> tickets;
  const auto status = [&](const std::string& client, const std::string& id) {
    try {
      tickets.push_back(queue.submit({.id = id, .client = client, .work = order.noting(id)}));
      return 0U;
    } catch (const server::Refusal& refusal) {
      EXPECT_EQ(refusal.slug(), "queue-full");
      EXPECT_EQ(refusal.headers().front().first, "Retry-After");
      return static_cast<unsigned>(refusal.status());
    }
  };
  for (const char* id : {"1", "2", "3"}) EXPECT_EQ(status("a", id), 0U);
  EXPECT_EQ(status("a", "4"), 429U);
  EXPECT_EQ(status("a", "2"), 0U) << "a share in a render needs no room";
  EXPECT_EQ(status("b", "5"), 0U);
  EXPECT_EQ(status("b", "6"), 0U);
  EXPECT_EQ(status("c", "7"), 503U);
  order.let_go();
}

TEST(Turns, MemoryIsReserved) {
  Order order;
  RenderQueue queue(
      {.slots = 3, .most_queued = 9, .most_queued_per_client = 9, .memory_bytes = 100.0});
  std::list<RenderQueue::Ticket> tickets;
  const auto submit = [&](const std::string& name, double bytes) {
    tickets.push_back(queue.submit(
        {.id = name, .client = "a", .memory_bytes = bytes, .work = order.noting(name)}));
  };
  submit("first", 60.0);
  submit("second", 60.0);
  submit("third", 10.0);
  ASSERT_TRUE(eventually([&] { return !order.begun().empty(); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(order.begun(), (std::vector<std::string>{"first"})) << "what has no room is not passed";
  order.let_go();
  ASSERT_TRUE(eventually([&] { return order.begun().size() == 3; }));
  submit("alone", 1000.0);
  EXPECT_TRUE(eventually([&] { return order.begun().size() == 4; })) << "alone it may have more";
}

// Retry-After follows what waits: a queue of long renders sends clients away for longer.
TEST(Turns, RetryAfterFollowsThePredictedBacklog) {
  Order order;
  const auto seconds = [&](double cost_s) {
    RenderQueue queue({.slots = 1, .most_queued = 4, .most_queued_per_client = 4});
    std::list<RenderQueue::Ticket> tickets;
    for (int i = 0; i < 5; ++i) {
      const std::string id = std::to_string(i);
      tickets.push_back(
          queue.submit({.id = id, .client = "a", .cost_s = cost_s, .work = order.noting(id)}));
    }
    EXPECT_NEAR(queue.counts().backlog_s, 5.0 * cost_s, 1e-9);
    try {
      queue.submit({.id = "x", .client = "b", .work = order.noting("x")});
      return 0;
    } catch (const server::Refusal& refusal) {
      return std::stoi(refusal.headers().front().second);
    }
  };
  EXPECT_EQ(seconds(0.01), 1);
  EXPECT_EQ(seconds(4.0), 10);
  EXPECT_EQ(seconds(1000.0), 120);
}

SimulationSpec spec_of(int width, double max_error) {
  SimulationSpec spec =
      api::parse_render_request(tiny_request(), api::Limits{}, api::SceneNames::stored_only).spec;
  spec.quality.samples.reset();
  spec.width = width;
  spec.height = width;
  spec.quality.max_error = max_error;
  return spec;
}

std::string bundled_hash(const std::string& name) {
  const api::Limits limits;
  const api::SceneStore store({FSTOP_SOURCE_DIR "/core/scenes"}, limits);
  const std::string request = R"({"scene": ")" + name + R"(", "camera": {"lens": {}}})";
  return store.load(api::parse_render_request(request, limits, api::SceneNames::stored_only)).hash;
}

// A scene that differs from the bundled ones in everything but the laws: twenty renders of one
// request, and then others.
TEST(Costs, AreLearntByScene) {
  server::CostModel model(2);
  const SimulationSpec spec = spec_of(100, 0.01);
  const double before = model.predict(spec, "scene").cpu_s;
  EXPECT_LT(before, 0.5);
  // 20 samples a pixel of 10 microseconds each: 2 s.
  for (int i = 0; i < 20; ++i)
    model.learn(spec, "scene", {.method = "lens-sampling", .samples_mean = 20.0, .cpu_ms = 2000.0});
  const api::CostPrediction learnt = model.predict(spec, "scene");
  EXPECT_NEAR(learnt.cpu_s, 2.0, 0.1);
  EXPECT_NEAR(learnt.wall_s, 0.5 * learnt.cpu_s, 1e-9);
  EXPECT_NEAR(learnt.samples, 20.0 * 100 * 100, 0.1 * 20.0 * 100 * 100);
  const double large = model.predict(spec_of(200, 0.01), "scene").cpu_s;
  EXPECT_GT(large, 4.0) << "four times the pixels, of which each may take fewer samples";
  EXPECT_LT(large, 8.0);
  const double fine = model.predict(spec_of(100, 0.005), "scene").cpu_s;
  EXPECT_GT(fine, 2.0 * 2.0) << "half the error takes 2^(1/0.6) times the samples, or 4 times";
  EXPECT_LT(fine, 2.0 * 4.0);
  SimulationSpec forced = spec;
  forced.quality.samples = 5;
  const double few = model.predict(forced, "scene").cpu_s;
  EXPECT_GT(few, 0.5 / 2.0) << "a quarter of the samples, within the factor that is promised";
  EXPECT_LT(few, 1.2);
}

// Renders whose costs follow a law of their own, with noise: c pixels^-0.3 max_error^-1.6 samples,
// each pixel a + b samples.
TEST(Costs, ArePredictedWithinAFactorOfTwo) {
  server::CostModel model(2);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int within = 0;
  constexpr int kRenders = 200;
  constexpr int kFirst = 40;
  for (int i = 0; i < kRenders; ++i) {
    const int width = static_cast<int>(64.0 * std::pow(20.0, unit(random)));
    SimulationSpec spec = spec_of(width, 0.003 * std::pow(33.0, unit(random)));
    const double pixels = double(width) * width;
    double samples = std::max(
        4.0, 1000.0 * std::pow(pixels, -0.3) * std::pow(spec.quality.max_error / 0.01, -1.6));
    if (unit(random) < 0.25) {
      samples = std::floor(1.0 + 30.0 * unit(random));
      spec.quality.samples = static_cast<int>(samples);
    }
    const double noise = std::exp(0.2 * (unit(random) - 0.5));
    const double cpu_ms = 1e-6 * pixels * (5000.0 + 2000.0 * samples) * noise;
    const double ratio = 1e3 * model.predict(spec, "scene").cpu_s / cpu_ms;
    within += i >= kFirst && ratio > 0.5 && ratio < 2.0 ? 1 : 0;
    model.learn(spec, "scene",
                {.method = "lens-sampling", .samples_mean = samples, .cpu_ms = cpu_ms});
  }
  EXPECT_GE(within, (kRenders - kFirst) * 95 / 100);
}

// A processor is known by its first renders of what was measured elsewhere: here one of a third of
// the speed, which 20 renders of one bundled scene tell of another. (The mean of n is weighed
// n/(n + 2): 3^(20/22) = 2.7.)
TEST(Costs, TellTheProcessor) {
  SimulationSpec spec = spec_of(300, 0.01);
  spec.camera.optics = LensSpec{.lens = {.focal_length = Length::si(0.05), .f_number = 4.0},
                                .focus_distance = Length::si(2.0)};
  const std::string known = bundled_hash("still-life");
  const std::string other = bundled_hash("spheres");
  const auto is_measured = [&](const std::string& scene) {
    const std::uint64_t asked = server::cost_features(spec, scene).scene;
    return std::ranges::any_of(server::measured_costs(),
                               [&](const auto& row) { return row.asked.scene == asked; });
  };
  ASSERT_TRUE(is_measured(known) && is_measured(other)) << "server/measured_costs.cpp is stale";
  const server::CostModel fresh(1);
  server::CostModel model(1);
  for (int i = 0; i < 20; ++i) {
    spec.width = 90 + 30 * i;
    const api::CostPrediction told = fresh.predict(spec, known);
    model.learn(spec, known,
                {.method = "lens-sampling",
                 .samples_mean = told.samples / (spec.width * spec.height),
                 .cpu_ms = 3e3 * told.cpu_s});
  }
  const double ratio = model.predict(spec, other).cpu_s / fresh.predict(spec, other).cpu_s;
  EXPECT_GT(ratio, 2.0);
  EXPECT_LT(ratio, 3.5);
}

TEST(Costs, AreAtMostWhatARenderMayTake) {
  const SimulationSpec spec = spec_of(900, 1e-6);
  EXPECT_GT(server::CostModel(2).predict(spec, "scene").wall_s, 10.0);
  EXPECT_EQ(server::CostModel(2, 10.0).predict(spec, "scene").wall_s, 10.0);
  SimulationSpec forced = spec;
  forced.quality.samples = 1'000'000;
  EXPECT_GT(server::CostModel(2, 10.0).predict(forced, "scene").wall_s, 10.0) << "refused";
}

// Of an error that asks for more, most_samples is what a render takes.
TEST(Costs, EndAtTheMostSamples) {
  SimulationSpec spec = spec_of(900, 1e-6);
  const api::CostPrediction all = server::CostModel(2).predict(spec, "scene");
  EXPECT_NEAR(all.samples, 2e9, 1.0);
  spec.quality.most_samples /= 4;
  const api::CostPrediction quarter = server::CostModel(2).predict(spec, "scene");
  EXPECT_NEAR(quarter.samples, 5e8, 1.0);
  EXPECT_NEAR(quarter.cpu_s, all.cpu_s / 4.0, 1e-9 * all.cpu_s);
}

// A scene whose glass forks is not taken for small before one render of it was made: small ones
// do not wait for it.
TEST(Costs, UnknownScenesThatForkAreNotSmall) {
  HeldRenders renders;
  TestServer::Options options;
  options.simulate = renders.simulate();
  options.limits.concurrent_renders = 1;
  options.limits.express_renders = 1;
  TestServer server(std::move(options));
  const auto begin = [&](const std::string& request) {
    EXPECT_EQ(
        ask(server.port(), "POST", "/v1/renders", {{"Prefer", "respond-async"}}, request).status,
        202);
  };
  const auto reaches = [&](int running, int queued) {
    return eventually([&] {
      const server::RenderQueue::Counts counts = server.server().render_counts();
      return counts.running == running && counts.queued == queued;
    });
  };
  for (int seed = 1; seed <= 2; ++seed) {
    begin(R"({"scene": {"format": "fstop-scene/1", "materials": {"glass": {"model": "phong",
        "reflection": 0.9, "transmission": 0.9, "ior": 1.5}}, "objects": [{"type": "sphere",
        "center_m": [0, 0, -2], "radius_m": 0.2, "material": "glass"}]}, "camera": {"lens": {}},
        "image": {"width": 48, "height": 32}, "quality": {"samples": 1}, "seed": )" +
          std::to_string(seed) + "}");
  }
  ASSERT_TRUE(reaches(1, 1)) << "the second waits for the slot of large ones";
  begin(tiny_request(1));
  EXPECT_TRUE(reaches(2, 1));
  renders.let_go();
}

TEST(Costs, OtherScenesKeepTheirOwn) {
  server::CostModel model(1);
  const SimulationSpec spec = spec_of(100, 0.01);
  for (int i = 0; i < 20; ++i) {
    model.learn(spec, "cheap", {.method = "pinhole", .samples_mean = 4.0, .cpu_ms = 20.0});
    model.learn(spec, "dear", {.method = "pinhole", .samples_mean = 400.0, .cpu_ms = 20'000.0});
  }
  EXPECT_NEAR(model.predict(spec, "cheap").cpu_s, 0.02, 0.002);
  EXPECT_NEAR(model.predict(spec, "dear").cpu_s, 20.0, 2.0);
}

// What the planner gives to waves costs by the pixel, whatever the error.
TEST(Costs, RememberWhichRequestsAreWaves) {
  server::CostModel model(1);
  for (int i = 0; i < 10; ++i) {
    model.learn(spec_of(100, 0.003), "scene",
                {.method = "wave", .samples_mean = 8.0, .cpu_ms = 400.0});
    model.learn(spec_of(100, 0.1), "scene",
                {.method = "pinhole", .samples_mean = 4.0, .cpu_ms = 5.0});
  }
  EXPECT_NEAR(model.predict(spec_of(100, 0.004), "scene").cpu_s, 0.4, 0.08);
  EXPECT_NEAR(model.predict(spec_of(100, 0.08), "scene").cpu_s, 0.005, 0.003);
}

TEST(Admission, WhatCostsTooMuchIsRefusedWithThePrediction) {
  TestServer::Options options;
  options.limits.render_time = std::chrono::milliseconds(1000);
  HeldServer server(options);
  const auto port = server.server().port();
  std::string request = tiny_request();
  request.replace(request.find("\"samples\": 16"), 13, "\"samples\": 65536");
  request.replace(request.find("\"width\": 48, \"height\": 32"), 25,
                  "\"width\": 198, \"height\": 132 ");
  const Answer refused = ask(port, "POST", "/v1/renders", {}, request);
  EXPECT_EQ(refused.status, 422) << refused.body;
  EXPECT_NE(refused.body.find("/problems/over-budget"), std::string::npos) << refused.body;
  EXPECT_NE(refused.body.find("\"prediction\":{\"samples\":1712848896.0,\"cpu_s\":"),
            std::string::npos)
      << refused.body;
  EXPECT_EQ(server.renders.begun(), 0);
  EXPECT_EQ(server.counts().started, 0U);
}

TEST(Admission, WhatTakesTooMuchMemoryIsRefusedBeforeItIsTaken) {
  TestServer::Options options;
  options.limits.render_bytes = std::size_t{64} << 20;
  HeldServer server(options);
  const auto port = server.server().port();
  const Answer refused = ask(port, "POST", "/v1/renders", {}, R"({"scene": "tiny",
      "camera": {"lens": {"f_number": 2}}, "image": {"width": 1500, "height": 1000}})");
  EXPECT_EQ(refused.status, 422) << refused.body;
  EXPECT_NE(refused.body.find("\"memory_bytes\":"), std::string::npos) << refused.body;
  EXPECT_EQ(server.counts().started, 0U);
}

TEST(Admission, LimitsAreTold) {
  TestServer server;
  const Answer answer = ask(server.port(), "GET", "/v1/limits");
  EXPECT_EQ(answer.status, 200);
  EXPECT_NE(answer.body.find("\"queued_renders_per_client\":32"), std::string::npos);
}

}  // namespace
}  // namespace fstop::test
