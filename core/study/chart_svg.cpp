#include "core/study/chart_svg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/study/log_axis.h"
#include "core/study/svg_writer.h"

namespace fstop {
namespace {

constexpr double kWidth = 1080.0;
constexpr double kHeight = 580.0;
constexpr double kMarkerRadius = 4.2;
constexpr std::string_view kInk = "#222222";
constexpr std::string_view kFaint = "#5c5c5c";  // 6.7:1 on white
constexpr std::string_view kGrid = "#e4e4e4";

// Okabe and Ito's palette without its yellow, which white swallows.
constexpr std::array<std::string_view, 7> kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                      "#e69f00", "#56b4e9", "#000000"};
constexpr std::array<Marker, 7> kMarkers = {Marker::circle,  Marker::square, Marker::triangle,
                                            Marker::diamond, Marker::wedge,  Marker::cross,
                                            Marker::pentagon};

struct SeriesLook {
  std::string_view colour = kInk;
  Marker marker = Marker::circle;
};

SeriesLook look_of(std::size_t series) {
  const std::size_t round = series / kColours.size();
  return {kColours[series % kColours.size()], kMarkers[(series + round) % kMarkers.size()]};
}

std::vector<std::string> series_names(const AccuracyChart& chart) {
  std::vector<std::string> names;
  const auto add = [&](const std::string& name) {
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  };
  for (const AccuracyPoint& point : chart.points) add(point.method);
  for (const PlannerPick& pick : chart.picks) add(pick.point.method);
  return names;
}

std::string rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

std::string label_of(const AccuracyPoint& point) {
  std::string label = point.method + ", " + short_number(point.cost.samples_mean) +
                      " samples a pixel: true error " + (point.truth.resolved ? "" : "at most ") +
                      rounded(point.truth.rmse_at_most);
  if (point.estimate) label += ", estimate " + rounded(*point.estimate);
  if (point.upper_95) label += ", 95 % bound " + rounded(*point.upper_95);
  return label + ", " + rounded(point.cost.cpu_seconds) + " CPU s";
}

std::string label_of(const PlannerPick& pick) {
  return "max_error " + short_number(pick.max_error) + ": " + label_of(pick.point);
}

std::string description_of(const AccuracyChart& chart) {
  std::string text = "Two logarithmic panels. Processor time against true error: ";
  for (const std::string& name : series_names(chart)) {
    const auto is_own = [&](const AccuracyPoint& point) { return point.method == name; };
    const auto first = std::ranges::find_if(chart.points, is_own);
    if (first == chart.points.end()) continue;
    const auto last = std::find_if(chart.points.rbegin(), chart.points.rend(), is_own);
    text += name + " from " + rounded(first->truth.rmse_at_most) + " in " +
            rounded(first->cost.cpu_seconds) + " s to " + rounded(last->truth.rmse_at_most) +
            " in " + rounded(last->cost.cpu_seconds) + " s; ";
  }
  if (!chart.picks.empty()) text += "the planner's picks: ";
  for (const PlannerPick& pick : chart.picks) text += label_of(pick) + "; ";
  return text + "and estimates against true errors.";
}

// A rectangle of the drawing with its two axes.
struct Panel {
  SvgPoint corner = {};  // top left
  double width = 0.0;
  double height = 0.0;
  LogAxis x;
  LogAxis y;

  SvgPoint at(double x_value, double y_value) const {
    return {x.position(x_value), y.position(y_value)};
  }
  double right() const { return corner.x + width; }
  double bottom() const { return corner.y + height; }
};

Panel panel_of(SvgPoint corner, double width, double height, const std::vector<double>& x,
               const std::vector<double>& y) {
  return {corner, width, height, LogAxis(x, corner.x, corner.x + width),
          LogAxis(y, corner.y + height, corner.y)};
}

void draw_axes(SvgWriter& svg, const Panel& panel, std::string_view title, std::string_view x_name,
               std::string_view y_name) {
  for (const AxisTick& tick : panel.x.ticks()) {
    const double x = panel.x.position(tick.value);
    const double wide = tick.label.empty() ? 0.6 : 1.2;
    svg.line({x, panel.corner.y}, {x, panel.bottom()}, {.stroke = kGrid, .stroke_width = wide});
    svg.text({x, panel.bottom() + 17.0}, tick.label, {.anchor = TextAnchor::middle});
  }
  for (const AxisTick& tick : panel.y.ticks()) {
    const double y = panel.y.position(tick.value);
    const double wide = tick.label.empty() ? 0.6 : 1.2;
    svg.line({panel.corner.x, y}, {panel.right(), y}, {.stroke = kGrid, .stroke_width = wide});
    svg.text({panel.corner.x - 7.0, y + 4.0}, tick.label, {.anchor = TextAnchor::end});
  }
  svg.text({panel.corner.x, panel.corner.y - 10.0}, title, {.size = 13.0, .bold = true});
  svg.text({panel.corner.x + 0.5 * panel.width, panel.bottom() + 38.0}, x_name,
           {.anchor = TextAnchor::middle, .size = 13.0});
  svg.text({panel.corner.x - 56.0, panel.corner.y + 0.5 * panel.height}, y_name,
           {.anchor = TextAnchor::middle, .size = 13.0, .upright = true});
}

void draw_frame(SvgWriter& svg, const Panel& panel) {
  svg.rectangle(panel.corner, panel.width, panel.height, {.stroke = kInk});
}

// Filled where the truth is known; else hollow, at the most that it can be.
void draw_marker(SvgWriter& svg, const SeriesLook& look, SvgPoint where, bool is_filled) {
  svg.marker(look.marker, where, kMarkerRadius,
             {.fill = is_filled ? look.colour : std::string_view("#ffffff"),
              .stroke = is_filled ? std::string_view("#ffffff") : look.colour,
              .stroke_width = is_filled ? 0.8 : 1.4});
}

void draw_star(SvgWriter& svg, const SeriesLook& look, SvgPoint where, bool is_filled) {
  svg.marker(Marker::star, where, 4.7,
             {.fill = is_filled ? look.colour : std::string_view("#ffffff"),
              .stroke = is_filled ? kInk : look.colour,
              .stroke_width = is_filled ? 1.0 : 1.4});
}

// One chart on its way to paper.
class Drawing {
 public:
  Drawing(const AccuracyChart& chart, const ChartCaption& caption)
      : chart_(chart),
        names_(series_names(chart)),
        svg_(kWidth, kHeight, caption.title, description_of(chart)) {
    svg_.rectangle({0, 0}, kWidth, kHeight, {.fill = "#ffffff"});
    svg_.text({20, 30}, caption.title, {.size = 18.0, .bold = true});
    svg_.text({20, 50}, caption.subtitle, {.size = 12.0, .colour = kFaint});
  }

