#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include <boost/asio/awaitable.hpp>

#include "server/progress.h"

namespace fstop::server {

/// Renders, or other long work, that wait for one of a few slots. Clients take turns, whatever
/// number of renders each has waiting. Requests of one id that meet here share one render; it is
/// stopped when the last of them has gone.
class RenderQueue {
 public:
  /// What the work made: whoever submits to a queue knows the type.
  using Result = std::shared_ptr<void>;
  /// What the queue tells the work.
  struct Turn {
    std::stop_token stop = {};
    double queued_ms = 0.0;        // how long it waited
    bool is_express = false;       // on a thread for small work
    Progress* progress = nullptr;  // for the work to tell; never null
  };
  /// Renders on a thread of the queue.
  using Work = std::function<Result(const Turn& turn)>;

  struct Submission {
    std::string id = {};        // of the content: equal ids share one render
    std::string client = {};    // whose turn it takes
    double cost_s = 1.0;        // predicted seconds on a slot
    double memory_bytes = 0.0;  // predicted
    bool is_small = false;      // may go on an express slot
    Work work = {};
  };
  struct Shape {
    int slots = 1;
    int express_slots = 0;  // beside them, for small work alone
    int most_queued = 1;
    int most_queued_per_client = 1;
    double memory_bytes = 1e300;  // of all that runs at once; one alone may have more
    int niceness = 0;
    int express_niceness = 0;
  };

  struct Counts {
    int queued = 0;
    int running = 0;
    double oldest_s = 0.0;        // how long the oldest one has waited
    double backlog_s = 0.0;       // until all that waits is done, at the measured pace
    std::uint64_t started = 0;    // renders begun, all since the start
    std::uint64_t joined = 0;     // requests that shared a render of another
    std::uint64_t withdrawn = 0;  // renders nobody waited for any more
    std::uint64_t refused = 0;    // requests that found the queue full
  };

  class Ticket;

  explicit RenderQueue(const Shape& shape);
  /// Stops what runs and waits for it.
  ~RenderQueue();
  RenderQueue(const RenderQueue&) = delete;
  RenderQueue& operator=(const RenderQueue&) = delete;

  /// A place in the queue, or a share in the render of the same id.
  /// Throws: Refusal 503 if the queue is full or closed, 429 if the client has as many waiting as
  ///         one may; both with Retry-After.
  Ticket submit(Submission submission);

  /// From now on every new render is refused.
  void close();
  /// Stops what runs and drops what waits; those who wait get Error{cancelled}.
  void cancel_all();
  Counts counts() const;

 private:
  struct Job;
  using Line = std::deque<std::shared_ptr<Job>>;
  void serve(const std::stop_token& stop, bool is_express);
  std::shared_ptr<Job> next(bool is_express);
  bool fits(const Job& job) const;
  void drop(const std::shared_ptr<Job>& job);
  void refuse_if_full(const std::string& client);
  void finish(const std::shared_ptr<Job>& job, Result result, std::exception_ptr failure,
              std::chrono::steady_clock::duration took);
  void withdraw(const std::shared_ptr<Job>& job);
  int place_of(const Job& job) const;
  double backlog_s() const;
  int retry_after_seconds() const;
  int waiting() const;

  mutable std::mutex mutex_;
  std::condition_variable_any work_there_;
  std::map<std::string, Line> lines_ = {};  // what waits, by client; none is empty
  std::deque<std::string> turns_ = {};      // the clients of lines_, whose turn is next first
  std::unordered_map<std::string, std::shared_ptr<Job>> in_flight_ = {};  // waiting or running
  std::vector<std::shared_ptr<Job>> running_ = {};
  Counts counts_ = {};
  Shape shape_;
  bool closed_ = false;
  int busy_express_ = 0;           // express slots that have work
  double running_bytes_ = 0.0;     // predicted
  double seconds_per_cost_ = 1.0;  // real over predicted seconds, smoothed over the latest renders
  std::vector<std::jthread> threads_ = {};
};

/// One client's interest in a render; giving it up withdraws the interest.
class RenderQueue::Ticket {
 public:
  Ticket(RenderQueue& queue, std::shared_ptr<Job> job) : queue_(&queue), job_(std::move(job)) {}
  ~Ticket();
  Ticket(Ticket&& other) noexcept = default;
  Ticket& operator=(Ticket&&) = delete;
  Ticket(const Ticket&) = delete;
  Ticket& operator=(const Ticket&) = delete;

  /// Returns when the render has ended; may be cancelled as any wait.
  boost::asio::awaitable<void> ended() const;
  bool has_ended() const;
  /// After ended(): the result. Throws: what the render threw.
  Result result() const;
  /// How many go before it and it; 0 once it runs.
  int place() const;
  /// Of the render, whoever began it.
  Progress::State progress() const;

 private:
  RenderQueue* queue_;
  std::shared_ptr<Job> job_;
};

}  // namespace fstop::server
