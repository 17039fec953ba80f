#pragma once

#include <functional>
#include <stop_token>

#include "api/cell_json.h"
#include "server/cell_work.h"
#include "server/cost_model.h"
#include "server/log.h"
#include "server/nats_queue.h"
#include "server/patient_store.h"
#include "server/sweep_cells.h"

namespace fstop::server {

/// Cells that are too large for one worker: this process makes the picture, and the workers of a
/// queue trace its parts. Its bytes and its report are those of one machine: parts hold exact sums,
/// and all that is decided of the picture is decided here.
class LargeCells {
 public:
  struct Services {
    NatsQueue& queue;
    ContentStore& store;  // where orders and parts lie
    ContentStore& files;  // where the finished files go
    Log& log;
    CellTools tools;  // what this process has of its own
    const CostModel& costs;
    double split_cpu_s = 0.0;  // predicted processor time above which a cell is one; 0: none is
  };
  explicit LargeCells(Services services) : services_(services) {}

  /// By its predicted cost. A cell whose request is wrong is none.
  bool is_large(const SweepCell& cell) const;
  /// Whether it can be cut: looks at its scene. A cell that cannot be made cannot be cut.
  bool is_made_in_parts(const SweepCell& cell, const std::stop_token& stop) const;

  /// Makes one cell whose order is `order`, and calls `done` with its outcome; what its parts left
  /// goes away afterwards. Throws: Error{cancelled}, leaving them for another attempt; what is no
  /// fault of the cell; what `done` throws.
  void make(const SweepCell& cell, const api::CellOrder& order,
            const std::function<void(CellOutcome)>& done, const WaitingFor& waiting,
            const std::stop_token& stop) const;

 private:
  Services services_;
};

}  // namespace fstop::server
