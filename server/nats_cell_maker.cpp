#include "server/nats_cell_maker.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <utility>

#include "api/cell_json.h"
#include "api/problem.h"
#include "api/render_id.h"
#include "api/secret.h"
#include "core/error.h"
#include "server/cell_records.h"

namespace fstop::server {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;
using Bucket = NatsQueue::Bucket;

constexpr std::size_t kMostOutstanding = 4096;  // cells in the queue and in hand
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

// The cells of one call that are still to come.
class NatsCellMaker::Run {
 public:
  Run(Services& services, const std::vector<SweepCell>& cells, const Listener& listener)
      : services_(services), listener_(listener), prefix_(cells.front().sweep + ".") {
    for (const SweepCell& cell : cells) {
      if (cell.sweep != cells.front().sweep)
        throw Error(ErrorCode::invalid_request, "cells of several sweeps cannot be made at once");
      open_.emplace(cell.index, &cell);
    }
  }

  void until_done(const std::stop_token& stop) {
    while (!open_.empty() && !stop.stop_requested()) {
      try {
        collect(stop);
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
    tidy(stop.stop_requested());
  }

 private:
  // From what is recorded already on, for as long as nothing may have been missed.
  void collect(const std::stop_token& stop) {
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
    for (const auto& [index, cell] : open_) unpublished_.push_back(index);
    publish(stop);
    auto silent_since = Clock::now();
    auto looked = silent_since;
    while (!open_.empty() && !stop.stop_requested()) {
      if (services_.queue.connections() != connections) return;
      if (const auto entry = watch.next(kLookForOutcome)) {
        silent_since = looked = Clock::now();
        if (take(*entry)) tell("");
        publish(stop);
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
  bool take(const NatsQueue::Entry& entry) {
    const auto& [key, value] = entry;
    const auto index = cell_index(key);
    const auto open = index ? open_.find(*index) : open_.end();
    if (open == open_.end()) return false;
    std::optional<CellOutcome> outcome;
    try {
      if (const auto text = whole_text(value, services_.store)) outcome = outcome_of(*text);
    } catch (const api::InvalidRequest& invalid) {
      services_.log.warning("outcome_malformed", {{"cell", key}, {"why", invalid.what()}});
    }
    const auto is_kept = [&](const CellFile& file) { return services_.is_kept(file); };
    if (!outcome || outcome->index != *index || !std::ranges::all_of(outcome->files, is_kept)) {
      // Of a store that has been lost since, or of nobody: the cell is made again.
      services_.log.warning("outcome_lost", {{"cell", key}});
      services_.queue.remove(Bucket::outcomes, key);
      services_.queue.remove(Bucket::attempts, key);
      published_.erase(*index);
      unpublished_.push_back(*index);
      generation_ = api::random_hex(8);
      return false;
    }
    published_.erase(*index);
    open_.erase(open);
    listener_.done(std::move(*outcome));
    return true;
  }

  // Up to as many as the queue should hold.
  void publish(const std::stop_token& stop) {
    while (!unpublished_.empty() && published_.size() < kMostOutstanding &&
           !stop.stop_requested()) {
      const std::uint32_t index = unpublished_.front();
      if (const auto open = open_.find(index); open != open_.end() && !published_.contains(index)) {
        services_.queue.publish(cell_key(open->second->sweep, index), order(*open->second),
                                generation_);
        published_.insert(index);
      }
      unpublished_.pop_front();
    }
  }

  std::string order(const SweepCell& cell) {
    api::CellOrder order{.engine = std::string(api::engine_version()),
                         .sweep = cell.sweep,
                         .index = cell.index,
                         .request = cell.request};
    if (services_.scene_of) {
      const SceneOrder scene = scene_of(cell);
      order.scene = scene.hash;
      for (const CellFile& file : scene.files)
        order.scene_files.push_back({file.name, file.sha256, file.bytes});
    }
    std::string text = api::to_json(order);
    if (text.size() <= NatsQueue::kMostMessageBytes) return text;
    order.stored_request = services_.store.put(cell.request);
    order.request.clear();
    return api::to_json(order);
  }

  // Of a scene that is wrong the workers say what is wrong with it.
  SceneOrder scene_of(const SweepCell& cell) const {
    try {
      return services_.scene_of(cell);
    } catch (const api::InvalidRequest&) {
      return {};
    }
  }

  void look_around() {
    const NatsQueue::Depth depth = services_.queue.depth();
    std::string what;
    for (const auto& [name, waits_for] : services_.queue.entries(Bucket::waiting, kMostWaiting)) {
      if (what.find(waits_for) == std::string::npos) what += (what.empty() ? "" : "; ") + waits_for;
    }
    if (what.empty() && depth.in_hand == 0 && depth.idle == 0) what = "workers";
    tell(what);
  }

  void tell(const std::string& what) {
    if (what == told_) return;
    told_ = what;
    listener_.waiting(what);
  }

  // What was told of this sweep has served; what nobody has begun need not be.
  void tidy(bool was_stopped) {
    if (was_stopped && services_.leaves_cells && services_.leaves_cells()) return;
    try {
      services_.queue.withdraw(prefix_);
      if (was_stopped) return;
      services_.queue.remove_all(Bucket::outcomes, prefix_);
      services_.queue.remove_all(Bucket::attempts, prefix_);
    } catch (const QueueUnreachable& failure) {
      services_.log.warning("queue_unreachable",
                            {{"queue", services_.queue.address()}, {"why", failure.what()}});
    }
  }

  Services& services_;
  const Listener& listener_;
  std::string prefix_;
  std::map<std::uint32_t, const SweepCell*> open_ = {};
  std::deque<std::uint32_t> unpublished_ = {};
  std::set<std::uint32_t> published_ = {};  // in the queue or in hand
  std::string generation_ = {};
  std::string told_ = {};
};

void NatsCellMaker::make(const std::vector<SweepCell>& cells, const Listener& listener,
                         std::stop_token stop) {
  if (cells.empty()) return;
  Run(services_, cells, listener).until_done(stop);
}

}  // namespace fstop::server
