#pragma once

#include <filesystem>
#include <list>
#include <memory>
#include <string>

#include "api/cell_json.h"
#include "api/limits.h"
#include "api/scene_store.h"
#include "server/cell_work.h"
#include "server/sweep_cells.h"

namespace fstop::server {

/// The scenes of a worker: its own, and those of orders that differ, fetched from the content
/// store; the few used last stay, in a folder that goes away with this. One thread.
class WorkerScenes {
 public:
  /// `folder`: of the worker's own scenes. Throws: Error{io_failure} where no temporary folder can
  /// be made.
  WorkerScenes(const std::filesystem::path& folder, const api::Limits& limits);
  ~WorkerScenes();
  WorkerScenes(const WorkerScenes&) = delete;
  WorkerScenes& operator=(const WorkerScenes&) = delete;

  /// Those in which `cell` finds the scene of `order`; null where there are none.
  /// Throws: as ContentStore::get; Error{io_failure}, Refusal 507 where they cannot be written.
  CellScenes* with(const SweepCell& cell, const api::CellOrder& order, ContentStore& store);

 private:
  struct Kept {
    Kept(std::string scene_hash, const std::filesystem::path& folder, const api::Limits& limits)
        : hash(std::move(scene_hash)), store({folder}, limits), scenes(store, limits) {}
    std::string hash;
    api::SceneStore store;
    CellScenes scenes;
  };
  std::string hash_in(CellScenes& scenes, const SweepCell& cell) const;
  bool fetch(const SweepCell& cell, const api::CellOrder& order, ContentStore& store);

  const api::Limits& limits_;
  Kept own_;
  std::filesystem::path folder_;
  std::list<std::unique_ptr<Kept>> fetched_ = {};  // the one used last first
};

}  // namespace fstop::server
