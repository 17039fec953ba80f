#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "api/limits.h"
#include "api/render_id.h"
#include "api/render_request.h"
#include "api/scene_assets.h"

namespace fstop::api {

struct SceneSummary {
  std::string name = {};
  std::string title = {};
  std::string description = {};
};

/// The scenes kept in folders: NAME/scene.json beside its assets. Holds only paths and limits:
/// what it answers is read anew, so that a scene put there is seen; callers may cache.
class SceneStore {
 public:
  /// Of two scenes of one name the earlier folder's is meant. Absent folders hold no scenes.
  SceneStore(std::vector<std::filesystem::path> folders, const Limits& limits);

  /// All scenes by name. One that cannot be read says so in its description.
  std::vector<SceneSummary> list() const;

  /// The text of NAME/scene.json. Throws: Error{not_found} naming the scene.
  std::string text(std::string_view name) const;

  /// NAME/scene.json and every file that it names, each once: all that another place needs to have
  /// the same scene. Throws: Error{not_found}, InvalidRequest, Error{over_budget} beyond
  /// limits.scene_file_bytes, Error{io_failure}.
  std::vector<AssetBytes> files(std::string_view name) const;

  /// The scene that a request names or holds. The files of an inline scene are `scene/file` of
  /// stored scenes.
  /// Throws: InvalidRequest: pointer "#/scene" for a stored scene that does not exist or is
  ///         broken; the member that names the file ("#/scene/textures/card/file") for an asset of
  ///         an inline scene that is missing, truncated or too large.
  LoadedScene load(const RenderRequest& request) const;

  /// The bytes of a file that `name`, scene/file, calls.
  /// Throws: Error{not_found, bad_path, io_failure, over_budget}.
  std::vector<std::byte> file(const std::string& name) const;

  /// The folder of scene NAME; empty if there is none.
  std::filesystem::path folder_of(std::string_view name) const;
  /// Whether a folder other than `folder` holds scene NAME.
  bool is_beside(const std::filesystem::path& folder, std::string_view name) const;

 private:
  std::vector<std::filesystem::path> folders_;
  Limits limits_;
};

/// The scene of a request file: files and inline assets are relative to `request_folder`, plain
/// names are looked up in `store`.
/// Throws: as SceneStore::load.
LoadedScene load_beside(const RenderRequest& request, const std::filesystem::path& request_folder,
                        const SceneStore& store, const Limits& limits);

/// {"scenes": [{"name", "title", "description"}]}
std::string scene_list_json(const std::vector<SceneSummary>& scenes);

}  // namespace fstop::api
