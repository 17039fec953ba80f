#include "server/render_queue.h"

#include <algorithm>
#include <cmath>
#include <list>
#include <optional>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/error.h"
#include "server/http_message.h"
#include "server/thread_priority.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
using SteadyClock = std::chrono::steady_clock;

constexpr double kLongestRetry_s = 120.0;
constexpr double kSmoothing = 0.2;     // weight of the newest render in the pace
constexpr double kLeastCost_s = 1e-3;  // what costs less says nothing of the pace
constexpr double kPaceBounds[] = {0.02, 50.0};

double seconds_since(SteadyClock::time_point start) {
  return std::chrono::duration<double>(SteadyClock::now() - start).count();
}

}  // namespace

/// One render and those who wait for it. All members but `id`, `client`, `work`, `stop` and
/// `progress` are guarded by the queue's mutex.
struct RenderQueue::Job {
  std::string id = {};
  std::string client = {};
  double cost_s = 0.0;
  double memory_bytes = 0.0;
  bool is_small = false;
  Work work = {};
  std::stop_source stop = {};
  Progress progress = {};
  SteadyClock::time_point submitted = {};
  int interested = 0;
  bool runs = false;
  bool is_express = false;  // runs on such a slot
  bool ended = false;
  Result result = {};
  std::exception_ptr failure = {};
  std::list<std::function<void()>> listeners = {};
};

RenderQueue::RenderQueue(const Shape& shape) : shape_(shape) {
  for (int i = 0; i < shape.slots + shape.express_slots; ++i) {
    const bool is_express = i >= shape.slots;
    threads_.emplace_back([this, is_express](const std::stop_token& stop) {
      make_this_thread_nice(is_express ? shape_.express_niceness : shape_.niceness);
      serve(stop, is_express);
    });
  }
}

RenderQueue::~RenderQueue() {
  close();
  cancel_all();
  for (std::jthread& thread : threads_) thread.request_stop();
}

RenderQueue::Ticket RenderQueue::submit(Submission submission) {
  const std::lock_guard lock(mutex_);
  if (closed_) {
    throw Refusal(http::status::service_unavailable, "draining", "the server is about to stop")
        .with("Retry-After", "5");
  }
  if (const auto found = in_flight_.find(submission.id); found != in_flight_.end()) {
    ++found->second->interested;
    ++counts_.joined;
    return {*this, found->second};
  }
  refuse_if_full(submission.client);
  auto job = std::make_shared<Job>();
  job->id = std::move(submission.id);
  job->client = std::move(submission.client);
  job->cost_s = std::max(submission.cost_s, kLeastCost_s);
  job->memory_bytes = submission.memory_bytes;
  job->is_small = submission.is_small;
  job->work = std::move(submission.work);
  job->submitted = SteadyClock::now();
  job->interested = 1;
  Line& line = lines_[job->client];
  if (line.empty()) turns_.push_back(job->client);
  line.push_back(job);
  in_flight_.emplace(job->id, job);
  work_there_.notify_all();  // not every thread may take it
  return {*this, job};
}

void RenderQueue::refuse_if_full(const std::string& client) {
  const auto refuse = [this](http::status status, const char* detail) {
    ++counts_.refused;
    throw Refusal(status, "queue-full", detail)
        .with("Retry-After", std::to_string(retry_after_seconds()));
  };
  // A free slot counts as a place: its thread may not have woken yet.
  if (waiting() + static_cast<int>(running_.size()) >= shape_.slots + shape_.most_queued)
    refuse(http::status::service_unavailable, "as many requests wait as the queue holds");
  const auto of_client = [&](const std::shared_ptr<Job>& job) { return job->client == client; };
  auto own = std::count_if(running_.begin(), running_.end(), of_client);
  if (const auto line = lines_.find(client); line != lines_.end())
    own += static_cast<std::ptrdiff_t>(line->second.size());
  if (own >= shape_.slots + shape_.most_queued_per_client)
    refuse(http::status::too_many_requests, "as many requests of this client wait as one may have");
}

int RenderQueue::waiting() const {
  std::size_t count = 0;
  for (const auto& [client, line] : lines_) count += line.size();
  return static_cast<int>(count);
}

