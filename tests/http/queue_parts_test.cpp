// Cells whose pictures are traced by many workers of a queue: in this process, and as programs.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <new>
#include <set>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "api/limits.h"
#include "api/render_id.h"
#include "api/scene_store.h"
#include "core/parallel.h"
#include "server/cell_records.h"
#include "server/cell_work.h"
#include "server/content_folder.h"
#include "server/cost_model.h"
#include "server/large_cells.h"
#include "server/nats_cell_maker.h"
#include "server/queue_worker.h"
#include "tests/http/http_client.h"
#include "tests/http/program.h"
#include "tests/http/queue_fixture.h"

namespace fstop::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using server::NatsQueue;
using Bucket = server::NatsQueue::Bucket;

const std::string kSweep(64, '9');
// Beyond any picture's cost: less than a nanosecond.
constexpr double kAnyCost = 1e-12;

// `quality`: members of the request's quality.
std::string request(const std::string& quality, int seed = 1, const std::string& members = {}) {
  std::string text = tiny_request(seed, members);
  const std::string_view usual = R"("samples": 16)";
  return text.replace(text.find(usual), usual.size(), quality);
}
// 48 x 32 pixels of 2,048 samples: three parts of a million.
std::string large_request(int seed = 1, const std::string& members = {}) {
  return request(R"("method": "lens-sampling", "samples": 2048)", seed, members);
}

// What a worker, or whoever makes pictures, has of its own.
struct Workshop {
  Workshop(const fs::path& scenes_folder, int threads)
      : store({scenes_folder}, limits), scenes(store, limits), pool(threads) {}
  server::CellTools tools() { return {.limits = limits, .scenes = scenes, .workers = pool}; }

  api::Limits limits = {};
  api::SceneStore store;
  server::CellScenes scenes;
  WorkerPool pool;
};

using Outcomes = std::map<std::uint32_t, server::CellOutcome>;

class QueueParts : public Queue {
 protected:
  using MakePart = std::function<server::CellOutcome(const server::SweepCell&, std::string_view,
                                                     server::ContentStore&, std::stop_token)>;

  // A worker with a connection, threads and scenes of its own.
  struct Working {
    Working(QueueParts& test, const std::string& name, MakePart make_part)
        : queue(test.connected()),
          shop(test.folder_.path() / "scenes", 1),
          worker({.queue = *queue,
                  .store = test.store_,
                  .log = test.log_,
                  .make_cell =
                      [this](const server::SweepCell& cell, server::ContentStore& store,
                             std::stop_token stop) {
                        ++cells;
                        return server::make_cell(cell, shop.tools(), store, stop);
                      },
                  .has_scene = [](const server::SweepCell&, const api::CellOrder&,
                                  server::ContentStore&) { return true; },
                  .make_part =
                      [this, make_part](const server::SweepCell& cell, std::string_view order,
                                        server::ContentStore& store, std::stop_token stop) {
                        ++parts;
                        if (make_part) return make_part(cell, order, store, stop);
                        return server::make_part(cell, order, shop.tools(), store, stop);
                      }},
                 {.name = name, .most_attempts = 2, .store = "here"}),
          thread([this] { worker.run(end.get_token(), end.get_token()); }) {}
    ~Working() {
      end.request_stop();
      thread.join();
    }

    std::unique_ptr<NatsQueue> queue;
    Workshop shop;
    std::atomic<int> cells = 0;
    std::atomic<int> parts = 0;
    std::stop_source end;
    server::QueueWorker worker;
    std::thread thread;
  };

  QueueParts() : store_(folder_.path() / "files"), queue_(connected()) { write_scenes(folder_); }

  std::unique_ptr<Working> working(const std::string& name, MakePart make_part = {}) {
    return std::make_unique<Working>(*this, name, std::move(make_part));
  }

  static std::vector<server::SweepCell> cells_of(const std::vector<std::string>& requests) {
    std::vector<server::SweepCell> cells;
    for (std::uint32_t i = 0; i < requests.size(); ++i) cells.push_back({kSweep, i, requests[i]});
    return cells;
  }

  Outcomes made_by_workers(const std::vector<server::SweepCell>& cells,
                           double split_cpu_s = kAnyCost, std::stop_token stop = {}) {
    Workshop shop(folder_.path() / "scenes", 2);
    const server::CostModel costs(2);
    const server::LargeCells large({.queue = *queue_,
                                    .store = store_,
                                    .files = store_,
                                    .log = log_,
                                    .tools = shop.tools(),
                                    .costs = costs,
                                    .split_cpu_s = split_cpu_s});
    Outcomes outcomes;
    server::NatsCellMaker(
        {.queue = *queue_,
         .store = store_,
         .log = log_,
         .is_kept = [this](const server::CellFile& file) { return store_.has(file); },
         .large = &large})
        .make(cells,
              {.done =
                   [&](server::CellOutcome outcome) {
                     const std::uint32_t index = outcome.index;
                     EXPECT_TRUE(outcomes.emplace(index, std::move(outcome)).second)
                         << "cell " << index << " came twice";
                   },
               .waiting = [](std::string_view) {}},
              stop);
    return outcomes;
  }

