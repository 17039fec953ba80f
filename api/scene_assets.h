#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "api/limits.h"
#include "api/scene_json.h"
#include "core/scene/scene.h"
#include "core/scene/scene_file.h"

namespace fstop::api {

/// A scene with its assets in memory.
struct LoadedScene {
  Scene scene = {};
  std::string hash = {};         // of its text and its assets' bytes: scene_hash
  double rays_of_a_point = 1.0;  // at most, roughly: most_rays_of_a_point()
};

/// Reads and decodes every file of `document` through `read`, each file once. What is wrong with
/// an asset is a fault at every member that names it ("<pointer>/textures/card/file").
/// Throws: InvalidRequest with the faults of all assets; Error{io_failure} as it comes.
LoadedScene load_scene(SceneDocument document, const AssetReader& read, std::string_view pointer,
                       const Limits& limits);

}  // namespace fstop::api
