#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/limits.h"
#include "core/render/simulation.h"

namespace fstop::api {

/// A request for the numbers of a camera: no scene, no image.
struct OpticsRequest {
  SimulationSpec spec = {};
  std::optional<Length> coc_limit = {};  // absent: the sensor's diagonal / 1442
  std::vector<Length> object_distances = {};
};

/// Reads {"camera", "image", "coc_limit_mm", "object_distances_m", "quality", "effects"}; all but
/// the camera may be absent; the last two matter to the plan alone.
/// Throws: InvalidRequest with every fault.
OpticsRequest parse_optics_request(std::string_view body, const Limits& limits);

/// The camera's closed-form numbers, the pinhole optima at its image distance and the plan a
/// render would start from (its method null, with the reason as a warning, where no method models
/// what is asked for), as JSON text.
/// Throws: Error as optical_summary and plan_for.
std::string optics_json(const OpticsRequest& request);

}  // namespace fstop::api
