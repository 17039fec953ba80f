#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "server/log.h"
#include "server/nats_queue.h"
#include "server/sweep_cells.h"

namespace fstop::server {

/// Puts orders into a queue and collects the outcomes that workers record of them. What was
/// recorded while nobody collected it is found; what is in the queue already is not put there
/// again.
class OrderCollector {
 public:
  struct Services {
    NatsQueue& queue;
    ContentStore& store;  // where large outcomes lie
    Log& log;
  };
  struct Calls {
    /// The text of the order called `key`, at most NatsQueue::kMostMessageBytes.
    std::function<std::string(const std::string& key)> order;
    /// An outcome, once for each key; false where what it names is lost: then it is made again.
    std::function<bool(const std::string& key, CellOutcome& outcome)> take;
    /// What is waited for; empty: nothing.
    std::function<void(std::string_view)> waiting;
  };
  /// `prefix`: of all keys; ends where a part of a key does.
  OrderCollector(Services services, std::string prefix, Calls calls)
      : services_(services), prefix_(std::move(prefix)), calls_(std::move(calls)) {}

  /// One order more. Any thread; at any time.
  void add(const std::string& key);
  /// Returns when all outcomes are taken and `may_come` is absent or says that no order will be
  /// added, or soon after `stop` is requested. Waits for the queue, the store (Error{io_failure})
  /// and workers as long as it takes. Throws: what the calls throw but those.
  void until_done(const std::stop_token& stop, const std::function<bool()>& may_come = {});

  /// Takes out of the queue what nobody has begun; with `outcomes` forgets what was recorded, too.
  void tidy(bool outcomes) noexcept;

 private:
  void collect(const std::stop_token& stop, const std::function<bool()>& may_come);
  bool take(const NatsQueue::Entry& entry);
  void make_again(const std::string& key);
  void adopt();
  void publish(const std::stop_token& stop);
  void look_around();
  void tell(const std::string& what);

  Services services_;
  std::string prefix_;
  Calls calls_;
  std::mutex adding_ = {};
  std::vector<std::string> added_ = {};
  std::map<std::string, std::uint64_t, std::less<>> open_ = {};  // with their place in the order
  std::uint64_t count_ = 0;                                      // that were added
  std::deque<std::string> unpublished_ = {};
  std::set<std::string> published_ = {};  // in the queue or in hand
  std::string generation_ = {};
  std::string told_ = {};
  int lost_ = 0;  // outcomes without their files, since it was told what is waited for
};

}  // namespace fstop::server
