#include "server/render_queue.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/error.h"
#include "server/http_message.h"
#include "server/workers.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
using SteadyClock = std::chrono::steady_clock;

constexpr double kLongestRetry_s = 120.0;
constexpr double kSmoothing = 0.2;  // weight of the newest render in the mean duration

}  // namespace

/// One render and those who wait for it. All members but `id`, `work` and `stop` are guarded by
/// the queue's mutex.
struct RenderQueue::Job {
  std::string id = {};
  Work work = {};
  std::stop_source stop = {};
  SteadyClock::time_point submitted = {};
  int interested = 0;
  bool ended = false;
  Result result = {};
  std::exception_ptr failure = {};
  std::vector<std::function<void()>> listeners = {};
};

RenderQueue::RenderQueue(int slots, int most_queued, int niceness)
    : slots_(slots), most_queued_(most_queued) {
  for (int i = 0; i < slots; ++i) {
    threads_.emplace_back([this, niceness](const std::stop_token& stop) {
      make_this_thread_nice(niceness);
      serve(stop);
    });
  }
}

RenderQueue::~RenderQueue() {
  close();
  cancel_all();
  for (std::jthread& thread : threads_) thread.request_stop();
}

RenderQueue::Ticket RenderQueue::submit(const std::string& id, Work work) {
  const std::lock_guard lock(mutex_);
  if (closed_) {
    throw Refusal(http::status::service_unavailable, "draining", "the server is about to stop")
        .with("Retry-After", "5");
  }
  if (const auto found = in_flight_.find(id); found != in_flight_.end()) {
    ++found->second->interested;
    ++counts_.joined;
    return {*this, found->second};
  }
  // A free slot counts as a place: its thread may not have woken yet.
  if (static_cast<int>(waiting_.size() + running_.size()) >= slots_ + most_queued_) {
    ++counts_.refused;
    throw Refusal(http::status::service_unavailable, "queue-full",
                  "as many requests wait as the queue holds")
        .with("Retry-After", std::to_string(retry_after_seconds()));
  }
  auto job = std::make_shared<Job>();
  job->id = id;
  job->work = std::move(work);
  job->submitted = SteadyClock::now();
  job->interested = 1;
  waiting_.push_back(job);
  in_flight_.emplace(id, job);
  work_there_.notify_one();
  return {*this, job};
}

// Until half of the queue has drained, at the pace of the latest renders: whoever comes back then
// finds room even if others came before.
int RenderQueue::retry_after_seconds() const {
  const double renders = 1.0 + static_cast<double>(waiting_.size()) / 2.0;
  const double seconds = renders * seconds_per_render_ / slots_;
  return static_cast<int>(std::ceil(std::clamp(seconds, 1.0, kLongestRetry_s)));
}

void RenderQueue::serve(const std::stop_token& stop) {
  for (;;) {
    std::shared_ptr<Job> job;
    {
      std::unique_lock lock(mutex_);
      if (!work_there_.wait(lock, stop, [this] { return !waiting_.empty(); })) return;
      job = std::move(waiting_.front());
      waiting_.pop_front();
      running_.push_back(job);
      ++counts_.started;
    }
    const auto start = SteadyClock::now();
    const double queued_ms =
        std::chrono::duration<double, std::milli>(start - job->submitted).count();
    Result result;
    std::exception_ptr failure;
    try {
      result = job->work(job->stop.get_token(), queued_ms);
    } catch (...) {
      failure = std::current_exception();
    }
    finish(job, std::move(result), failure, SteadyClock::now() - start);
  }
}

void RenderQueue::finish(const std::shared_ptr<Job>& job, Result result, std::exception_ptr failure,
                         SteadyClock::duration took) {
  std::vector<std::function<void()>> listeners;
  {
    const std::lock_guard lock(mutex_);
    std::erase(running_, job);
    if (const auto found = in_flight_.find(job->id);
        found != in_flight_.end() && found->second == job) {
      in_flight_.erase(found);
    }
    const double seconds = std::chrono::duration<double>(took).count();
    seconds_per_render_ += kSmoothing * (seconds - seconds_per_render_);
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
  std::erase(waiting_, job);
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
  std::deque<std::shared_ptr<Job>> dropped;
  {
    const std::lock_guard lock(mutex_);
    dropped.swap(waiting_);
    for (const auto& job : running_) job->stop.request_stop();
  }
  const auto failure =
      std::make_exception_ptr(Error(ErrorCode::cancelled, "the server stopped before its turn"));
  for (const auto& job : dropped) finish(job, nullptr, failure, {});
}

RenderQueue::Counts RenderQueue::counts() const {
  const std::lock_guard lock(mutex_);
  Counts counts = counts_;
  counts.queued = static_cast<int>(waiting_.size());
  counts.running = static_cast<int>(running_.size());
  return counts;
}

RenderQueue::Ticket::~Ticket() {
  if (job_) queue_->withdraw(job_);
}

asio::awaitable<void> RenderQueue::Ticket::ended() const {
  const auto executor = co_await asio::this_coro::executor;
  auto timer = std::make_shared<asio::steady_timer>(executor, SteadyClock::time_point::max());
  {
    const std::lock_guard lock(queue_->mutex_);
    if (job_->ended) co_return;
    // Posted, so that it runs on the waiting thread, after the wait below has begun.
    job_->listeners.emplace_back(
        [executor, timer] { asio::post(executor, [timer] { timer->cancel(); }); });
  }
  co_await timer->async_wait(asio::as_tuple(asio::use_awaitable));
}

RenderQueue::Result RenderQueue::Ticket::result() const {
  const std::lock_guard lock(queue_->mutex_);
  if (job_->failure) std::rethrow_exception(job_->failure);
  return job_->result;
}

}  // namespace fstop::server
