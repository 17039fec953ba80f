// Workers as processes, a server that keeps their files, and a NATS server: kills at any instant.
#include <atomic>
#include <chrono>
#include <csignal>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "api/cell_json.h"
#include "api/limits.h"
#include "api/render_id.h"
#include "api/scene_store.h"
#include "core/parallel.h"
#include "server/cell_records.h"
#include "server/cell_work.h"
#include "server/content_folder.h"
#include "server/http_file_store.h"
#include "server/nats_cell_maker.h"
#include "server/scene_orders.h"
#include "tests/http/http_client.h"
#include "tests/http/program.h"
#include "tests/http/queue_fixture.h"

namespace fstop::test {
namespace {

using namespace std::chrono_literals;
using server::NatsQueue;
using Bucket = server::NatsQueue::Bucket;

const std::string kSweep(64, '7');

// Takes seconds on any machine: certainly under way when the test acts.
std::string long_request() {
  std::string request = tiny_request(1);
  return request.replace(request.find("\"samples\": 16"), 13, "\"samples\": 4096");
}

class QueuePrograms : public Queue {
 protected:
  QueuePrograms() : port_(free_port()) {
    write_scenes(folder_);
    start_server();
  }

  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string results() const { return "http://127.0.0.1:" + std::to_string(port_); }

  void start_server(const std::vector<std::string>& more = {}) {
    server_.reset();
    std::vector<std::string> arguments = {"--data-dir", path("data"), "--scenes-dir",
                                          path("scenes")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    server_ = std::make_unique<ServerProcess>(folder_.path(), arguments, port_);
  }

  // `scenes`: the folder of its own ones.
  std::unique_ptr<BackgroundProcess> started_worker(const std::vector<std::string>& more = {},
                                                    const std::string& scenes = "scenes") {
    std::vector<std::string> arguments = {"worker",     "--queue",   nats_.url(),
                                          "--results",  results(),   "--scenes-dir",
                                          path(scenes), "--threads", "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return std::make_unique<BackgroundProcess>(BackgroundProcess::fstop(
        arguments, folder_.path() / ("worker-" + std::to_string(++workers_) + ".log")));
  }

  static bool has_said(const BackgroundProcess& worker, const std::string& text) {
    return eventually([&] { return worker.error_text().find(text) != std::string::npos; });
  }

  static std::string order(std::uint32_t index, const std::string& request) {
    return api::to_json(api::CellOrder{.engine = std::string(api::engine_version()),
                                       .sweep = kSweep,
                                       .index = index,
                                       .request = request});
  }