  // The same with the threads of one process.
  Outcomes made_here(const std::vector<server::SweepCell>& cells) {
    Workshop shop(folder_.path() / "scenes", 2);
    server::ContentFolder folder(folder_.path() / "here");
    Outcomes outcomes;
    server::LocalCellMaker(shop.tools(), folder)
        .make(cells,
              {.done =
                   [&](server::CellOutcome outcome) {
                     const std::uint32_t index = outcome.index;
                     outcomes.emplace(index, std::move(outcome));
                   },
               .waiting = [](std::string_view) {}},
              {});
    return outcomes;
  }

  // Names, reports and problems; hashes of all files.
  void expect_same(const Outcomes& workers, const Outcomes& here) {
    ASSERT_EQ(workers.size(), here.size());
    for (const auto& [index, outcome] : here) {
      EXPECT_EQ(server::outcome_text(workers.at(index)), server::outcome_text(outcome)) << index;
      for (const server::CellFile& file : outcome.files)
        EXPECT_TRUE(store_.has(file)) << index << " " << file.name;
    }
  }
  // Nothing is left of a sweep that is done but its files.
  void expect_nothing_left(const Outcomes& outcomes) {
    EXPECT_TRUE(queue_->entries(Bucket::outcomes, 10).empty());
    EXPECT_TRUE(queue_->entries(Bucket::attempts, 10).empty());
    EXPECT_EQ(queue_->depth().waiting + queue_->depth().in_hand, 0U);
    std::set<std::string> hashes;
    for (const auto& [index, outcome] : outcomes) {
      for (const server::CellFile& file : outcome.files) hashes.insert(file.sha256);
    }
    std::size_t files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path() / "files"))
      files += entry.is_regular_file() ? 1U : 0U;
    EXPECT_EQ(files, hashes.size());
  }

  server::ContentFolder store_;
  std::unique_ptr<NatsQueue> queue_;
};

TEST_F(QueueParts, ManyWorkersMakeTheBytesAndReportsOfOneMachine) {
  const auto cells = cells_of({
      large_request(1, R"(, "outputs": ["color", "depth", "all_in_focus", "variance"])"),
      request(R"("method": "lens-sampling", "max_error": 0.0007)"),
      request(R"("max_error": 0.0015)"),
  });
  const auto one = working("one");
  const auto other = working("other");
  const Outcomes outcomes = made_by_workers(cells);
  expect_same(outcomes, made_here(cells));
  EXPECT_EQ(outcomes.at(0).problem, "");
  EXPECT_GE(one->parts + other->parts, 3 + 3);
  EXPECT_GT(one->parts, 0);
  EXPECT_GT(other->parts, 0);
  EXPECT_EQ(one->cells + other->cells, 0);
  expect_nothing_left(outcomes);
}

// Wave spreads whole pictures; time and alpha keep a cell together; of a broken request a worker
// tells what is wrong; the last is too small.
TEST_F(QueueParts, WhatCannotBeCutGoesWhole) {
  const auto cells = cells_of({
      request(R"("method": "wave", "max_error": 0.05)"),
      request(R"("samples": 4)", 1, R"(, "outputs": ["color", "alpha"])"),
      R"({"scene": "none"})",
      "no JSON",
  });
  const auto one = working("one");
  const Outcomes outcomes = made_by_workers(cells);
  expect_same(outcomes, made_here(cells));
  EXPECT_EQ(one->parts, 0);
  EXPECT_EQ(one->cells, 4);
  const auto small = cells_of({large_request()});
  expect_same(made_by_workers(small, 1e9), made_here(small));
  EXPECT_EQ(one->parts, 0);
  expect_same(made_by_workers(small, 0.0), made_here(small));
  EXPECT_EQ(one->parts, 0);
}