// At the pace of the latest renders.
double RenderQueue::backlog_s() const {
  double cost_s = 0.0;
  for (const auto& [client, line] : lines_) {
    for (const auto& job : line) cost_s += job->cost_s;
  }
  for (const auto& job : running_) {
    const double left = 1.0 - job->progress.state().fraction;
    cost_s += job->cost_s * left;
  }
  return cost_s * seconds_per_cost_ / shape_.slots;
}

// Until half of the queue has drained: whoever comes back then finds room even if others came
// before.
int RenderQueue::retry_after_seconds() const {
  return static_cast<int>(std::ceil(std::clamp(0.5 * backlog_s(), 1.0, kLongestRetry_s)));
}

// The next client's first render that this kind of slot takes; null if there is none, or no memory
// for it.
std::shared_ptr<RenderQueue::Job> RenderQueue::next(bool is_express) {
  for (const std::string& client : turns_) {
    for (const auto& job : lines_.at(client)) {
      if (is_express && !job->is_small) continue;
      // What is small goes where small work was before: there the scene may be ready.
      if (!is_express && job->is_small && busy_express_ < shape_.express_slots) continue;
      // What has no room waits for it, and is not passed by what has.
      return fits(*job) ? job : nullptr;
    }
  }
  return nullptr;
}

bool RenderQueue::fits(const Job& job) const {
  return running_.empty() || running_bytes_ + job.memory_bytes <= shape_.memory_bytes;
}

// Out of its line; its client then waits for the next turn behind the others.
void RenderQueue::drop(const std::shared_ptr<Job>& job) {
  const auto line = lines_.find(job->client);
  if (line == lines_.end() || std::erase(line->second, job) == 0) return;
  std::erase(turns_, job->client);
  if (line->second.empty()) {
    lines_.erase(line);
  } else {
    turns_.push_back(job->client);
  }
}

void RenderQueue::serve(const std::stop_token& stop, bool is_express) {
  for (;;) {
    std::shared_ptr<Job> job;
    {
      std::unique_lock lock(mutex_);
      const auto is_there = [&] { return (job = next(is_express)) != nullptr; };
      if (!work_there_.wait(lock, stop, is_there)) return;
      drop(job);
      if (is_express) {
        job->is_express = true;
        ++busy_express_;
        work_there_.notify_all();  // small work that waits may go elsewhere now
      }
      job->runs = true;
      running_.push_back(job);
      running_bytes_ += job->memory_bytes;
      ++counts_.started;
    }
    const auto start = SteadyClock::now();
    const double queued_ms =
        std::chrono::duration<double, std::milli>(start - job->submitted).count();
    Result result;
    std::exception_ptr failure;
    try {
      job->progress.begin();
      result = job->work({.stop = job->stop.get_token(),
                          .queued_ms = queued_ms,
                          .is_express = is_express,
                          .progress = &job->progress});
    } catch (...) {
      failure = std::current_exception();
    }
    finish(job, std::move(result), failure, SteadyClock::now() - start);
  }
}

void RenderQueue::finish(const std::shared_ptr<Job>& job, Result result, std::exception_ptr failure,
                         SteadyClock::duration took) {
  std::list<std::function<void()>> listeners;
  {
    const std::lock_guard lock(mutex_);
    if (std::erase(running_, job) > 0) {
      running_bytes_ -= job->memory_bytes;
      if (job->is_express) --busy_express_;
      work_there_.notify_all();  // there may be room now
    }
    if (const auto found = in_flight_.find(job->id);
        found != in_flight_.end() && found->second == job) {
      in_flight_.erase(found);
    }
    if (job->runs && !failure) {
      const double pace = std::clamp(std::chrono::duration<double>(took).count() / job->cost_s,
                                     kPaceBounds[0], kPaceBounds[1]);
      seconds_per_cost_ += kSmoothing * (pace - seconds_per_cost_);
    }
    job->work = nullptr;
    job->result = std::move(result);
    job->failure = std::move(failure);
    job->ended = true;
    listeners.swap(job->listeners);
  }
  for (const auto& listener : listeners) listener();
}

