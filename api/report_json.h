#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/render/simulation.h"

namespace fstop::api {

/// How long the parts of one render took, milliseconds.
struct Timing {
  double render_ms = 0.0;
  double queue_ms = 0.0;
  double encode_ms = 0.0;
  double cpu_ms = 0.0;
};

/// The report of a render as JSON text; `normalised` is RenderRequest::normalised and becomes the
/// member "request". Infinity is "infinity"; doubles have the fewest digits (at most 17) that
/// give the same double again.
/// Throws: Error{internal} if a number of the report is not a number.
std::string report_json(std::string_view id, const RenderReport& report, const Timing& timing,
                        std::string_view normalised);

/// The same without times and request, which is the same for equal renders: for a sweep's manifest.
/// `scene_hash`: member "scene_sha256".
std::string lasting_report_json(const RenderReport& report, std::string_view scene_hash);
/// The member "alpha_error" of such a report; nothing where it has none.
std::optional<ImageError> alpha_error_of(std::string_view report);

}  // namespace fstop::api
