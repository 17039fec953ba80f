#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "api/limits.h"
#include "api/problem.h"
#include "core/scene/scene.h"

namespace fstop::api {

/// A scene as read, its assets not yet loaded.
struct SceneDocument {
  Scene scene = {};
  std::string canonical = {};  // all defaults filled, sorted keys; title and description apart
};

/// Reads a scene object ("format": "fstop-scene/1"); faults are added to `faults`, their pointers
/// below `pointer` ("#" for a file, "#/scene" inside a request). Names of textures and materials
/// become indices, in the order of the names; objects and lights keep theirs.
/// `normalised`, unless null, becomes the object with all defaults filled.
/// With faults the result is incomplete and must not be used.
SceneDocument parse_scene(const nlohmann::json& value, std::string_view pointer,
                          const Limits& limits, FaultList& faults, nlohmann::json* normalised);

/// The same for the text of a scene file.
/// Throws: InvalidRequest with all faults, pointers from "#".
SceneDocument parse_scene_text(std::string_view text, const Limits& limits);

}  // namespace fstop::api
