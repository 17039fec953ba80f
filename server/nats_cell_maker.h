#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "server/large_cells.h"
#include "server/log.h"
#include "server/nats_queue.h"
#include "server/scene_orders.h"
#include "server/sweep_cells.h"

namespace fstop::server {

/// Makes cells by workers elsewhere: puts them into a queue and collects the outcomes that the
/// workers record. What was recorded while nobody collected it is found; what is in the queue
/// already is not put there again. Large cells are made beside the others, one at a time, each by
/// many workers.
class NatsCellMaker : public CellMaker {
 public:
  struct Services {
    NatsQueue& queue;
    ContentStore& store;  // where the workers put files, and large requests lie
    Log& log;
    /// Whether a file that a worker has put is there.
    std::function<bool(const CellFile&)> is_kept;
    /// The scene that a cell must be made with; absent: what each worker finds.
    std::function<SceneOrder(const SweepCell&)> scene_of = {};
    /// Whether cells stay in the queue where `stop` is requested now: of a server that ends and
    /// will come again. Absent: they do not.
    std::function<bool()> leaves_cells = {};
    /// Makes those cells that are too large for one worker; null: none is.
    const LargeCells* large = nullptr;
  };
  explicit NatsCellMaker(Services services) : services_(std::move(services)) {}

  /// All cells are of one sweep. Where `stop` is requested, its cells leave the queue, but for
  /// leaves_cells. Waits for the queue, the store (Error{io_failure}) and workers as long as it
  /// takes. Throws: Error{invalid_request} for cells of several sweeps; as ContentStore::put.
  void make(const std::vector<SweepCell>& cells, const Listener& listener,
            std::stop_token stop) override;

 private:
  class Run;
  Services services_;
};

}  // namespace fstop::server
