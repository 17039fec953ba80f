#include "server/queue_cell_maker.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "api/problem.h"
#include "api/render_id.h"
#include "core/error.h"
#include "server/cell_work.h"
#include "server/http_message.h"
#include "server/patient_store.h"

namespace fstop::server {
namespace {

constexpr auto kLookAgain = std::chrono::milliseconds(20);
constexpr auto kMoment = std::chrono::microseconds(100);
constexpr auto kQueueFull = std::chrono::seconds(1);

[[noreturn]] void throw_stopped() { throw Error(ErrorCode::cancelled, "the sweep was stopped"); }

/// Told by the work that it is about to end.
class Bell {
 public:
  void ring() {
    const std::lock_guard lock(mutex_);
    has_rung_ = true;
    rung_.notify_all();
  }
  // Returns once it has rung, `stop` is requested or some time is over.
  void wait(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    if (has_rung_) {  // the queue still has to take the result
      lock.unlock();
      std::this_thread::sleep_for(kMoment);
      return;
    }
    rung_.wait_for(lock, stop, kLookAgain, [this] { return has_rung_; });
  }

 private:
  std::mutex mutex_ = {};
  std::condition_variable_any rung_ = {};
  bool has_rung_ = false;
};

/// Rings at the end of a scope.
class Ringer {
 public:
  explicit Ringer(Bell& bell) : bell_(bell) {}
  ~Ringer() { bell_.ring(); }
  Ringer(const Ringer&) = delete;
  Ringer& operator=(const Ringer&) = delete;

 private:
  Bell& bell_;
};

void wait_for(std::chrono::milliseconds time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, stop, time, [] { return false; });
  if (stop.stop_requested()) throw_stopped();
}

CellOutcome refused_cell(const SweepCell& cell, const Refusal& refusal) {
  return {.index = cell.index,
          .problem = api::to_json(api::http_problem(static_cast<int>(refusal.status()),
                                                    refusal.slug(), refusal.detail()))};
}

}  // namespace

/// The listener, told by one lane at a time.
class QueueCellMaker::Telling {
 public:
  explicit Telling(const Listener& listener) : listener_(listener) {}
  void done(CellOutcome outcome) const {
    const std::lock_guard lock(mutex_);
    listener_.done(std::move(outcome));
  }
  void waiting(std::string_view what) const {
    const std::lock_guard lock(mutex_);
    listener_.waiting(what);
  }

 private:
  const Listener& listener_;
  mutable std::mutex mutex_ = {};
};

void QueueCellMaker::make(const std::vector<SweepCell>& cells, const Listener& listener,
                          std::stop_token stop) {
  std::stop_source ended;  // by the caller, or by a lane that failed
  const std::stop_callback pass_on(stop, [&] { ended.request_stop(); });
  const Telling telling(listener);
  PatientStore store(
      store_, [&](std::string_view what) { telling.waiting(what); }, ended.get_token());
  std::atomic<std::size_t> next = 0;
  std::mutex failing;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < cells.size() && !ended.stop_requested(); i = next++)
        telling.done(made(cells[i], store, telling, ended.get_token()));
    } catch (...) {
      const std::lock_guard lock(failing);
      // What fails once all is to stop was stopped.
      if (!failure && !ended.stop_requested()) failure = std::current_exception();
      ended.request_stop();
    }
  };
  {
    std::vector<std::jthread> lanes;
    for (int i = 0; i < services_.limits.concurrent_renders; ++i) lanes.emplace_back(work);
  }
  if (failure) std::rethrow_exception(failure);
}

CellOutcome QueueCellMaker::made(const SweepCell& cell, ContentStore& store, const Telling& telling,
                                 const std::stop_token& stop) {
  try {
    api::Limits limits = services_.limits;
    limits.body_bytes = limits.scene_bytes;
    const auto request = std::make_shared<const api::RenderRequest>(
        api::parse_render_request(cell.request, limits, api::SceneNames::stored_only));
    RenderTask task{.request = request,
                    .scene_hash = services_.scenes.hash(*request),
                    .format = request->format};
    task.id = api::render_id(request->canonical, task.scene_hash, api::engine_version());
    task.cost = services_.costs.predict(request->spec, task.scene_hash);
    const auto render = rendered(task, telling, stop);
    return finished_cell(cell, *request, render->photograph, task.scene_hash, store);
  } catch (const Error& error) {
    if (auto failed = failed_cell(cell, error)) return *std::move(failed);
    throw;
  } catch (const Refusal& refusal) {
    // The render took too long, or ended its worker process twice.
    return refused_cell(cell, refusal);
  }
}

std::shared_ptr<StoredRender> QueueCellMaker::rendered(const RenderTask& task,
                                                       const Telling& telling,
                                                       const std::stop_token& stop) {
  if (auto there = services_.renders.load(task.id)) return there;
  std::shared_ptr<StoredRender> render;
  const auto attempt = [&] {
    for (bool waited = false;; waited = true) {
      try {
        render = awaited(task, stop);
        if (waited) telling.waiting("");
        return;
      } catch (const Refusal& refusal) {
        if (refusal.slug() == "draining") throw_stopped();
        if (refusal.slug() != "queue-full") throw;
      }
      telling.waiting("a place in the queue");
      wait_for(kQueueFull, stop);
    }
  };
  when_there_is_room(
      attempt, [&](std::string_view what) { telling.waiting(what); }, stop);
  return render;
}

std::shared_ptr<StoredRender> QueueCellMaker::awaited(const RenderTask& task,
                                                      const std::stop_token& stop) {
  // The work may outlive this: others may want it, too. And a render that another client has begun
  // rings no bell of ours: so it is looked after as well.
  const auto bell = std::make_shared<Bell>();
  const RenderQueue::Ticket ticket = services_.queue.submit(
      {.id = task.id,
       .client = client_,
       .cost_s = task.cost.wall_s,
       .memory_bytes = task.cost.memory_bytes,
       .is_small = false,  // those slots are for people who wait
       .work = [&work = services_.work, task, bell](const RenderQueue::Turn& turn) {
         const Ringer at_the_end(*bell);
         return work.render(task, turn);
       }});
  while (!ticket.has_ended() && !stop.stop_requested()) bell->wait(stop);
  if (stop.stop_requested()) throw_stopped();
  return std::static_pointer_cast<StoredRender>(ticket.result());
}

}  // namespace fstop::server