void RenderQueue::withdraw(const std::shared_ptr<Job>& job) {
  const std::lock_guard lock(mutex_);
  if (--job->interested > 0 || job->ended) return;
  ++counts_.withdrawn;
  job->stop.request_stop();
  drop(job);
  // A new request of the same id must not share a render that is being stopped.
  if (const auto found = in_flight_.find(job->id);
      found != in_flight_.end() && found->second == job) {
    in_flight_.erase(found);
  }
}

void RenderQueue::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
}

void RenderQueue::cancel_all() {
  std::map<std::string, Line> dropped;
  {
    const std::lock_guard lock(mutex_);
    dropped.swap(lines_);
    turns_.clear();
    for (const auto& job : running_) job->stop.request_stop();
  }
  const auto failure =
      std::make_exception_ptr(Error(ErrorCode::cancelled, "the server stopped before its turn"));
  for (const auto& [client, line] : dropped) {
    for (const auto& job : line) finish(job, nullptr, failure, {});
  }
}

RenderQueue::Counts RenderQueue::counts() const {
  const std::lock_guard lock(mutex_);
  Counts counts = counts_;
  counts.queued = waiting();
  counts.running = static_cast<int>(running_.size());
  counts.backlog_s = backlog_s();
  for (const auto& [client, line] : lines_)
    counts.oldest_s = std::max(counts.oldest_s, seconds_since(line.front()->submitted));
  return counts;
}

// Clients take turns: of every other one as many go before as of its own, and one more where its
// turn comes first.
int RenderQueue::place_of(const Job& job) const {
  const auto own = lines_.find(job.client);
  if (job.runs || job.ended || own == lines_.end()) return 0;
  const auto at = std::find_if(own->second.begin(), own->second.end(),
                               [&](const auto& other) { return other.get() == &job; });
  const auto before = at - own->second.begin();
  std::ptrdiff_t place = before + 1;
  bool comes_first = true;
  for (const std::string& client : turns_) {
    if (client == job.client) {
      comes_first = false;
      continue;
    }
    const auto others = static_cast<std::ptrdiff_t>(lines_.at(client).size());
    place += std::min(others, before + (comes_first ? 1 : 0));
  }
  return static_cast<int>(place);
}

RenderQueue::Ticket::~Ticket() {
  if (job_) queue_->withdraw(job_);
}

asio::awaitable<void> RenderQueue::Ticket::ended() const {
  const auto executor = co_await asio::this_coro::executor;
  auto timer = std::make_shared<asio::steady_timer>(executor, SteadyClock::time_point::max());
  // Listens while the wait below lasts, however that ends.
  struct Listening {
    Listening(RenderQueue& of, std::shared_ptr<Job> to) : queue(of), job(std::move(to)) {}
    ~Listening() {
      const std::lock_guard lock(queue.mutex_);
      if (!job->ended) job->listeners.erase(place);
    }
    Listening(const Listening&) = delete;
    Listening& operator=(const Listening&) = delete;
    RenderQueue& queue;
    std::shared_ptr<Job> job;
    std::list<std::function<void()>>::iterator place = {};
  };
  std::optional<Listening> listening;
  {
    const std::lock_guard lock(queue_->mutex_);
    if (job_->ended) co_return;
    listening.emplace(*queue_, job_);
    // Posted, so that it runs on the waiting thread, after the wait below has begun.
    listening->place = job_->listeners.insert(job_->listeners.end(), [executor, timer] {
      asio::post(executor, [timer] { timer->cancel(); });
    });
  }
  co_await timer->async_wait(asio::as_tuple(asio::use_awaitable));
}

bool RenderQueue::Ticket::has_ended() const {
  const std::lock_guard lock(queue_->mutex_);
  return job_->ended;
}

RenderQueue::Result RenderQueue::Ticket::result() const {
  const std::lock_guard lock(queue_->mutex_);
  if (job_->failure) std::rethrow_exception(job_->failure);
  return job_->result;
}

int RenderQueue::Ticket::place() const {
  const std::lock_guard lock(queue_->mutex_);
  return queue_->place_of(*job_);
}

Progress::State RenderQueue::Ticket::progress() const { return job_->progress.state(); }

}  // namespace fstop::server
