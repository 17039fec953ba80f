#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "api/limits.h"
#include "api/scene_json.h"
#include "core/encode/image_codec.h"
#include "core/render/simulation.h"

namespace fstop::api {

class ObjectReader;

/// What a scene's string may be.
enum class SceneNames {
  stored_only,      ///< over HTTP: the name of a stored scene, [a-z0-9-]{1,64}
  stored_or_files,  ///< command line: also a file, if it contains '/' or ends in ".json"
};

/// A request for one image: every value checked, every default filled.
struct RenderRequest {
  std::variant<std::string, SceneDocument> scene = {};
  SimulationSpec spec = {};  // spec.outputs: sorted, always with color
  ImageFormat format = ImageFormat::png;
  Precision precision = Precision::single;
  /// What the id covers beside the scene's content: the request with all defaults filled, without
  /// scene, format and precision; sorted keys, shortest digits that give the same doubles.
  std::string canonical = {};
  /// The same with the scene (its name, or the object itself): for the report.
  std::string normalised = {};
};

/// Reads the body of a render request.
/// Throws: InvalidRequest with every fault: malformed_json (400) if the text is not JSON,
///         over_budget (422) where only the work asked for is too much, else invalid_request (422).
RenderRequest parse_render_request(std::string_view body, const Limits& limits, SceneNames names);

/// The required member "scene" of a request: a name, or the scene itself; faults go to `faults`.
std::variant<std::string, SceneDocument> read_scene(ObjectReader& root, SceneNames names,
                                                    const Limits& limits, FaultList& faults);

/// Whether `name` can name a stored scene: [a-z0-9-]{1,64}.
bool is_scene_name(std::string_view name);

/// Whether the command line takes `scene` for a file's path: it contains '/' or ends in ".json".
bool names_a_file(std::string_view scene);

}  // namespace fstop::api
