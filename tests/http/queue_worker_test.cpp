// A worker of the queue and whoever waits for it, in this process, on a NATS server of the test's
// own.
#include "server/queue_worker.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <new>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "api/cell_json.h"
#include "api/render_id.h"
#include "core/error.h"
#include "server/cell_records.h"
#include "server/content_folder.h"
#include "server/http_message.h"
#include "server/nats_cell_maker.h"
#include "tests/http/queue_fixture.h"

namespace fstop::test {
namespace {

using server::NatsQueue;
using Bucket = server::NatsQueue::Bucket;

const std::string kSweep(64, '5');

// What a made-up cell becomes: one file with its request.
server::CellOutcome made(const server::SweepCell& cell, server::ContentStore& store) {
  const std::string bytes = "picture of " + cell.request;
  return {.index = cell.index,
          .render_id = api::sha256_hex(cell.request),
          .files = {{"image.png", store.put(bytes), bytes.size()}},
          .report = "{}"};
}

class QueueWorking : public Queue {
 protected:
  using Make = std::function<server::CellOutcome(const server::SweepCell&, server::ContentStore&,
                                                 std::stop_token)>;
  QueueWorking() : store_(folder_.path() / "files"), queue_(connected()) {}

  server::QueueWorker worker(Make make, server::ContentStore& store, int most_attempts = 3,
                             std::string scene = {}) {
    return {
        {.queue = *queue_,
         .store = store,
         .log = log_,
         .make_cell = std::move(make),
         .has_scene =
             [scene](const server::SweepCell&, const api::CellOrder& order, server::ContentStore&) {
               return order.scene.empty() || order.scene == scene;
             }},
        {.name = "tester", .most_attempts = most_attempts, .store = "here"}};
  }

  static std::vector<server::SweepCell> cells(std::uint32_t count) {
    std::vector<server::SweepCell> cells;
    for (std::uint32_t i = 0; i < count; ++i)
      cells.push_back({kSweep, i, "request " + std::to_string(i)});
    return cells;
  }

  server::NatsCellMaker maker() {
    return server::NatsCellMaker(
        {.queue = *queue_,
         .store = store_,
         .log = log_,
         .is_kept = [this](const server::CellFile& file) { return store_.has(file); }});
  }

  // What all cells became, by index; each must come once.
  std::map<std::uint32_t, server::CellOutcome> collected(
      const std::vector<server::SweepCell>& cells) {
    std::map<std::uint32_t, server::CellOutcome> outcomes;
    maker().make(cells,
                 {.done =
                      [&](server::CellOutcome outcome) {
                        const std::uint32_t index = outcome.index;
                        EXPECT_TRUE(outcomes.emplace(index, std::move(outcome)).second)
                            << "cell " << index << " came twice";
                      },
                  .waiting =
                      [&](std::string_view what) {
                        waits_.emplace_back(what);
                        ++told_;
                      }},
                 {});
    return outcomes;
  }

  // Runs a worker beside `work`.
  void with(server::QueueWorker& worker, const std::function<void()>& work) {
    std::stop_source stop;
    std::thread thread([&] { worker.run(stop.get_token(), stop.get_token()); });
    work();
    stop.request_stop();
    thread.join();
  }

