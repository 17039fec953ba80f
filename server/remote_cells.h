#pragma once

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "api/limits.h"
#include "server/cell_work.h"
#include "server/commands.h"
#include "server/content_folder.h"
#include "server/http_file_store.h"
#include "server/log.h"
#include "server/nats_queue.h"
#include "server/sweep_cells.h"

namespace fstop::server {

/// The hashes of the scenes that cells name, each read once. Any thread.
class SceneHashes {
 public:
  SceneHashes(CellScenes& scenes, const api::Limits& limits) : scenes_(scenes), limits_(limits) {}
  /// Empty for a cell that brings its scene with it. Throws: as CellScenes::scene.
  std::string of(const SweepCell& cell);

 private:
  CellScenes& scenes_;
  const api::Limits& limits_;
  std::mutex mutex_ = {};
  std::map<std::string, std::string> by_name_ = {};
};

/// Makes cells by workers elsewhere for whoever has no server: what the workers put into a results
/// store is fetched into a folder.
class RemoteCells : public CellMaker {
 public:
  /// Throws: as NatsQueue, HttpFileStore and secret_of.
  RemoteCells(const RemotePlace& place, ContentFolder& files, CellScenes& scenes,
              const api::Limits& limits);
  /// Waits for room in the folder, too. Throws: as NatsCellMaker::make, but for a full disk.
  void make(const std::vector<SweepCell>& cells, const Listener& listener,
            std::stop_token stop) override;

 private:
  ContentFolder& files_;
  SceneHashes hashes_;
  Log log_;
  HttpFileStore store_;
  NatsQueue queue_;
};

}  // namespace fstop::server