  std::string draw() && {
    draw_legend();
    draw_times();
    draw_estimates();
    draw_footer();
    return std::move(svg_).finish();
  }

 private:
  SeriesLook look(const std::string& method) const {
    return look_of(static_cast<std::size_t>(std::ranges::find(names_, method) - names_.begin()));
  }

  std::vector<double> true_errors() const {
    std::vector<double> values;
    for (const AccuracyPoint& point : chart_.points) values.push_back(point.truth.rmse_at_most);
    for (const PlannerPick& pick : chart_.picks) values.push_back(pick.point.truth.rmse_at_most);
    return values;
  }

  void draw_legend();
  void draw_times();
  void draw_targets(const Panel& panel);
  void draw_curve(const Panel& panel, const std::string& method);
  void draw_estimates();
  void draw_estimate(const Panel& panel, const AccuracyPoint& point, bool is_pick);
  void draw_footer();

  const AccuracyChart& chart_;
  std::vector<std::string> names_;
  SvgWriter svg_;
};

void Drawing::draw_legend() {
  double x = 24.0;
  const double y = 74.0;
  const auto name = [&](std::string_view text) {
    svg_.text({x + 14.0, y + 4.0}, text, {});
    x += 44.0 + 6.8 * static_cast<double>(text.size());
  };
  for (const std::string& method : names_) {
    svg_.line({x - 8.0, y}, {x + 8.0, y}, {.stroke = look(method).colour, .stroke_width = 1.8});
    draw_marker(svg_, look(method), {x, y}, true);
    name(method);
  }
  if (!chart_.picks.empty()) {
    draw_star(svg_, {.colour = "#999999"}, {x, y}, true);
    name("planner's pick");
    draw_star(svg_, {.colour = "#777777"}, {x, y}, false);
    name("its estimate (a)");
  }
  svg_.line({x - 5.0, y}, {x + 5.0, y}, {.stroke = kInk, .stroke_width = 1.6});
  name("95 % bound (b)");
}

void Drawing::draw_times() {
  std::vector<double> times;
  std::vector<double> errors = true_errors();
  for (const AccuracyPoint& point : chart_.points) times.push_back(point.cost.cpu_seconds);
  for (const PlannerPick& pick : chart_.picks) {
    times.push_back(pick.point.cost.cpu_seconds);
    errors.push_back(pick.max_error);
    errors.push_back(pick.point.estimate.value_or(0.0));
  }
  const Panel panel = panel_of({84, 124}, 410, 370, times, errors);
  draw_axes(svg_, panel, "(a) What accuracy costs", "processor time (CPU s)",
            "true error (RMSE, values 0 to 1)");
  const double floor = panel.y.position(chart_.reference.noise);
  if (floor < panel.bottom() - 1.0) {
    svg_.rectangle({panel.corner.x, floor}, panel.width, panel.bottom() - floor,
                   {.fill = "#000000", .opacity = 0.07});
    svg_.text({panel.corner.x + 6.0, panel.bottom() - 6.0}, "below the reference's own noise",
              {.size = 11.0, .colour = kFaint});
  }
  draw_targets(panel);
  for (const std::string& method : names_) draw_curve(panel, method);
  for (const PlannerPick& pick : chart_.picks) {
    const double time = pick.point.cost.cpu_seconds;
    const SvgPoint truth = panel.at(time, pick.point.truth.rmse_at_most);
    const SeriesLook style = look(pick.point.method);
    svg_.begin_group(label_of(pick));
    svg_.line(truth, {truth.x, panel.y.position(pick.max_error)},
              {.stroke = kFaint, .stroke_width = 1.0, .dashes = "1.5 2.5"});
    if (pick.point.estimate) {
      const SvgPoint estimate = panel.at(time, *pick.point.estimate);
      svg_.line(truth, estimate, {.stroke = style.colour, .stroke_width = 1.2});
      draw_star(svg_, style, estimate, false);
    }
    draw_star(svg_, style, truth, true);
    svg_.end_group();
  }
  draw_frame(svg_, panel);
}

void Drawing::draw_targets(const Panel& panel) {
  if (chart_.picks.empty()) return;
  svg_.text({panel.right() + 5.0, panel.corner.y - 10.0}, "max_error",
            {.size = 11.0, .colour = kFaint});
  for (const PlannerPick& pick : chart_.picks) {
    const double y = panel.y.position(pick.max_error);
    svg_.line({panel.corner.x, y}, {panel.right() + 4.0, y},
              {.stroke = kFaint, .stroke_width = 1.0, .dashes = "5 4"});
    svg_.text({panel.right() + 7.0, y + 4.0}, short_number(pick.max_error),
              {.size = 11.0, .colour = kFaint});
  }
}

void Drawing::draw_curve(const Panel& panel, const std::string& method) {
  std::vector<SvgPoint> line;
  for (const AccuracyPoint& point : chart_.points) {
    if (point.method != method) continue;
    line.push_back(panel.at(point.cost.cpu_seconds, point.truth.rmse_at_most));
  }
  if (line.empty()) return;
  svg_.polyline(line, {.stroke = look(method).colour, .stroke_width = 1.8});
  for (const AccuracyPoint& point : chart_.points) {
    if (point.method != method) continue;
    svg_.begin_group(label_of(point));
    draw_marker(svg_, look(method), panel.at(point.cost.cpu_seconds, point.truth.rmse_at_most),
                point.truth.resolved);
    svg_.end_group();
  }
}

void Drawing::draw_estimates() {
  std::vector<double> errors = true_errors();
  const auto add_told = [&](const AccuracyPoint& point) {
    errors.push_back(point.estimate.value_or(0.0));
    errors.push_back(point.upper_95.value_or(0.0));
  };
  for (const AccuracyPoint& point : chart_.points) add_told(point);
  for (const PlannerPick& pick : chart_.picks) add_told(pick.point);
  const Panel panel = panel_of({650, 124}, 410, 370, errors, errors);
  draw_axes(svg_, panel, "(b) What pictures say of their error", "true error (RMSE)",
            "told: estimate and 95 % bound (RMSE)");
  svg_.line({panel.corner.x, panel.bottom()}, {panel.right(), panel.corner.y},
            {.stroke = kInk, .stroke_width = 1.0, .dashes = "6 3"});
  svg_.text({panel.right() - 8.0, panel.bottom() - 24.0},
            "below the line:", {.anchor = TextAnchor::end, .size = 11.0, .colour = kFaint});
  svg_.text({panel.right() - 8.0, panel.bottom() - 9.0}, "less is told than is true",
            {.anchor = TextAnchor::end, .size = 11.0, .colour = kFaint});
  for (const AccuracyPoint& point : chart_.points) draw_estimate(panel, point, false);
  for (const PlannerPick& pick : chart_.picks) draw_estimate(panel, pick.point, true);
  draw_frame(svg_, panel);
}

void Drawing::draw_estimate(const Panel& panel, const AccuracyPoint& point, bool is_pick) {
  if (!point.estimate) return;
  const SeriesLook style = look(point.method);
  const SvgPoint estimate = panel.at(point.truth.rmse_at_most, *point.estimate);
  svg_.begin_group(label_of(point));
  if (point.upper_95) {
    const SvgPoint bound = panel.at(point.truth.rmse_at_most, *point.upper_95);
    svg_.line(estimate, bound, {.stroke = style.colour, .stroke_width = 1.2});
    svg_.line({bound.x - 5.0, bound.y}, {bound.x + 5.0, bound.y},
              {.stroke = style.colour, .stroke_width = 1.6});
  }
  if (is_pick) {
    draw_star(svg_, style, estimate, true);
  } else {
    draw_marker(svg_, style, estimate, point.truth.resolved);
  }
  svg_.end_group();
}

void Drawing::draw_footer() {
  const ChartReference& reference = chart_.reference;
  std::string text = "Reference: " + std::to_string(reference.replicates) + " pictures of " +
                     std::to_string(reference.samples) + " samples a pixel by " + reference.method +
                     "; its own noise, RMSE " + rounded(reference.noise) +
                     ", is taken off the errors. ";
  if (reference.bias_bound > 0.0) {
    text += "It leaves out at most " + rounded(reference.bias_bound) + ". ";
  }
  text += "Hollow: not above that noise.";
  svg_.text({20, kHeight - 16.0}, text, {.size = 11.0, .colour = kFaint});
}

}  // namespace

std::string accuracy_chart_svg(const AccuracyChart& chart, const ChartCaption& caption) {
  return Drawing(chart, caption).draw();
}

}  // namespace fstop
