#include "server/queue_worker.h"

#include <algorithm>
#include <charconv>
#include <condition_variable>
#include <optional>
#include <thread>
#include <utility>

#include "api/cell_json.h"
#include "api/problem.h"
#include "api/render_id.h"
#include "core/error.h"
#include "server/cell_records.h"
#include "server/http_message.h"

namespace fstop::server {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFetchTime{2000};
constexpr milliseconds kLongestPause{5000};
constexpr milliseconds kTellAgain{10'000};
constexpr milliseconds kAfterFailure{1000};
constexpr milliseconds kForOthers{3000};  // before a cell that is not for this worker comes again

void pause_for(milliseconds time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, stop, time, [] { return false; });
}

Error abandoned() { return {ErrorCode::cancelled, "stopped in the midst of a cell"}; }

CellOutcome given_up(std::uint32_t index, int attempts) {
  const api::Problem problem =
      api::http_problem(500, "cell-abandoned",
                        std::to_string(attempts) +
                            " attempts at this cell failed or ended their worker; the workers' "
                            "logs say how");
  return {.index = index, .problem = api::to_json(problem)};
}

class AtEnd {
 public:
  explicit AtEnd(std::function<void()> act) : act_(std::move(act)) {}
  ~AtEnd() { act_(); }
  AtEnd(const AtEnd&) = delete;
  AtEnd& operator=(const AtEnd&) = delete;

 private:
  std::function<void()> act_;
};

}  // namespace

void QueuePatience::wait(std::string_view what, std::string_view why, const std::stop_token& stop) {
  if (what_ != what) {
    what_ = what;
    pause_ = kFirstPause;
    told_ = {};
    log_.warning("waiting", {{"for", what}, {"why", why}});
  }
  const auto now = std::chrono::steady_clock::now();
  if (now - told_ >= kTellAgain) {
    told_ = now;
    try {
      queue_.put(NatsQueue::Bucket::waiting, name_, what);
    } catch (const QueueUnreachable&) {  // it may be what is waited for
    }
  }
  pause_for(pause_, stop);
  pause_ = std::min(2 * pause_, kLongestPause);
}

void QueuePatience::over() {
  if (what_.empty()) return;
  log_.event("goes_on", {{"waited_for", what_}});
  what_.clear();
  try {
    queue_.remove(NatsQueue::Bucket::waiting, name_);
  } catch (const QueueUnreachable&) {  // it forgets by itself
  }
}

// Tells the queue that the cell is still in hand, from a thread of its own, whatever the worker
// waits for.
class QueueWorker::Heartbeat {
 public:
  Heartbeat(Delivery& delivery, milliseconds period)
      : thread_([&delivery, period](const std::stop_token& done) {
          while (!done.stop_requested()) {
            pause_for(period, done);
            if (!done.stop_requested()) delivery.in_progress();
          }
        }) {}

 private:
  std::jthread thread_;
};

// Waits where the store is not reached or has no room.
class QueueWorker::WaitingStore : public ContentStore {
 public:
  explicit WaitingStore(QueueWorker& worker) : worker_(worker) {}

 private:
  template <typename Act>
  auto waiting(const Act& act) {
    for (;;) {
      std::string what = "the results store at " + worker_.options_.store;
      std::string why;
      try {
        auto result = act();
        worker_.patience_.over();
        return result;
      } catch (const Refusal& refusal) {
        if (refusal.status() != http::status::insufficient_storage) throw;
        what = "disk space at " + what;
        why = refusal.detail();
      } catch (const Error& error) {
        if (error.code() != ErrorCode::io_failure) throw;
        why = error.what();
      }
      worker_.patience_.wait(what, why, worker_.abandon_);
      if (worker_.abandon_.stop_requested()) throw abandoned();
    }
  }

  QueueWorker& worker_;

 public:
  std::string put(std::string_view bytes) override {
    return waiting([&] { return worker_.services_.store.put(bytes); });
  }
  std::optional<std::string> get(std::string_view sha256) override {
    return waiting([&] { return worker_.services_.store.get(sha256); });
  }
};

QueueWorker::QueueWorker(Services services, Options options)
    : services_(std::move(services)),
      options_(std::move(options)),
      patience_(services_.queue, services_.log, options_.name) {}

QueueWorker::~QueueWorker() = default;

// What `act` returns, however long the queue is away.
template <typename Act>
auto QueueWorker::patiently(const Act& act) {
  for (;;) {
    try {
      return act();
    } catch (const QueueUnreachable& failure) {
      patience_.wait("the queue at " + services_.queue.address(), failure.what(), abandon_);
      if (abandon_.stop_requested()) throw abandoned();
    }
  }
}

void QueueWorker::run(std::stop_token stop, std::stop_token abandon) {
  stop_ = std::move(stop);
  abandon_ = std::move(abandon);
  while (!stop_.stop_requested()) {
    try {
      auto delivery = services_.queue.next(kFetchTime);
      if (!delivery) {
        patience_.over();
      } else if (stop_.stop_requested()) {
        delivery->again(milliseconds(0));
      } else {
        serve(*delivery);
      }
    } catch (const QueueUnreachable& failure) {
      patience_.wait("the queue at " + services_.queue.address(), failure.what(), stop_);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::cancelled || !abandon_.stop_requested()) throw;
    }
  }
}

// No sign of life may come after these.
void QueueWorker::finish(Delivery& delivery) {
  heartbeat_.reset();
  patiently([&] { delivery.done(); });
}

