#pragma once

#include <filesystem>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

#include "api/limits.h"
#include "api/render_request.h"
#include "api/scene_store.h"
#include "core/parallel.h"
#include "server/sweep_cells.h"

namespace fstop::server {

/// Scenes of cells, ready to be traced: the few used last stay, since cells of a sweep that follow
/// each other mostly show one scene. Their files must not change meanwhile. Any thread.
class CellScenes {
 public:
  /// `folder`: where scenes and assets that requests name by file are relative to, as those of
  /// `fstop render`; without it names are those of stored scenes alone, as over HTTP.
  CellScenes(const api::SceneStore& store, const api::Limits& limits,
             std::optional<std::filesystem::path> folder = {})
      : store_(store), limits_(limits), folder_(std::move(folder)) {}

  struct Ready {
    std::string hash = {};  // of the scene's content
    std::shared_ptr<const RayScene> scene = {};
  };
  /// Throws: as api::SceneStore::load.
  Ready scene(const api::RenderRequest& request);
  api::SceneNames names() const noexcept {
    return folder_ ? api::SceneNames::stored_or_files : api::SceneNames::stored_only;
  }

 private:
  struct Entry {
    std::string key = {};
    Ready ready = {};
  };
  const api::SceneStore& store_;
  const api::Limits& limits_;
  std::optional<std::filesystem::path> folder_;
  std::mutex mutex_ = {};  // held while a scene is read: others most likely wait for the same one
  std::list<Entry> entries_ = {};  // the one used last first
};

/// What cells are made with.
struct CellTools {
  const api::Limits& limits;
  CellScenes& scenes;
  WorkerPool& workers;
};

/// Makes a cell: reads its request, loads its scene, renders, puts every file into `store`. Of a
/// request that cannot be rendered the outcome holds the problem.
/// Throws: Error{cancelled} once `stop` is requested, Error{io_failure}, std::bad_alloc; as
///         ContentStore::put.
CellOutcome make_cell(const SweepCell& cell, const CellTools& tools, ContentStore& store,
                      std::stop_token stop = {});

/// Traces the part of a cell's picture that `order`, the bytes of a PartOrder, asks for, and puts
/// it into `store` as the outcome's one file. Throws: as make_cell.
CellOutcome make_part(const SweepCell& cell, std::string_view order, const CellTools& tools,
                      ContentStore& store, std::stop_token stop = {});

/// The layers to render for a cell's files.
SimulationSpec cell_spec(const api::RenderRequest& request);

/// The outcome of a cell that was rendered, by whomever: image.png (or .exr, ...: as the request
/// says), and layers.exr where more than colour was asked for and the image cannot hold it.
/// Throws: as ContentStore::put.
CellOutcome finished_cell(const SweepCell& cell, const api::RenderRequest& request,
                          const Photograph& photograph, const std::string& scene_hash,
                          ContentStore& store);

/// The outcome of a cell that cannot be made; nothing where `exception` is no fault of the request,
/// so that another attempt may succeed.
std::optional<CellOutcome> failed_cell(const SweepCell& cell, const std::exception& exception);

/// Makes cells with the threads of this process, two cells at a time, so that one is encoded while
/// the other is rendered. Where the store has no room it waits for it.
class LocalCellMaker : public CellMaker {
 public:
  LocalCellMaker(const CellTools& tools, ContentStore& store) : tools_(tools), store_(store) {}
  /// Throws: as make_cell, but for a full store.
  void make(const std::vector<SweepCell>& cells, const Listener& listener,
            std::stop_token stop) override;

 private:
  CellTools tools_;
  ContentStore& store_;
};

}  // namespace fstop::server
