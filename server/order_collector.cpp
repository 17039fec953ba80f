#include "server/order_collector.h"

#include <algorithm>
#include <condition_variable>
#include <optional>
#include <utility>

#include "api/problem.h"
#include "api/secret.h"
#include "core/error.h"
#include "server/cell_records.h"

namespace fstop::server {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;
using Bucket = NatsQueue::Bucket;

constexpr std::size_t kMostOutstanding = 4096;  // orders in the queue and in hand
constexpr milliseconds kLookForOutcome{500};
constexpr milliseconds kLookAround{2000};   // where nothing comes: what is waited for
constexpr milliseconds kWatchAnew{10'000};  // where nothing comes: in case something was missed
constexpr milliseconds kPause{500};         // where the queue is not reached
constexpr std::size_t kMostWaiting = 64;    // workers whose waits are looked at

void pause_for(milliseconds time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, stop, time, [] { return false; });
}

}  // namespace

void OrderCollector::add(const std::string& key) {
  const std::lock_guard lock(adding_);
  added_.push_back(key);
}

// What was added meanwhile is to be published.
void OrderCollector::adopt() {
  const std::lock_guard lock(adding_);
  for (std::string& key : added_) {
    unpublished_.push_back(key);
    open_.emplace(std::move(key), count_++);
  }
  added_.clear();
}

void OrderCollector::until_done(const std::stop_token& stop,
                                const std::function<bool()>& may_come) {
  for (;;) {
    // Asked first: what came before the answer is adopted.
    const bool may = may_come && may_come();
    adopt();
    if ((open_.empty() && !may) || stop.stop_requested()) return;
    try {
      collect(stop, may_come);
    } catch (const QueueUnreachable& failure) {
      services_.log.warning("queue_unreachable",
                            {{"queue", services_.queue.address()}, {"why", failure.what()}});
      tell("the queue at " + services_.queue.address());
      pause_for(kPause, stop);
    } catch (const Error& failure) {
      if (failure.code() != ErrorCode::io_failure) throw;
      services_.log.warning("results_unreachable", {{"why", failure.what()}});
      tell("the results store");
      pause_for(kPause, stop);
    }
  }
}

// From what is recorded already on, for as long as nothing may have been missed.
void OrderCollector::collect(const std::stop_token& stop, const std::function<bool()>& may_come) {
  const std::uint64_t connections = services_.queue.connections();
  NatsQueue::Watch watch = services_.queue.watch(Bucket::outcomes, prefix_);
  while (!watch.is_up_to_date()) {
    if (const auto entry = watch.next(NatsQueue::kAnswerTime)) {
      take(*entry);
    } else if (!watch.is_up_to_date()) {
      throw QueueUnreachable("the outcomes so far do not come");
    }
    if (stop.stop_requested()) return;
  }
  // What is there already is not taken a second time. Another generation: the broker remembers
  // for a while what it was given, though it may have been withdrawn since.
  generation_ = api::random_hex(8);
  published_.clear();
  unpublished_.clear();
  for (const auto& [key, place] : open_) unpublished_.push_back(key);
  std::ranges::sort(unpublished_, {}, [this](const std::string& key) { return open_.at(key); });
  publish(stop);
  auto silent_since = Clock::now();
  auto looked = silent_since;
  while (!stop.stop_requested()) {
    const bool may = may_come && may_come();
    adopt();
    if (open_.empty() && !may) return;
    publish(stop);
    if (services_.queue.connections() != connections) return;
    if (const auto entry = watch.next(kLookForOutcome)) {
      silent_since = looked = Clock::now();
      if (take(*entry)) tell("");
      continue;
    }
    const auto now = Clock::now();
    if (now - silent_since >= kWatchAnew) return look_around();
    if (now - looked < kLookAround) continue;
    looked = now;
    look_around();
  }
}

// Whether it was one that was waited for.
bool OrderCollector::take(const NatsQueue::Entry& entry) {
  const auto& [key, value] = entry;
  if (!open_.contains(key)) return false;
  std::optional<CellOutcome> outcome;
  try {
    if (const auto text = whole_text(value, services_.store)) outcome = outcome_of(*text);
  } catch (const api::InvalidRequest& invalid) {
    services_.log.warning("outcome_malformed", {{"cell", key}, {"why", invalid.what()}});
  }
  if (!outcome || outcome->index != cell_index(key) || !calls_.take(key, *outcome)) {
    ++lost_;
    make_again(key);
    return false;
  }
  published_.erase(key);
  open_.erase(open_.find(key));
  return true;
}

// Of a store that has been lost since, or of nobody.
void OrderCollector::make_again(const std::string& key) {
  services_.log.warning("outcome_lost",
                        {{"cell", key}, {"why", "its files are not in this server's store"}});
  services_.queue.remove(Bucket::outcomes, key);
  services_.queue.remove(Bucket::attempts, key);
  published_.erase(key);
  unpublished_.push_back(key);
  generation_ = api::random_hex(8);
}

// Up to as many as the queue should hold.
void OrderCollector::publish(const std::stop_token& stop) {
  while (!unpublished_.empty() && published_.size() < kMostOutstanding && !stop.stop_requested()) {
    const std::string& key = unpublished_.front();
    if (open_.contains(key) && !published_.contains(key)) {
      services_.queue.publish(key, calls_.order(key), generation_);
      published_.insert(key);
    }
    unpublished_.pop_front();
  }
}

void OrderCollector::look_around() {
  const NatsQueue::Depth depth = services_.queue.depth();
  std::string what;
  for (const auto& [name, waits_for] : services_.queue.entries(Bucket::waiting, kMostWaiting)) {
    if (what.find(waits_for) == std::string::npos) what += (what.empty() ? "" : "; ") + waits_for;
  }
  if (what.empty() && depth.in_hand == 0 && depth.idle == 0) what = "workers";
  if (what.empty() && lost_ > 0) what = "workers whose --results names this server";
  lost_ = 0;
  tell(what);
}

void OrderCollector::tell(const std::string& what) {
  if (what == told_) return;
  told_ = what;
  if (calls_.waiting) calls_.waiting(what);
}

void OrderCollector::tidy(bool outcomes) noexcept {
  try {
    services_.queue.withdraw(prefix_);
    if (!outcomes) return;
    services_.queue.remove_all(Bucket::outcomes, prefix_);
    services_.queue.remove_all(Bucket::attempts, prefix_);
  } catch (const QueueUnreachable& failure) {
    services_.log.warning("queue_unreachable",
                          {{"queue", services_.queue.address()}, {"why", failure.what()}});
  }
}

}  // namespace fstop::server