TEST_F(QueueParts, APartThatAlwaysFailsIsTheCellsProblemAndOthersAreMade) {
  const auto cells = cells_of({large_request(), request(R"("method": "wave", "max_error": 0.05)")});
  const auto one = working("one",
                           [](const server::SweepCell&, std::string_view, server::ContentStore&,
                              std::stop_token) -> server::CellOutcome { throw std::bad_alloc(); });
  const Outcomes outcomes = made_by_workers(cells);
  ASSERT_EQ(outcomes.size(), 2U);
  EXPECT_NE(outcomes.at(0).problem.find("/problems/cell-abandoned"), std::string::npos);
  EXPECT_TRUE(outcomes.at(0).files.empty());
  EXPECT_EQ(outcomes.at(1).problem, "");
  EXPECT_TRUE(eventually([&] { return queue_->depth().in_hand == 0; }));
}

// Foreign bytes in the place of a part, and a part of something else, are made again.
TEST_F(QueueParts, WhatIsNoPartIsNotTaken) {
  const auto cells = cells_of({large_request()});
  Workshop shop(folder_.path() / "scenes", 1);
  std::atomic<int> times = 0;
  std::string first;
  const auto one = working("one", [&](const server::SweepCell& cell, std::string_view order,
                                      server::ContentStore& store, std::stop_token stop) {
    const int time = ++times;
    if (time <= 2) {
      const std::string bytes = time == 1 ? std::string("no part") : first;
      first = std::string(order);
      return server::CellOutcome{.index = cell.index,
                                 .files = {{"part.bin", store.put(bytes), bytes.size()}}};
    }
    return server::make_part(cell, order, shop.tools(), store, stop);
  });
  expect_same(made_by_workers(cells), made_here(cells));
  EXPECT_EQ(times, 3 + 2) << "three parts, two of them twice";
  EXPECT_NE(log_text().find("\"event\":\"part_refused\""), std::string::npos);
}

// Whoever made the picture ended after two parts: what workers have traced is not traced again.
TEST_F(QueueParts, AnotherAttemptAtACellFindsThePartsThatAreMade) {
  const auto cells = cells_of({large_request()});
  std::stop_source ends;
  std::atomic<int> recorded = 0;
  {
    const auto one = working("one");
    std::jthread watching([&] {
      eventually([&] {
        recorded = static_cast<int>(queue_->entries(Bucket::outcomes, 10).size());
        return recorded >= 2;
      });
      ends.request_stop();
    });
    EXPECT_TRUE(made_by_workers(cells, kAnyCost, ends.get_token()).empty());
  }
  recorded = static_cast<int>(queue_->entries(Bucket::outcomes, 10).size());
  ASSERT_GE(recorded, 2);
  const auto two = working("two");
  const Outcomes outcomes = made_by_workers(cells);
  expect_same(outcomes, made_here(cells));
  EXPECT_EQ(two->parts, 3 - recorded);
  expect_nothing_left(outcomes);
}

TEST(PartKeys, TellTheCellAndNothingElseDoes) {
  const std::string hash = api::sha256_hex("an order");
  const std::string cell = server::cell_key(kSweep, 12);
  EXPECT_EQ(server::part_key(cell, hash), cell + ".p" + hash);
  EXPECT_EQ(server::cell_index(cell), 12U);
  EXPECT_EQ(server::cell_index(server::part_key(cell, hash)), 12U);
  api::CellOrder order{.sweep = kSweep, .index = 12};
  EXPECT_EQ(server::order_key(order), cell);
  order.part = hash;
  EXPECT_EQ(server::order_key(order), server::part_key(cell, hash));
  for (const std::string& wrong :
       {cell + ".p", cell + ".p12", cell + "." + hash, cell + ".p" + hash + "0",
        server::part_key(server::part_key(cell, hash), hash), ".p" + hash, std::string(".p")})
    EXPECT_FALSE(server::cell_index(wrong)) << wrong;
}