void QueueWorker::give_back(Delivery& delivery, milliseconds delay) {
  heartbeat_.reset();
  delivery.again(delay);
}

void QueueWorker::serve(Delivery& delivery) {
  const std::string key = delivery.key();
  const auto index = cell_index(key);
  if (!index) {  // not of ours, whoever put it there
    services_.log.warning("cell_malformed", {{"cell", key}, {"why", "its subject is none"}});
    return delivery.done();
  }
  heartbeat_ = std::make_unique<Heartbeat>(delivery, services_.queue.ack_wait() / 3);
  const AtEnd silence([this] { heartbeat_.reset(); });  // before the delivery goes
  try {
    const api::CellOrder order = api::parse_cell_order(delivery.text(), api::Limits{});
    if (order_key(order) != key)
      throw api::InvalidRequest(api::FieldFault{"#", "is not the cell that its subject names"});
    attempt(delivery, order);
  } catch (const api::InvalidRequest& invalid) {
    services_.log.warning("cell_malformed", {{"cell", key}, {"why", invalid.what()}});
    record(key, {.index = *index, .problem = api::to_json(api::problem(invalid))});
    finish(delivery);
  }
}

void QueueWorker::attempt(Delivery& delivery, const api::CellOrder& order) {
  const std::string key = order_key(order);
  if (order.engine != api::engine_version())
    return leave_to_others(delivery, "a worker of " + order.engine);
  const bool is_first =
      patiently([&] { return services_.queue.create(NatsQueue::Bucket::attempts, key, "1"); });
  // A cell that nobody has begun has no outcome: most cells are not looked up.
  if (!is_first &&
      patiently([&] { return services_.queue.get(NatsQueue::Bucket::outcomes, key); })) {
    services_.log.event("cell_known", {{"cell", key}});
    return finish(delivery);
  }
  const int attempts = is_first ? 1 : counted_attempt(key);
  if (attempts > options_.most_attempts) {
    services_.log.warning("cell_abandoned", {{"cell", key}, {"attempts", attempts - 1}});
    record(key, given_up(order.index, options_.most_attempts));
    return finish(delivery);
  }
  services_.log.event("cell_begun", {{"cell", key}, {"attempt", attempts}});
  std::optional<CellOutcome> outcome;
  try {
    WaitingStore store(*this);
    const SweepCell cell{order.sweep, order.index, request_of(order, store)};
    if (!services_.has_scene(cell, order, store)) {
      uncount_attempt(key);
      return leave_to_others(delivery, "a worker that has the scene of cell " + key);
    }
    outcome = made(cell, order, store);
    record(key, *outcome);
  } catch (const std::exception& exception) {
    if (abandon_.stop_requested()) {
      uncount_attempt(key);
      give_back(delivery, milliseconds(0));
      throw abandoned();
    }
    services_.log.warning("cell_failed",
                          {{"cell", key}, {"attempt", attempts}, {"why", exception.what()}});
    return give_back(delivery, attempts * kAfterFailure);
  }
  finish(delivery);
  services_.log.event("cell_done", {{"cell", key}, {"failed", outcome->problem.empty() ? 0 : 1}});
  patience_.over();
}

// It is no fault of the cell: no attempt is counted.
void QueueWorker::leave_to_others(Delivery& delivery, const std::string& whom) {
  give_back(delivery, kForOthers);
  patience_.wait(whom, "this one would make other bytes", stop_);
}

CellOutcome QueueWorker::made(const SweepCell& cell, const api::CellOrder& order,
                              ContentStore& store) {
  if (order.part.empty()) return services_.make_cell(cell, store, abandon_);
  const auto part = store.get(order.part);
  if (!part) throw Error(ErrorCode::not_found, "its order is not in the results store");
  return services_.make_part(cell, *part, store, abandon_);
}

std::string QueueWorker::request_of(const api::CellOrder& order, ContentStore& store) {
  if (order.stored_request.empty()) return order.request;
  auto request = store.get(order.stored_request);
  if (!request) throw Error(ErrorCode::not_found, "its request is not in the results store");
  return *std::move(request);
}

// How many there are with this one. What a process began that ended meanwhile is counted.
int QueueWorker::counted_attempt(const std::string& key) {
  return patiently([&] {
    for (;;) {
      const auto value = services_.queue.get(NatsQueue::Bucket::attempts, key);
      if (!value) {
        if (services_.queue.create(NatsQueue::Bucket::attempts, key, "1")) return 1;
        continue;
      }
      const int next = count_of(value->text) + 1;
      if (services_.queue.update(NatsQueue::Bucket::attempts, key, std::to_string(next),
                                 value->revision)) {
        return next;
      }
    }
  });
}

void QueueWorker::uncount_attempt(const std::string& key) {
  try {
    const auto value = services_.queue.get(NatsQueue::Bucket::attempts, key);
    if (!value) return;
    const int before = std::max(0, count_of(value->text) - 1);
    services_.queue.update(NatsQueue::Bucket::attempts, key, std::to_string(before),
                           value->revision);
  } catch (const QueueUnreachable&) {  // then it counts
  }
}

// The first outcome of a cell stays: another attempt's has the same bytes.
void QueueWorker::record(const std::string& key, const CellOutcome& outcome) {
  WaitingStore store(*this);
  const std::string text = short_text(outcome_text(outcome), store);
  patiently([&] { services_.queue.create(NatsQueue::Bucket::outcomes, key, text); });
}

}  // namespace fstop::server
