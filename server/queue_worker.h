#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <string_view>

#include "api/cell_json.h"
#include "server/log.h"
#include "server/nats_queue.h"
#include "server/sweep_cells.h"

namespace fstop::server {

/// What a program that serves a queue waits for: says so in the log where it changes, tells the
/// queue's table `waiting`, and pauses longer each time. Any thread, one at a time.
class QueuePatience {
 public:
  QueuePatience(NatsQueue& queue, Log& log, std::string name)
      : queue_(queue), log_(log), name_(std::move(name)) {}

  /// Returns after a pause, or once `stop` is requested.
  void wait(std::string_view what, std::string_view why, const std::stop_token& stop);
  /// It goes on.
  void over();

 private:
  NatsQueue& queue_;
  Log& log_;
  std::string name_;
  std::string what_ = {};
  std::chrono::milliseconds pause_ = kFirstPause;
  std::chrono::steady_clock::time_point told_ = {};

  static constexpr std::chrono::milliseconds kFirstPause{100};
};

/// Takes cells, and parts of large ones, from a queue, one at a time, and makes them. A cell leaves
/// the queue only once its outcome is recorded and the files of that lie in the store; whatever
/// ends this process before gives the cell to another. Cells that end their worker again and again
/// are recorded as failed.
class QueueWorker {
 public:
  struct Services {
    NatsQueue& queue;
    ContentStore& store;
    Log& log;
    /// As server/cell_work.h: make_cell.
    std::function<CellOutcome(const SweepCell&, ContentStore&, std::stop_token)> make_cell;
    /// Whether this program has the scene of the order, or has fetched it from the store: then
    /// the next make_cell or make_part is of this cell.
    std::function<bool(const SweepCell&, const api::CellOrder&, ContentStore&)> has_scene;
    /// As server/cell_work.h: make_part.
    std::function<CellOutcome(const SweepCell&, std::string_view order, ContentStore&,
                              std::stop_token)>
        make_part = {};
  };
  struct Options {
    std::string name = {};   // among workers: letters, digits, - and _
    int most_attempts = 5;   // at one cell
    std::string store = {};  // what the store is called
  };

  QueueWorker(Services services, Options options);
  ~QueueWorker();

  /// Returns once `stop` is requested and the cell in hand is done, or soon after `abandon` is:
  /// then that cell goes back to the queue, its attempt not counted.
  void run(std::stop_token stop, std::stop_token abandon);

 private:
  class Heartbeat;
  class WaitingStore;

  void serve(Delivery& delivery);
  void finish(Delivery& delivery);
  void give_back(Delivery& delivery, std::chrono::milliseconds delay);
  void attempt(Delivery& delivery, const api::CellOrder& order);
  void leave_to_others(Delivery& delivery, const std::string& whom);
  CellOutcome made(const SweepCell& cell, const api::CellOrder& order, ContentStore& store);
  static std::string request_of(const api::CellOrder& order, ContentStore& store);
  int counted_attempt(const std::string& key);
  void uncount_attempt(const std::string& key);
  void record(const std::string& key, const CellOutcome& outcome);
  template <typename Act>
  auto patiently(const Act& act);

  Services services_;
  Options options_;
  QueuePatience patience_;
  std::unique_ptr<Heartbeat> heartbeat_;  // of the cell in hand
  std::stop_token stop_ = {};
  std::stop_token abandon_ = {};
};

}  // namespace fstop::server
