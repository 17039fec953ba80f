#pragma once

#include <string>

#include "core/study/accuracy_chart.h"

namespace fstop {

/// What stands above a chart.
struct ChartCaption {
  std::string title = "Time against true error";
  std::string subtitle = {};  // scene, camera, size
};

/// The chart as an SVG document of two panels: (a) processor time against true error, a line for
/// every method and a star for every pick of the planner, beside its target and its estimate;
/// (b) the error that pictures tell of themselves, estimate and 95 % bound, against the true one.
/// All axes are logarithmic. Colours are told apart by colour-blind readers, and each has a marker
/// of its own; the background is white whatever the page's is.
/// Series are drawn by the names that points have: whatever was measured on the same scene can be
/// added to `points`.
std::string accuracy_chart_svg(const AccuracyChart& chart, const ChartCaption& caption);

}  // namespace fstop
