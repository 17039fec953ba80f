#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "api/limits.h"
#include "api/scene_store.h"
#include "server/cell_work.h"
#include "server/commands.h"
#include "server/content_folder.h"
#include "server/cost_model.h"
#include "server/http_file_store.h"
#include "server/log.h"
#include "server/nats_queue.h"
#include "server/scene_orders.h"
#include "server/sweep_cells.h"

namespace fstop::server {

/// Makes cells by workers elsewhere for whoever has no server: what the workers put into a results
/// store is fetched into a folder.
class RemoteCells : public CellMaker {
 public:
  /// What cells too large for one worker are made with, and from what cost on they are.
  struct Splitting {
    CellTools tools;
    const CostModel& costs;
    double cpu_s = 0.0;  // LargeCells::Services::split_cpu_s
  };
  /// Throws: as NatsQueue, HttpFileStore and secret_of.
  RemoteCells(const RemotePlace& place, ContentFolder& files, const api::SceneStore& scenes,
              const Splitting& splitting);
  /// Waits for room in the folder, too. Throws: as NatsCellMaker::make, but for a full disk.
  void make(const std::vector<SweepCell>& cells, const Listener& listener,
            std::stop_token stop) override;

 private:
  ContentFolder& files_;
  Splitting splitting_;
  Log log_;
  HttpFileStore store_;
  NatsQueue queue_;
  SceneOrders scenes_;
};

/// Makes cells by workers elsewhere for a server, which keeps their files itself.
class ServedCells : public CellMaker {
 public:
  struct Services {
    NatsQueue& queue;
    ContentFolder& files;  // what PUT /v1/files writes to
    const api::SceneStore& scenes;
    const api::Limits& limits;
    Log& log;
    WorkerPool& workers;                // of what this process does of large cells
    const CostModel& costs;             // from which on
    double split_cpu_s;                 // they are large: LargeCells::Services
    const std::atomic<bool>& draining;  // then cells stay in the queue: the next server goes on
  };
  explicit ServedCells(const Services& services) : services_(services) {}
  /// Throws: as NatsCellMaker::make.
  void make(const std::vector<SweepCell>& cells, const Listener& listener,
            std::stop_token stop) override;

 private:
  Services services_;
};

}  // namespace fstop::server
