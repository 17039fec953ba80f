#pragma once

#include <cstddef>
#include <functional>
#include <set>
#include <span>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <string_view>

#include "api/cell_json.h"
#include "api/render_request.h"
#include "server/log.h"
#include "server/nats_queue.h"
#include "server/sweep_cells.h"

namespace fstop::server {

/// A part that cannot be made, so that the picture cannot be: says why as a problem (JSON).
class PartFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Has the parts of one cell's picture traced by the workers of a queue. What workers recorded for
/// an earlier attempt at the same cell is taken as it is.
class QueueParts : public PartTracer {
 public:
  struct Services {
    NatsQueue& queue;
    ContentStore& store;  // where orders and parts lie
    Log& log;
  };
  /// `cell`: the order of the whole cell; its scene must be named.
  QueueParts(Services services, api::CellOrder cell);

  int parts(double samples) const override;
  /// Waits for queue, store and workers as long as it takes. Throws: PartFailed, Error{cancelled};
  /// as ContentStore::put.
  void trace(std::span<const PartOrder> orders, const Take& take, const RunControl& run) override;

  /// Once nobody needs them: takes the parts out of the queue, its tables and the store.
  void tidy() noexcept;
  /// Parts that workers have traced.
  std::size_t traced() const noexcept { return traced_; }

 private:
  bool take(const PartOrder& order, const CellOutcome& outcome,
            const std::function<void(const TracedPart&)>& next);

  Services services_;
  api::CellOrder cell_;
  std::string key_;
  std::set<std::string> files_ = {};  // hashes of what lies in the store
  std::size_t traced_ = 0;
  int refused_ = 0;  // parts that were none
};

}  // namespace fstop::server
