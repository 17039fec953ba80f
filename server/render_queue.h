#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include <boost/asio/awaitable.hpp>

namespace fstop::server {

/// Renders, or other long work, that wait for one of a few slots. Requests of one id that meet here
/// share one render; it is stopped when the last of them has gone.
class RenderQueue {
 public:
  /// What the work made: whoever submits to a queue knows the type.
  using Result = std::shared_ptr<void>;
  /// Renders on a thread of the queue; `queued_ms`: how long it waited.
  using Work = std::function<Result(const std::stop_token& stop, double queued_ms)>;

  struct Counts {
    int queued = 0;
    int running = 0;
    std::uint64_t started = 0;    // renders begun, all since the start
    std::uint64_t joined = 0;     // requests that shared a render of another
    std::uint64_t withdrawn = 0;  // renders nobody waited for any more
    std::uint64_t refused = 0;    // requests that found the queue full
  };

  class Ticket;

  RenderQueue(int slots, int most_queued, int niceness);
  /// Stops what runs and waits for it.
  ~RenderQueue();
  RenderQueue(const RenderQueue&) = delete;
  RenderQueue& operator=(const RenderQueue&) = delete;

  /// A place in the queue, or a share in the render of the same `id`.
  /// Throws: Refusal 503 with Retry-After if the queue is full or closed.
  Ticket submit(const std::string& id, Work work);

  /// From now on every new render is refused.
  void close();
  /// Stops what runs and drops what waits; those who wait get Error{cancelled}.
  void cancel_all();
  Counts counts() const;

 private:
  struct Job;
  void serve(const std::stop_token& stop);
  void finish(const std::shared_ptr<Job>& job, Result result, std::exception_ptr failure,
              std::chrono::steady_clock::duration took);
  void withdraw(const std::shared_ptr<Job>& job);
  int retry_after_seconds() const;

  mutable std::mutex mutex_;
  std::condition_variable_any work_there_;
  std::deque<std::shared_ptr<Job>> waiting_ = {};
  std::unordered_map<std::string, std::shared_ptr<Job>> in_flight_ = {};  // waiting or running
  std::vector<std::shared_ptr<Job>> running_ = {};
  Counts counts_ = {};
  int slots_;
  int most_queued_;
  bool closed_ = false;
  double seconds_per_render_ = 1.0;  // smoothed over the latest renders
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
  /// After ended(): the result. Throws: what the render threw.
  Result result() const;

 private:
  RenderQueue* queue_;
  std::shared_ptr<Job> job_;
};

}  // namespace fstop::server
