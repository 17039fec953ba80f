#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include "api/job_json.h"
#include "api/limits.h"
#include "server/job_notes.h"
#include "server/log.h"
#include "server/negotiation.h"
#include "server/render_cache.h"
#include "server/render_queue.h"

namespace fstop::server {

/// What a job is to be of.
struct JobOrder {
  std::string render = {};                // content hash
  bool is_kept = true;                    // its result will stand in the cache
  ImageFormat format = ImageFormat::png;  // of the picture, unless Accept says otherwise
  Precision precision = Precision::single;
  bool is_sweep = false;  // then `render` is the sweep's id, and there is no picture
  std::string name = {};  // that the job had before; empty: a new one
  std::function<std::string()> waiting_for = {};  // what the work waits for, if it tells
  std::function<void(const std::string& job)> withdrawn = {};  // while it was active
  double max_error = 0.0;  // that ends the render; 0: something else does
  std::optional<std::chrono::steady_clock::time_point> deadline = {};  // nobody waits beyond
};

/// One client's lasting interest in a render. Used by the I/O thread alone.
struct Job {
  enum class State { active, done, failed, cancelled };

  std::string name = {};  // random: who knows it may ask for it
  std::string life = {};  // of this object: a restored job counts its events anew
  JobOrder order = {};
  State state = State::active;
  bool is_noted = true;  // false: its note is being written, and nobody may be told of it yet
  // While active, but for one of a former process that waits to be begun anew.
  std::optional<RenderQueue::Ticket> ticket = {};
  Progress::State last = {};                  // what was told when it ended
  std::shared_ptr<StoredRender> result = {};  // of a done one that is not kept elsewhere
  std::string problem = {};                   // of a failed one
  std::chrono::steady_clock::time_point ended = {};
  std::unique_ptr<boost::asio::steady_timer> expiry = {};

  Progress::State progress() const { return ticket ? ticket->progress() : last; }
  /// Grows whenever there is something new to tell.
  std::uint64_t version() const;
};

/// The jobs: those under way and, for a while, those that have ended. Used by the I/O thread alone.
class Jobs {
 public:
  Jobs(boost::asio::io_context& context, const api::Limits& limits, Log& log, JobNotes& notes)
      : context_(context), limits_(limits), log_(log), notes_(notes) {}

  /// Throws: Refusal 503 if too many are under way.
  void refuse_if_full();
  /// A new job that keeps `ticket` until its render has ended. Throws: as refuse_if_full().
  std::shared_ptr<Job> add(JobOrder order, RenderQueue::Ticket ticket);
  /// A job that a former process had accepted, by its name; queued until begin() or settle().
  std::shared_ptr<Job> restore(JobOrder order);
  void begin(const std::shared_ptr<Job>& job, RenderQueue::Ticket ticket);
  /// Ends a restored job: done, or failed for `failure`.
  void settle(const std::shared_ptr<Job>& job, const std::exception_ptr& failure);
  /// Throws: Refusal 404.
  std::shared_ptr<Job> find(const std::string& name);
  /// Null if there is none (any more).
  std::shared_ptr<Job> look_up(const std::string& name);
  /// An active one no longer wants its render; an ended one is forgotten.
  void withdraw(const std::shared_ptr<Job>& job);
  /// From any thread.
  int active() const noexcept { return active_; }

  /// Idempotency keys: the job that a client's earlier request of this key became, if any.
  /// Throws: Refusal 422 if that request had another body (`fingerprint`).
  std::shared_ptr<Job> repeated(const std::string& key, const std::string& fingerprint);
  void remember(const std::string& key, const std::string& fingerprint, const std::string& job);

 private:
  struct Earlier {
    std::string fingerprint = {};
    std::string job = {};
  };
  boost::asio::awaitable<void> watch(std::shared_ptr<Job> job);
  std::shared_ptr<Job> known(JobOrder order);
  void end(Job& job, Job::State state);
  void fail(Job& job, const std::exception_ptr& failure);
  void forget(const std::shared_ptr<Job>& job);
  void forget_old();
  void bound_results();

  boost::asio::io_context& context_;
  const api::Limits& limits_;
  Log& log_;
  JobNotes& notes_;
  std::unordered_map<std::string, std::shared_ptr<Job>> jobs_ = {};
  std::deque<std::shared_ptr<Job>> ended_ = {};  // oldest first
  std::unordered_map<std::string, Earlier> keys_ = {};
  std::deque<std::string> key_order_ = {};  // oldest first
  std::atomic<int> active_ = 0;
};

/// What clients are told of `job`.
api::JobView view_of(const Job& job);

}  // namespace fstop::server
