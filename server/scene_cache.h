#pragma once

#include <condition_variable>
#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "api/render_request.h"
#include "api/scene_store.h"
#include "server/memory_file.h"

namespace fstop::server {

/// Scenes by content hash, as bytes that worker processes share and, where this process traces
/// rays itself, ready to be traced: read and built once while they are in use, and kept within a
/// bound on their bytes.
class SceneCache {
 public:
  SceneCache(const api::SceneStore& store, std::size_t max_bytes)
      : store_(store), max_bytes_(max_bytes) {}

  /// The content hash of the scene that `request` names or holds: from memory while its files are
  /// unchanged (by size and time), else by reading them. Throws: as SceneStore::load.
  std::string hash(const api::RenderRequest& request);

  /// Rays that a point of the scene may take (api::LoadedScene), of one that is kept; else 1.
  double rays_of_a_point(const std::string& hash);

  /// The scene for a worker process to build. Throws: as SceneStore::load.
  std::shared_ptr<const MemoryFile> shared(const api::RenderRequest& request,
                                           const std::string& hash);

  /// The scene, built if it is not there. Throws: as SceneStore::load and RayScene.
  std::shared_ptr<const RayScene> scene(const api::RenderRequest& request, const std::string& hash);

  /// Scenes read from files, and scenes built here, since the start.
  struct Counts {
    int loaded = 0;
    int built = 0;
  };
  Counts counts() const;

 private:
  // What a request says of its scene, and the state of the files it stands for.
  struct Source {
    std::string key = {};    // of the name or the inline object
    std::string state = {};  // of its files
  };
  struct Entry {
    std::string hash = {};
    std::vector<Source> sources = {};
    std::shared_ptr<const MemoryFile> shared = {};
    std::shared_ptr<const RayScene> built = {};
    bool building = false;
    double rays_of_a_point = 1.0;
    std::size_t bytes = 0;
  };

  Source source_of(const api::RenderRequest& request) const;
  std::list<Entry>::iterator find_hash(const std::string& hash);
  std::shared_ptr<const MemoryFile> keep(api::LoadedScene loaded, const Source& source);
  void evict();

  const api::SceneStore& store_;
  std::size_t max_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable built_;
  std::list<Entry> entries_ = {};  // the one used last first
  Counts counts_ = {};
};

}  // namespace fstop::server
