#include "core/study/chart_svg.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/study/log_axis.h"
#include "core/study/svg_writer.h"

namespace fstop {
namespace {

AccuracyPoint point(const std::string& method, double seconds, double error) {
  AccuracyPoint made{.method = method};
  made.cost = {.rays = 1, .samples_mean = 4, .cpu_seconds = seconds, .wall_seconds = seconds};
  made.truth = {.rmse = error, .rel_mse = error * error, .rmse_at_most = error};
  made.estimate = 1.2 * error;
  made.upper_95 = 1.4 * error;
  return made;
}

AccuracyChart two_methods() {
  AccuracyChart chart;
  chart.reference = {.method = "lens-sampling", .samples = 1024, .replicates = 4, .noise = 1e-4};
  chart.points = {point("pinhole", 0.001, 0.05), point("pinhole", 0.01, 0.04),
                  point("lens-sampling", 0.002, 0.1), point("lens-sampling", 0.02, 0.01)};
  chart.picks = {{.max_error = 0.02, .point = point("lens-sampling", 0.015, 0.015)}};
  return chart;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++found;
  return found;
}

// Every element that is opened is closed, in order, and every attribute is quoted: what makes XML
// of this kind well-formed.
bool is_well_formed(const std::string& svg) {
  std::vector<std::string> open;
  for (std::size_t at = svg.find('<'); at != std::string::npos; at = svg.find('<', at + 1)) {
    const std::size_t end = svg.find('>', at);
    if (end == std::string::npos) return false;
    const std::string tag = svg.substr(at + 1, end - at - 1);
    if (count(tag, "\"") % 2 != 0 || count(tag, "<") != 0) return false;
    if (tag.ends_with('/')) continue;
    if (!tag.starts_with('/')) {
      open.push_back(tag.substr(0, tag.find(' ')));
    } else if (open.empty() || open.back() != tag.substr(1)) {
      return false;
    } else {
      open.pop_back();
    }
  }
  return open.empty();
}

TEST(LogAxis, PlacesEqualRatiosAtEqualLengths) {
  const LogAxis axis({0.01, 1.0}, 100.0, 300.0);
  EXPECT_LT(axis.lowest(), 0.01);
  EXPECT_GT(axis.highest(), 1.0);
  const double step = axis.position(0.1) - axis.position(0.01);
  EXPECT_GT(step, 0.0);
  EXPECT_NEAR(axis.position(1.0) - axis.position(0.1), step, 1e-9);
  EXPECT_EQ(axis.position(axis.lowest()), 100.0);
  EXPECT_EQ(axis.position(axis.highest()), 300.0);
  EXPECT_EQ(axis.position(0.0), 100.0);  // beyond the ends
  EXPECT_EQ(axis.position(1e9), 300.0);
}

TEST(LogAxis, NamesPowersOfTenAndSpansADecadeAtLeast) {
  const auto labels = [](const std::vector<double>& values) {
    std::vector<std::string> named;
    for (const AxisTick& tick : LogAxis(values, 0.0, 1.0).ticks()) {
      if (!tick.label.empty()) named.push_back(tick.label);
    }
    return named;
  };
  EXPECT_EQ(labels({1e-4, 10.0}),
            (std::vector<std::string>{"0.0001", "0.001", "0.01", "0.1", "1", "10"}));
  EXPECT_EQ(labels({0.03, 0.03}), (std::vector<std::string>{"0.01", "0.02", "0.05"}));
  EXPECT_FALSE(labels({}).empty());
  EXPECT_FALSE(labels({0.0, -1.0, INFINITY}).empty());
  const LogAxis one({0.03}, 0.0, 1.0);
  EXPECT_NEAR(one.highest() / one.lowest(), 10.0, 1e-9);
}

TEST(SvgWriter, EscapesWhatTextMayHold) {
  EXPECT_EQ(xml_escaped("a<b & \"c\">\x01"), "a&lt;b &amp; &quot;c&quot;&gt;");
  AccuracyChart chart = two_methods();
  chart.points.front().method = "<script>\"&";
  const std::string svg = accuracy_chart_svg(chart, {.title = "a<b", .subtitle = "</svg>"});
  EXPECT_TRUE(is_well_formed(svg));
  EXPECT_EQ(count(svg, "<script"), 0U);
  EXPECT_EQ(count(svg, "</svg>"), 1U);
  EXPECT_NE(svg.find(">a&lt;b</title>"), std::string::npos);
}

TEST(ChartSvg, IsWellFormedAndToldToScreenReaders) {
  const std::string svg = accuracy_chart_svg(two_methods(), {});
  EXPECT_TRUE(svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\""));
  EXPECT_TRUE(is_well_formed(svg));
  EXPECT_FALSE(is_well_formed(svg.substr(0, svg.size() - 8)));
  EXPECT_NE(svg.find("role=\"img\""), std::string::npos);
  EXPECT_NE(svg.find("pinhole from 0.05 in 0.001 s to 0.04 in 0.01 s"), std::string::npos);
  EXPECT_NE(svg.find("fill=\"#ffffff\""), std::string::npos);
  EXPECT_NE(svg.find("processor time (CPU s)"), std::string::npos);
  EXPECT_EQ(svg, accuracy_chart_svg(two_methods(), {}));
}

// Each method once in the legend, and one labelled group in each panel for every point and pick.
TEST(ChartSvg, DrawsEveryPointInBothPanels) {
  const AccuracyChart chart = two_methods();
  const std::string svg = accuracy_chart_svg(chart, {});
  EXPECT_EQ(count(svg, "<g><title>"), 2 * (chart.points.size() + chart.picks.size()));
  EXPECT_EQ(count(svg, ">pinhole</text>"), 1U);
  EXPECT_EQ(count(svg, ">lens-sampling</text>"), 1U);
  EXPECT_EQ(count(svg, "<polyline"), 2U);
  AccuracyChart untold = chart;
  untold.points.front().estimate = std::nullopt;
  EXPECT_EQ(count(accuracy_chart_svg(untold, {}), "<g><title>"),
            2 * (chart.points.size() + chart.picks.size()) - 1);
}

TEST(ChartSvg, SeriesDifferInColourAndInMarker) {
  AccuracyChart chart = two_methods();
  chart.points.clear();
  chart.picks.clear();
  for (const char* name : {"a", "b", "c", "d", "e", "f", "g", "h"}) {
    chart.points.push_back(point(name, 0.01, 0.01));
  }
  const std::string svg = accuracy_chart_svg(chart, {});
  EXPECT_TRUE(is_well_formed(svg));
  std::set<std::string> colours;
  std::set<std::string> looks;
  std::istringstream lines(svg.substr(svg.find("<g>")));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("<circle") && !line.starts_with("<polygon")) continue;
    const std::string colour = line.substr(line.find("fill="), 14);
    // Corners tell the shapes apart; a circle has none. Three-cornered ones differ in direction.
    const auto corners = std::to_string(count(line, ","));
    colours.insert(colour);
    looks.insert(colour + " " + corners);
  }
  EXPECT_EQ(colours.size(), 7U);
  EXPECT_GE(looks.size(), 8U);
}

TEST(ChartSvg, DrawsChartsWithoutPointsOrPicks) {
  AccuracyChart chart = two_methods();
  chart.picks.clear();
  EXPECT_TRUE(is_well_formed(accuracy_chart_svg(chart, {})));
  EXPECT_EQ(accuracy_chart_svg(chart, {}).find("planner's pick"), std::string::npos);
  chart.points.clear();
  EXPECT_TRUE(is_well_formed(accuracy_chart_svg(chart, {})));
  EXPECT_EQ(accuracy_chart_svg(chart, {}).find("nan"), std::string::npos);
}

}  // namespace
}  // namespace fstop
