#pragma once

#include <string>
#include <string_view>

#include "api/limits.h"
#include "api/render_request.h"
#include "core/study/accuracy_chart.h"

namespace fstop::api {

/// A request for a chart of speed against accuracy: every value checked, every default filled.
struct ChartRequest {
  /// What is photographed, as a render's request would say it; `spec` is that of `chart.shot`.
  RenderRequest picture = {};
  AccuracyChartSpec chart = {};
};

/// Reads {"scene", "camera", "image": {"width", "height"}, "effects", "illumination", "seed",
/// "methods", "samples", "max_errors", "reference": {"method", "samples", "replicates"}}; all but
/// scene and camera may be absent: 192 x 128 pixels, all methods, 1 to 64 samples a pixel by
/// doubling, targets of 0.03 and 0.01, four replicates of 256 samples. Throws: InvalidRequest with
/// every fault, as parse_render_request.
ChartRequest parse_chart_request(std::string_view body, const Limits& limits, SceneNames names);

/// The finished chart as JSON text. Its members but `cpu_s`, `wall_s` and `threads` are the same
/// for the same request.
std::string chart_json(const ChartRequest& request, const AccuracyChart& chart);

/// The same as a drawing: an SVG document.
std::string chart_svg(const ChartRequest& request, const AccuracyChart& chart);

}  // namespace fstop::api
