#include "server/nats_cell_maker.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <map>
#include <mutex>
#include <new>
#include <thread>
#include <utility>

#include "api/cell_json.h"
#include "api/problem.h"
#include "api/render_id.h"
#include "core/error.h"
#include "server/cell_records.h"
#include "server/order_collector.h"

namespace fstop::server {

// The cells of one call that are still to come.
class NatsCellMaker::Run {
 public:
  Run(Services& services, const std::vector<SweepCell>& cells, const Listener& listener)
      : services_(services),
        listener_(listener),
        whole_({.queue = services.queue, .store = services.store, .log = services.log},
               cells.front().sweep + ".",
               {.order = [this](const std::string& key) { return order_text(cell_of(key)); },
                .take = [this](const std::string&, CellOutcome& outcome) { return take(outcome); },
                .waiting = [this](std::string_view what) { waiting(what); }}) {
    for (const SweepCell& cell : cells) {
      if (cell.sweep != cells.front().sweep)
        throw Error(ErrorCode::invalid_request, "cells of several sweeps cannot be made at once");
      const bool is_large = services_.large != nullptr && services_.large->is_large(cell);
      cells_.emplace(cell.index, &cell);
      if (is_large) {
        large_.push_back(&cell);
      } else {
        whole_.add(cell_key(cell.sweep, cell.index));
      }
    }
  }

  void until_done(const std::stop_token& stop) {
    std::stop_source ended;  // by the caller, or by a failure
    const std::stop_callback pass_on(stop, [&] { ended.request_stop(); });
    std::exception_ptr failure;
    {
      std::atomic<bool> may_come = !large_.empty();
      std::jthread beside;
      const auto make_large = [&] {
        try {
          make_all_large(ended.get_token());
        } catch (...) {
          // What fails once all is to stop was stopped.
          if (!ended.stop_requested()) failure = std::current_exception();
          ended.request_stop();
        }
        may_come = false;
      };
      if (may_come) beside = std::jthread(make_large);
      try {
        whole_.until_done(ended.get_token(), [&] { return may_come.load(); });
      } catch (...) {
        ended.request_stop();
        if (beside.joinable()) beside.join();
        throw;
      }
    }
    if (failure) std::rethrow_exception(failure);
    // What was told of this sweep has served; what nobody has begun need not be.
    const bool was_stopped = stop.stop_requested();
    if (was_stopped && services_.leaves_cells && services_.leaves_cells()) return;
    whole_.tidy(!was_stopped);
  }

 private:
  const SweepCell& cell_of(const std::string& key) const {
    return *cells_.at(cell_index(key).value());
  }

  // Whether its files are there.
  bool take(CellOutcome& outcome) {
    const auto is_kept = [&](const CellFile& file) { return services_.is_kept(file); };
    if (!std::ranges::all_of(outcome.files, is_kept)) return false;
    done(std::move(outcome));
    return true;
  }

  void done(CellOutcome outcome) {
    const std::lock_guard lock(telling_);
    listener_.done(std::move(outcome));
  }
  void waiting(std::string_view what) {
    const std::lock_guard lock(telling_);
    listener_.waiting(what);
  }

  // One at a time: each takes the memory of its picture here, and has all workers. Those that
  // cannot be cut are known, and in the queue, before the first is begun.
  void make_all_large(const std::stop_token& stop) {
    std::vector<const SweepCell*> cut;
    for (const SweepCell* cell : large_) {
      if (services_.large->is_made_in_parts(*cell, stop)) {
        cut.push_back(cell);
      } else {
        whole_.add(cell_key(cell->sweep, cell->index));
      }
    }
    for (const SweepCell* cell : cut) {
      throw_if_stopped({.stop = stop});
      try {
        services_.large->make(
            *cell, order(*cell), [this](CellOutcome outcome) { done(std::move(outcome)); },
            [this](std::string_view what) { waiting(what); }, stop);
      } catch (const std::bad_alloc&) {  // some worker may have the memory
        whole_.add(cell_key(cell->sweep, cell->index));
      }
    }
  }

  api::CellOrder order(const SweepCell& cell) const {
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
    if (api::to_json(order).size() <= NatsQueue::kMostMessageBytes) return order;
    order.stored_request = services_.store.put(cell.request);
    order.request.clear();
    return order;
  }
  std::string order_text(const SweepCell& cell) const { return api::to_json(order(cell)); }

  // Of a scene that is wrong the workers say what is wrong with it.
  SceneOrder scene_of(const SweepCell& cell) const {
    try {
      return services_.scene_of(cell);
    } catch (const api::InvalidRequest&) {
      return {};
    }
  }

  Services& services_;
  const Listener& listener_;
  std::mutex telling_ = {};
  std::map<std::uint32_t, const SweepCell*> cells_ = {};
  std::vector<const SweepCell*> large_ = {};
  OrderCollector whole_;
};

void NatsCellMaker::make(const std::vector<SweepCell>& cells, const Listener& listener,
                         std::stop_token stop) {
  if (cells.empty()) return;
  Run(services_, cells, listener).until_done(stop);
}

}  // namespace fstop::server