class PartPrograms : public Queue {
 protected:
  PartPrograms() : port_(free_port()) {
    write_scenes(folder_);
    start_server();
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  void start_server(const std::vector<std::string>& more = {}) {
    server_.reset();
    std::vector<std::string> arguments = {"--data-dir", path("data"), "--scenes-dir",
                                          path("scenes")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    server_ = std::make_unique<ServerProcess>(folder_.path(), arguments, port_);
  }
  std::unique_ptr<BackgroundProcess> started_worker() {
    const std::string results = "http://127.0.0.1:" + std::to_string(port_);
    return std::make_unique<BackgroundProcess>(BackgroundProcess::fstop(
        {"worker", "--queue", nats_.url(), "--results", results, "--scenes-dir", path("scenes"),
         "--threads", "1"},
        folder_.path() / ("worker-" + std::to_string(++workers_) + ".log")));
  }
  // Events of parts in a worker's log.
  static int count(const BackgroundProcess& worker, const std::string& event) {
    const std::string text = worker.error_text();
    int found = 0;
    for (std::size_t at = text.find(event); at != std::string::npos; at = text.find(event, at + 1))
      found += text.substr(at, text.find('\n', at) - at).find(".p") != std::string::npos ? 1 : 0;
    return found;
  }
  static bool has_begun(const BackgroundProcess& worker, int parts) {
    return eventually([&] { return count(worker, "cell_begun") >= parts; });
  }
  std::string recipe(int samples) const {
    return R"({"base": )" +
           request(R"("method": "lens-sampling", "samples": )" + std::to_string(samples)) +
           R"(, "axes": [{"member": "/seed", "values": [1]}]})";
  }

  std::uint16_t port_;
  std::unique_ptr<ServerProcess> server_ = {};
  int workers_ = 0;
};

TEST_F(PartPrograms, ASweepOfOneCellIsMadeByBothWorkersAndOneIsKilled) {
  folder_.write("recipe.json", recipe(16'384));
  const std::vector<std::string> common = {"sweep", path("recipe.json"), "--scenes-dir",
                                           path("scenes")};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), common.begin(), common.end());
    return more;
  };
  const auto queue = connected(1s);
  auto first = started_worker();
  auto second = started_worker();
  RunningProgram sweep(
      with({"--out", path("parts"), "--queue", nats_.url(), "--results",
            "http://127.0.0.1:" + std::to_string(port_), "--split-cpu-s", "1e-9"}));
  ASSERT_TRUE(has_begun(*first, 2)) << first->error_text();
  first->signal(SIGKILL);
  first->wait();
  ASSERT_TRUE(has_begun(*second, 1)) << second->error_text();
  auto third = started_worker();
  const Outcome outcome = sweep.wait();
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output << outcome.errors;
  EXPECT_GE(count(*first, "cell_done"), 1);
  EXPECT_GE(count(*second, "cell_done"), 1);
  ASSERT_EQ(run_fstop(with({"--out", path("alone")})).exit_code, 0);
  EXPECT_TRUE(text_of_file(path("parts") + "/manifest.json") ==
              text_of_file(path("alone") + "/manifest.json"));
  EXPECT_TRUE(queue->entries(Bucket::outcomes, 10).empty());
}

TEST_F(PartPrograms, AServerThatIsKilledGoesOnWithTheCell) {
  const std::vector<std::string> with_queue = {"--queue", nats_.url(),     "--ack-wait-s",
                                               "1",       "--split-cpu-s", "1e-9"};
  server_->signal(SIGTERM);
  EXPECT_EQ(server_->wait(), 0);
  start_server(with_queue);
  const std::string text = recipe(8192);
  const std::string sweep = begun_sweep(port_, text);
  auto worker = started_worker();
  ASSERT_TRUE(has_begun(*worker, 3)) << worker->error_text();
  server_->signal(SIGKILL);
  EXPECT_EQ(server_->wait(), 128 + SIGKILL);
  start_server(with_queue);
  const std::string manifest = manifest_of(port_, sweep);
  ASSERT_FALSE(manifest.empty()) << server_->log_text() << worker->error_text();
  EXPECT_NE(manifest.find("\"failures\":[]"), std::string::npos) << manifest.substr(0, 500);
  // 12.6 million samples: twelve parts, each made once.
  EXPECT_EQ(count(*worker, "cell_done"), 12) << worker->error_text();
  const TemporaryFolder alone;
  const ServerProcess server(alone.path(), {"--data-dir", (alone.path() / "data").string(),
                                            "--scenes-dir", path("scenes")});
  EXPECT_EQ(begun_sweep(server.port(), text), sweep);
  EXPECT_TRUE(manifest_of(server.port(), sweep) == manifest);
}

TEST_F(PartPrograms, WrongLimitsAreTold) {
  folder_.write("recipe.json", recipe(16));
  folder_.write("serve.conf", "split-cpu-s = -1\n");
  EXPECT_EQ(run_fstop({"serve", "--port", "0", "--config", path("serve.conf")}).exit_code, 2);
  for (const char* wrong : {"-1", "nan", "1e10"}) {
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"serve", "--port", "0"},
          {"sweep", path("recipe.json"), "--out", path("new"), "--scenes-dir", path("scenes")}}) {
      std::vector<std::string> all = arguments;
      all.insert(all.end(), {"--split-cpu-s", wrong});
      const Outcome outcome = run_fstop(all);
      EXPECT_EQ(outcome.exit_code, 2) << outcome.output << outcome.errors;
      EXPECT_NE(outcome.output.find("\"detail\":\"--split-cpu-s"), std::string::npos)
          << outcome.output;
    }
  }
}

}  // namespace
}  // namespace fstop::test