  std::uint16_t port_;
  std::unique_ptr<ServerProcess> server_ = {};
  int workers_ = 0;
};

using Outcomes = std::map<std::uint32_t, server::CellOutcome>;

// The same cells with the threads of this process.
Outcomes made_here(const std::vector<server::SweepCell>& cells, const std::string& scenes_folder,
                   server::ContentStore& store) {
  const api::Limits limits;
  const api::SceneStore scene_store({scenes_folder}, limits);
  server::CellScenes scenes(scene_store, limits);
  WorkerPool pool(0);
  server::LocalCellMaker maker({.limits = limits, .scenes = scenes, .workers = pool}, store);
  Outcomes outcomes;
  maker.make(cells,
             {.done =
                  [&](server::CellOutcome outcome) {
                    const std::uint32_t index = outcome.index;
                    outcomes.emplace(index, std::move(outcome));
                  },
              .waiting = [](std::string_view) {}},
             {});
  return outcomes;
}

// A scene with a file, in the place of the scene "tiny" in a request.
void write_scene_with_mesh(const TemporaryFolder& folder) {
  folder.write("scenes/mesh/scene.json", R"({
    "format": "fstop-scene/1",
    "materials": {"m": {"model": "unlit", "emission": [0.9, 0.5, 0.1]}},
    "objects": [{"type": "mesh", "file": "parts/triangle.ply", "material": "m"}]
  })");
  folder.write("scenes/mesh/parts/triangle.ply",
               "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
               "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
               "end_header\n-1 -1 -3\n1 -1 -3\n0 1 -3\n3 0 1 2\n");
}

TEST_F(QueuePrograms, KillsOfAWorkerAndTheServerLoseNothingAndRepeatNothing) {
  constexpr std::uint32_t kCells = 40;
  std::vector<server::SweepCell> cells;
  for (std::uint32_t i = 0; i < kCells; ++i)
    cells.push_back({kSweep, i, tiny_request(static_cast<int>(i))});
  cells[7].request = R"({"scene": "none"})";  // it cannot be made, here or there
  write_scene_with_mesh(folder_);
  for (std::uint32_t i = 30; i < kCells; ++i)
    cells[i].request.replace(cells[i].request.find("tiny"), 4, "mesh");
  const auto queue = connected(1s);
  auto first = started_worker();
  auto second = started_worker({}, "none");  // it must fetch every scene
  server::HttpFileStore store(results(), "");
  const api::Limits limits;
  const api::SceneStore scenes({path("scenes")}, limits);
  server::SceneOrders orders(scenes, limits, store);
  server::NatsCellMaker maker(
      {.queue = *queue,
       .store = store,
       .log = log_,
       .is_kept = [&](const server::CellFile& file) { return store.has(file); },
       .scene_of = [&](const server::SweepCell& cell) { return orders.of(cell); }});
  Outcomes outcomes;
  std::vector<std::string> waits;
  maker.make(cells,
             {.done =
                  [&](server::CellOutcome outcome) {
                    const std::uint32_t index = outcome.index;
                    EXPECT_TRUE(outcomes.emplace(index, std::move(outcome)).second)
                        << "cell " << index << " came twice";
                    if (outcomes.size() == 10) {
                      first->signal(SIGKILL);
                      EXPECT_EQ(first->wait(), 128 + SIGKILL);
                      first = started_worker();
                    } else if (outcomes.size() == 20) {
                      server_->signal(SIGKILL);
                      EXPECT_EQ(server_->wait(), 128 + SIGKILL);
                      start_server();
                    }
                  },
              .waiting = [&](std::string_view what) { waits.emplace_back(what); }},
             {});
  ASSERT_EQ(outcomes.size(), kCells);
  server::ContentFolder folder(folder_.path() / "here");
  const Outcomes here = made_here(cells, path("scenes"), folder);
  ASSERT_EQ(here.size(), kCells);
  EXPECT_NE(here.at(7).problem, "");
  for (const auto& [index, outcome] : here) {
    EXPECT_EQ(server::outcome_text(outcomes.at(index)), server::outcome_text(outcome));
    for (const server::CellFile& file : outcome.files)
      EXPECT_TRUE(store.get(file.sha256) == folder.get(file.sha256)) << index << " " << file.name;
  }
}

std::string begun_sweep_of_seeds(std::uint16_t port, int cells) {
  const std::string recipe = R"({"base": )" + tiny_request(0) +
                             R"(, "axes": [{"member": "/seed", "range": {"from": 1, "to": )" +
                             std::to_string(cells) + R"(, "step": 1}}]})";
  return begun_sweep(port, recipe);
}

TEST_F(QueuePrograms, ASweepOfAServerOutlivesKillsOfAWorkerAndTheServer) {
  constexpr int kCells = 40;
  const std::vector<std::string> with_queue = {"--queue", nats_.url(), "--ack-wait-s", "1"};
  server_->signal(SIGTERM);
  EXPECT_EQ(server_->wait(), 0);
  start_server(with_queue);
  const std::string sweep = begun_sweep_of_seeds(port_, kCells);
  auto first = started_worker();
  auto second = started_worker();
  const auto has_done = [](const BackgroundProcess& worker, int cells) {
    return eventually([&] {
      const std::string text = worker.error_text();
      int done = 0;
      for (std::size_t at = text.find("cell_done"); at != std::string::npos;
           at = text.find("cell_done", at + 1))
        ++done;
      return done >= cells;
    });
  };
  ASSERT_TRUE(has_done(*first, 3)) << first->error_text();
  first->signal(SIGKILL);
  first->wait();
  first = started_worker();
  ASSERT_TRUE(has_done(*second, 6)) << second->error_text();
  server_->signal(SIGKILL);
  EXPECT_EQ(server_->wait(), 128 + SIGKILL);
  start_server(with_queue);
  const std::string manifest = manifest_of(port_, sweep);
  ASSERT_FALSE(manifest.empty()) << server_->log_text() << first->error_text();
  EXPECT_NE(manifest.find("\"failures\":[]"), std::string::npos) << manifest.substr(0, 500);
  // The same sweep by one server alone.
  const TemporaryFolder alone;
  const ServerProcess server(alone.path(), {"--data-dir", (alone.path() / "data").string(),
                                            "--scenes-dir", path("scenes")});
  EXPECT_EQ(begun_sweep_of_seeds(server.port(), kCells), sweep);
  EXPECT_TRUE(manifest_of(server.port(), sweep) == manifest);
}

// A cell that ends its worker: here the test does, each time that it has begun.
TEST_F(QueuePrograms, ACellThatEndsItsWorkersIsRecordedAfterBoundedAttempts) {
  const auto queue = connected(1s);
  const std::string key = server::cell_key(kSweep, 0);
  queue->publish(key, order(0, long_request()), "a");
  for (int attempt = 1; attempt <= 2; ++attempt) {
    auto worker = started_worker({"--attempts", "2"});
    ASSERT_TRUE(has_said(*worker, "\"attempt\":" + std::to_string(attempt)))
        << worker->error_text();
    worker->signal(SIGKILL);
    worker->wait();
    EXPECT_FALSE(queue->get(Bucket::outcomes, key));
  }
  auto worker = started_worker({"--attempts", "2"});
  ASSERT_TRUE(eventually([&] { return queue->get(Bucket::outcomes, key).has_value(); }))
      << worker->error_text();
  const auto outcome = server::outcome_of(queue->get(Bucket::outcomes, key)->text);
  EXPECT_NE(outcome.problem.find("/problems/cell-abandoned"), std::string::npos);
  EXPECT_EQ(worker->error_text().find("cell_begun"), std::string::npos) << "it was not tried again";
  EXPECT_TRUE(eventually([&] { return queue->depth().in_hand == 0; }));
}

TEST_F(QueuePrograms, TermLetsTheCellInHandBeFinished) {
  const auto queue = connected(1s);
  const std::string key = server::cell_key(kSweep, 0);
  queue->publish(key, order(0, long_request()), "a");
  queue->publish(server::cell_key(kSweep, 1), order(1, tiny_request(1)), "a");
  auto worker = started_worker({"--drain-s", "600"});
  ASSERT_TRUE(has_said(*worker, "cell_begun")) << worker->error_text();
  worker->signal(SIGTERM);
  EXPECT_EQ(worker->wait(), 0) << worker->error_text();
  const auto value = queue->get(Bucket::outcomes, key);
  ASSERT_TRUE(value);
  EXPECT_EQ(server::outcome_of(value->text).problem, "");
  EXPECT_FALSE(queue->get(Bucket::outcomes, server::cell_key(kSweep, 1)));
  EXPECT_EQ(queue->depth().waiting, 1U) << "the next one stays in the queue";
}

TEST_F(QueuePrograms, TermWithoutTimeGivesTheCellBackUncounted) {
  const auto queue = connected(600s);  // it would not come again by itself
  const std::string key = server::cell_key(kSweep, 0);
  queue->publish(key, order(0, long_request()), "a");
  auto worker = started_worker({"--drain-s", "0"});
  ASSERT_TRUE(has_said(*worker, "cell_begun")) << worker->error_text();
  worker->signal(SIGTERM);
  EXPECT_EQ(worker->wait(), 0) << worker->error_text();
  EXPECT_FALSE(queue->get(Bucket::outcomes, key));
  EXPECT_EQ(queue->get(Bucket::attempts, key)->text, "0");
  auto cell = queue->next(10s);
  ASSERT_TRUE(cell);
  EXPECT_EQ(cell->key(), key);
}

TEST_F(QueuePrograms, AWorkerSaysWhatItWaitsForAndGoesOn) {
  const auto queue = connected(1s);
  server_->signal(SIGKILL);
  server_->wait();
  auto worker = started_worker();
  const std::string key = server::cell_key(kSweep, 0);
  queue->publish(key, order(0, tiny_request(1)), "a");
  const std::string store = "\"for\":\"the results store at " + results();
  ASSERT_TRUE(has_said(*worker, store)) << worker->error_text();
  // Whoever waits for the cell can know.
  EXPECT_TRUE(eventually([&] { return !queue->entries(Bucket::waiting, 10).empty(); }));
  nats_.kill();
  ASSERT_TRUE(has_said(*worker, "queue_disconnected")) << worker->error_text();
  start_server();
  ASSERT_TRUE(has_said(*worker, "\"for\":\"the queue at " + nats_.url())) << worker->error_text();
  nats_.start();
  EXPECT_TRUE(eventually([&] {
    try {
      return queue->get(Bucket::outcomes, key).has_value();
    } catch (const server::QueueUnreachable&) {
      return false;
    }
  })) << worker->error_text();
  ASSERT_TRUE(has_said(*worker, "cell_done")) << worker->error_text();
  EXPECT_EQ(worker->error_text().find("\"attempt\":2"), std::string::npos)
      << "the cell was made once";
}

TEST_F(QueuePrograms, WrongOptionsOfAWorkerAreTold) {
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{"--queue", "http://a", "--results", "http://a"},
        {"--queue", "nats://", "--results", "http://a"},
        {"--queue", "nats://127.0.0.1:99999", "--results", "http://a"},
        {"--queue", "nats://127.0.0.1:0", "--results", "http://a"},
        {"--queue", "nats://127.0.0.1:1/a", "--results", "http://a"},
        {"--queue", "nats://127.0.0.1:1,", "--results", "http://a"},
        {"--queue", "nats://127.0.0.1:1", "--results", "https://a"},
        {"--queue", "nats://127.0.0.1:1", "--results", "http://a", "--threads", "-1"},
        {"--queue", "nats://127.0.0.1:1", "--results", "http://a", "--attempts", "0"},
        {"--queue", "nats://127.0.0.1:1", "--results", "http://a", "--drain-s", "nan"}}) {
    std::vector<std::string> arguments = {"worker"};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    const Outcome outcome = run_fstop(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.output << outcome.errors;
    EXPECT_NE(outcome.output.find("\"detail\":\"--"), std::string::npos) << outcome.output;
  }
  EXPECT_EQ(run_fstop({"worker"}).exit_code, 2);
  EXPECT_EQ(run_fstop({"serve", "--port", "0", "--queue", nats_.url()}).exit_code, 2)
      << "files need a data directory";
}

}  // namespace
}  // namespace fstop::test