  server::ContentFolder store_;
  std::unique_ptr<NatsQueue> queue_;
  std::vector<std::string> waits_ = {};  // to be read once it has returned
  std::atomic<int> told_ = 0;
};

TEST_F(QueueWorking, EveryCellIsMadeOnceAndCollectedOnce) {
  std::atomic<int> times = 0;
  auto one = worker(
      [&](const server::SweepCell& cell, server::ContentStore& store, std::stop_token) {
        ++times;
        return made(cell, store);
      },
      store_);
  with(one, [&] {
    const auto outcomes = collected(cells(50));
    ASSERT_EQ(outcomes.size(), 50U);
    for (const auto& [index, outcome] : outcomes) {
      EXPECT_EQ(outcome.render_id, api::sha256_hex("request " + std::to_string(index)));
      EXPECT_EQ(store_.get(outcome.files.at(0).sha256),
                "picture of request " + std::to_string(index));
      EXPECT_EQ(outcome.problem, "");
    }
  });
  EXPECT_EQ(times, 50);
  // Nothing is left of a sweep that is done.
  EXPECT_TRUE(queue_->entries(Bucket::outcomes, 10).empty());
  EXPECT_TRUE(queue_->entries(Bucket::attempts, 10).empty());
  EXPECT_EQ(queue_->depth().waiting + queue_->depth().in_hand, 0U);
}

TEST_F(QueueWorking, ACellThatAlwaysFailsIsRecordedAndTheOthersAreMade) {
  std::map<std::uint32_t, int> times;
  auto one = worker(
      [&](const server::SweepCell& cell, server::ContentStore& store, std::stop_token) {
        ++times[cell.index];
        if (cell.index == 1) throw std::bad_alloc();
        return made(cell, store);
      },
      store_, 3);
  with(one, [&] {
    const auto outcomes = collected(cells(3));
    EXPECT_NE(outcomes.at(1).problem.find("/problems/cell-abandoned"), std::string::npos);
    EXPECT_TRUE(outcomes.at(1).files.empty());
    EXPECT_EQ(outcomes.at(0).problem, "");
    EXPECT_EQ(outcomes.at(2).problem, "");
  });
  EXPECT_EQ(times[0], 1);
  EXPECT_EQ(times[1], 3) << "attempts at a cell are bounded";
  EXPECT_EQ(times[2], 1);
}

TEST_F(QueueWorking, WhatWasRecordedMeanwhileIsFoundAndNotMadeAgain) {
  const auto all = cells(3);
  queue_->create(Bucket::outcomes, server::cell_key(kSweep, 0),
                 server::outcome_text(made(all[0], store_)));
  std::map<std::uint32_t, int> times;
  auto one = worker(
      [&](const server::SweepCell& cell, server::ContentStore& store, std::stop_token) {
        ++times[cell.index];
        return made(cell, store);
      },
      store_);
  with(one, [&] { EXPECT_EQ(collected(all).size(), 3U); });
  EXPECT_EQ(times[0], 0);
  EXPECT_EQ(times[1], 1);
  EXPECT_EQ(times[2], 1);
}

// An outcome whose files have been lost since is none.
TEST_F(QueueWorking, ACellWhoseFilesAreGoneIsMadeAgain) {
  const auto all = cells(1);
  server::CellOutcome lost = made(all[0], store_);
  lost.files[0].sha256 = api::sha256_hex("what nobody has put");
  queue_->create(Bucket::outcomes, server::cell_key(kSweep, 0), server::outcome_text(lost));
  auto one = worker([&](const server::SweepCell& cell, server::ContentStore& store,
                        std::stop_token) { return made(cell, store); },
                    store_);
  with(one, [&] {
    EXPECT_EQ(collected(all).at(0).files.at(0).sha256, api::sha256_hex("picture of request 0"));
  });
}

// A duplicate in the queue of a cell whose outcome is there: taken off, not made.
TEST_F(QueueWorking, ADuplicateIsNotMade) {
  const auto all = cells(1);
  queue_->create(Bucket::outcomes, server::cell_key(kSweep, 0),
                 server::outcome_text(made(all[0], store_)));
  queue_->create(Bucket::attempts, server::cell_key(kSweep, 0), "1");
  queue_->publish(server::cell_key(kSweep, 0),
                  api::to_json(api::CellOrder{.engine = std::string(api::engine_version()),
                                              .sweep = kSweep,
                                              .index = 0,
                                              .request = "request 0"}),
                  "again");
  int times = 0;
  auto one = worker(
      [&](const server::SweepCell& cell, server::ContentStore& store, std::stop_token) {
        ++times;
        return made(cell, store);
      },
      store_);
  with(one, [&] {
    EXPECT_TRUE(eventually([&] {
      const auto depth = queue_->depth();
      return depth.waiting + depth.in_hand == 0;
    }));
  });
  EXPECT_EQ(times, 0);
}

TEST_F(QueueWorking, ForeignOrdersAreRecordedAsRefused) {
  queue_->publish(server::cell_key(kSweep, 0), "no JSON", "a");
  queue_->publish(server::cell_key(kSweep, 1),
                  api::to_json(api::CellOrder{.engine = std::string(api::engine_version()),
                                              .sweep = kSweep,
                                              .index = 2,
                                              .request = "request 2"}),
                  "a");
  queue_->publish("nothing-like-it", "{}", "a");
  int times = 0;
  auto one = worker(
      [&](const server::SweepCell& cell, server::ContentStore& store, std::stop_token) {
        ++times;
        return made(cell, store);
      },
      store_);
  with(one, [&] {
    EXPECT_TRUE(eventually([&] {
      const auto depth = queue_->depth();
      return depth.waiting + depth.in_hand == 0;
    }));
  });
  EXPECT_EQ(times, 0);
  for (const std::uint32_t index : {0U, 1U}) {
    const auto value = queue_->get(Bucket::outcomes, server::cell_key(kSweep, index));
    ASSERT_TRUE(value);
    EXPECT_NE(server::outcome_of(value->text).problem, "");
  }
}

// Requests and outcomes beyond a message's size lie in the store.
TEST_F(QueueWorking, LargeRequestsAndReportsGoThroughTheStore) {
  std::vector<server::SweepCell> all = cells(1);
  all[0].request = std::string(NatsQueue::kMostMessageBytes + 1, 'r');
  auto one = worker(
      [&](const server::SweepCell& cell, server::ContentStore& store, std::stop_token) {
        server::CellOutcome outcome = made(cell, store);
        outcome.report = std::string(NatsQueue::kMostMessageBytes + 1, 'x');
        return outcome;
      },
      store_);
  with(one, [&] {
    const auto outcomes = collected(all);
    EXPECT_EQ(outcomes.at(0).render_id, api::sha256_hex(all[0].request));
    EXPECT_TRUE(outcomes.at(0).report == std::string(NatsQueue::kMostMessageBytes + 1, 'x'));
  });
}

// A store without room, or that is gone, is waited for; the cell is rendered once.
TEST_F(QueueWorking, AStoreThatRefusesIsWaitedFor) {
  class Refusing : public server::ContentStore {
   public:
    explicit Refusing(server::ContentStore& store) : store_(store) {}
    std::string put(std::string_view bytes) override {
      if (++puts <= 2) {
        throw server::Refusal(server::http::status::insufficient_storage, "storage-full", "full");
      }
      if (puts <= 4) throw Error(ErrorCode::io_failure, "gone");
      return store_.put(bytes);
    }
    std::optional<std::string> get(std::string_view sha256) override { return store_.get(sha256); }
    int puts = 0;

   private:
    server::ContentStore& store_;
  };
  Refusing refusing(store_);
  int times = 0;
  auto one = worker(
      [&](const server::SweepCell& cell, server::ContentStore& store, std::stop_token) {
        ++times;
        return made(cell, store);
      },
      refusing);
  with(one, [&] { EXPECT_EQ(collected(cells(1)).at(0).problem, ""); });
  EXPECT_EQ(times, 1);
  EXPECT_EQ(refusing.puts, 5);
  const std::string log = log_text();
  EXPECT_NE(log.find("\"for\":\"disk space at the results store at here\""), std::string::npos);
  EXPECT_NE(log.find("\"for\":\"the results store at here\""), std::string::npos);
  EXPECT_NE(log.find("\"event\":\"goes_on\""), std::string::npos);
}

TEST_F(QueueWorking, CellsOfOtherEnginesAndScenesAreLeftToOthers) {
  const auto order = [](std::uint32_t index, const std::string& engine, const std::string& scene) {
    return api::to_json(api::CellOrder{
        .engine = engine, .scene = scene, .sweep = kSweep, .index = index, .request = "{}"});
  };
  const std::string engine(api::engine_version());
  queue_->publish(server::cell_key(kSweep, 0), order(0, "fstop/0.0.1", ""), "a");
  queue_->publish(server::cell_key(kSweep, 1), order(1, engine, std::string(64, 'a')), "a");
  queue_->publish(server::cell_key(kSweep, 2), order(2, engine, std::string(64, 'b')), "a");
  std::map<std::uint32_t, int> times;
  auto one = worker(
      [&](const server::SweepCell& cell, server::ContentStore& store, std::stop_token) {
        ++times[cell.index];
        return made(cell, store);
      },
      store_, 3, std::string(64, 'b'));
  with(one, [&] {
    EXPECT_TRUE(eventually(
        [&] { return queue_->get(Bucket::outcomes, server::cell_key(kSweep, 2)).has_value(); }));
  });
  EXPECT_EQ(times.size(), 1U);
  EXPECT_EQ(times[2], 1);
  EXPECT_FALSE(queue_->get(Bucket::outcomes, server::cell_key(kSweep, 0)));
  EXPECT_FALSE(queue_->get(Bucket::outcomes, server::cell_key(kSweep, 1)));
  const auto attempts = queue_->get(Bucket::attempts, server::cell_key(kSweep, 1));
  EXPECT_TRUE(!attempts || attempts->text == "0") << "no attempt is counted";
}

TEST_F(QueueWorking, TheMakerSaysThatItWaitsForWorkers) {
  std::stop_source stop;
  std::vector<std::string> waits;
  maker().make(cells(2),
               {.done = [](server::CellOutcome) { ADD_FAILURE(); },
                .waiting =
                    [&](std::string_view what) {
                      waits.emplace_back(what);
                      stop.request_stop();
                    }},
               stop.get_token());
  EXPECT_EQ(waits, std::vector<std::string>{"workers"});
  EXPECT_EQ(queue_->depth().waiting, 0U) << "cells of a sweep that is stopped leave the queue";
}

TEST_F(QueueWorking, TheMakerWaitsForTheBrokerAndGoesOn) {
  auto one = worker([&](const server::SweepCell& cell, server::ContentStore& store,
                        std::stop_token) { return made(cell, store); },
                    store_);
  nats_.kill();
  std::jthread starting([&] {
    eventually([&] { return told_ > 0; });
    nats_.start();
  });
  with(one, [&] { EXPECT_EQ(collected(cells(20)).size(), 20U); });
  EXPECT_EQ(waits_.front(), "the queue at " + nats_.url());
  EXPECT_EQ(waits_.back(), "");
}

}  // namespace
}  // namespace fstop::test
