#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace fstop {

/// A point of a drawing: pixels, x right, y down.
struct SvgPoint {
  double x = 0.0;
  double y = 0.0;
};

enum class TextAnchor { start, middle, end };

/// How a shape looks. Colours as SVG has them; "none" paints nothing.
struct SvgStyle {
  std::string_view fill = "none";
  std::string_view stroke = "none";
  double stroke_width = 1.0;
  double opacity = 1.0;
  std::string_view dashes = {};  // "4 3"
};

struct SvgText {
  TextAnchor anchor = TextAnchor::start;
  double size = 12.0;  // px
  bool bold = false;
  bool upright = false;  // reads from below
  std::string_view colour = "#222222";
};

/// The shapes that tell series apart beside their colours.
enum class Marker { circle, square, triangle, diamond, wedge, cross, pentagon, star };

/// Writes an SVG document piece by piece: plain shapes and text, nothing that needs a script, a
/// style sheet or another file. Text is escaped; coordinates have two decimals.
class SvgWriter {
 public:
  /// `title` and `description` are read out by screen readers.
  SvgWriter(double width, double height, std::string_view title, std::string_view description);

  void rectangle(SvgPoint corner, double width, double height, const SvgStyle& style);
  void line(SvgPoint from, SvgPoint to, const SvgStyle& style);
  void polyline(const std::vector<SvgPoint>& points, const SvgStyle& style);
  void marker(Marker marker, SvgPoint centre, double radius, const SvgStyle& style);
  void text(SvgPoint where, std::string_view text, const SvgText& style);
  /// What follows up to end_group() belongs together; `label` is its tooltip.
  void begin_group(std::string_view label);
  void end_group();

  /// The document. The writer is spent.
  std::string finish() &&;

 private:
  void style(const SvgStyle& style);

  std::string svg_;
};

/// `text` with &, <, > and quotation marks as entities, and without the control characters that
/// XML 1.0 does not have.
std::string xml_escaped(std::string_view text);

}  // namespace fstop
