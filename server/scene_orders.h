#pragma once

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "api/limits.h"
#include "api/scene_store.h"
#include "server/sweep_cells.h"

namespace fstop::server {

/// The scene that a cell must be made with, for workers that may have another one of its name.
struct SceneOrder {
  std::string hash = {};             // empty: the cell brings its scene with it
  std::vector<CellFile> files = {};  // in the content store: scene.json and what it names
};

/// The scenes that cells name, each read and put into the store once. Any thread.
class SceneOrders {
 public:
  SceneOrders(const api::SceneStore& scenes, const api::Limits& limits, ContentStore& store)
      : scenes_(scenes), limits_(limits), store_(store) {}
  /// Throws: as api::SceneStore::load and ContentStore::put; Error{unsupported} for a scene that is
  ///         named by a file, which workers elsewhere do not have.
  SceneOrder of(const SweepCell& cell);

 private:
  const api::SceneStore& scenes_;
  const api::Limits& limits_;
  ContentStore& store_;
  std::mutex mutex_ = {};
  std::map<std::string, SceneOrder> by_name_ = {};
};

}  // namespace fstop::server
