#include "core/study/svg_writer.h"

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <utility>

namespace fstop {
namespace {

std::string digits(double number) {
  std::array<char, 32> text = {};
  const double rounded = std::round(number * 100.0) / 100.0;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), rounded + 0.0).ptr;
  return {text.data(), end};
}

std::string attribute(std::string_view name, std::string_view value) {
  return " " + std::string(name) + "=\"" + xml_escaped(value) + "\"";
}

std::string attribute(std::string_view name, double value) {
  return attribute(name, std::string_view(digits(value)));
}

std::string points_text(const std::vector<SvgPoint>& points) {
  std::string text;
  for (const SvgPoint& point : points) {
    text += (text.empty() ? "" : " ") + digits(point.x) + "," + digits(point.y);
  }
  return text;
}

// Corners around a centre, the first of them at `turn` of a whole turn from the top, clockwise;
// every other one lies at `inner` of the radius.
std::vector<SvgPoint> polygon(SvgPoint centre, double radius, int corners, double turn,
                              double inner = 1.0) {
  std::vector<SvgPoint> points;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * std::numbers::pi * (turn + static_cast<double>(i) / corners);
    const double r = radius * (i % 2 == 0 ? 1.0 : inner);
    points.push_back({centre.x + r * std::sin(angle), centre.y - r * std::cos(angle)});
  }
  return points;
}

// An upright cross of filled arms.
std::vector<SvgPoint> cross(SvgPoint c, double r) {
  const double t = 0.36 * r;
  return {{c.x - t, c.y - r}, {c.x + t, c.y - r}, {c.x + t, c.y - t}, {c.x + r, c.y - t},
          {c.x + r, c.y + t}, {c.x + t, c.y + t}, {c.x + t, c.y + r}, {c.x - t, c.y + r},
          {c.x - t, c.y + t}, {c.x - r, c.y + t}, {c.x - r, c.y - t}, {c.x - t, c.y - t}};
}

// Radii make all shapes look as large as a circle of `radius`.
std::vector<SvgPoint> outline(Marker marker, SvgPoint centre, double radius) {
  switch (marker) {
    case Marker::circle:
      break;  // drawn as one
    case Marker::square:
      return polygon(centre, 1.25 * radius, 4, 0.125);
    case Marker::triangle:
      return polygon(centre, 1.4 * radius, 3, 0.0);
    case Marker::diamond:
      return polygon(centre, 1.35 * radius, 4, 0.0);
    case Marker::wedge:
      return polygon(centre, 1.4 * radius, 3, 0.5);
    case Marker::cross:
      return cross(centre, 1.15 * radius);
    case Marker::pentagon:
      return polygon(centre, 1.2 * radius, 5, 0.0);
    case Marker::star:
      return polygon(centre, 1.7 * radius, 10, 0.0, 0.45);
  }
  return {};
}

}  // namespace

SvgWriter::SvgWriter(double width, double height, std::string_view title,
                     std::string_view description) {
  const std::string size = digits(width) + " " + digits(height);
  svg_ = "<svg xmlns=\"http://www.w3.org/2000/svg\"" + attribute("width", width) +
         attribute("height", height) + attribute("viewBox", std::string_view("0 0 " + size)) +
         " role=\"img\" aria-labelledby=\"chart-title chart-description\""
         " font-family=\"Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif\">\n"
         "<title id=\"chart-title\">" +
         xml_escaped(title) + "</title>\n<desc id=\"chart-description\">" +
         xml_escaped(description) + "</desc>\n";
}

void SvgWriter::style(const SvgStyle& style) {
  svg_ += attribute("fill", style.fill);
  if (style.stroke != "none") {
    svg_ += attribute("stroke", style.stroke) + attribute("stroke-width", style.stroke_width) +
            " stroke-linejoin=\"round\"";
  }
  if (!style.dashes.empty()) svg_ += attribute("stroke-dasharray", style.dashes);
  if (style.opacity != 1.0) svg_ += attribute("opacity", style.opacity);
  svg_ += "/>\n";
}

void SvgWriter::rectangle(SvgPoint corner, double width, double height, const SvgStyle& look) {
  svg_ += "<rect" + attribute("x", corner.x) + attribute("y", corner.y) +
          attribute("width", width) + attribute("height", height);
  style(look);
}

void SvgWriter::line(SvgPoint from, SvgPoint to, const SvgStyle& look) {
  svg_ += "<line" + attribute("x1", from.x) + attribute("y1", from.y) + attribute("x2", to.x) +
          attribute("y2", to.y);
  style(look);
}

void SvgWriter::polyline(const std::vector<SvgPoint>& points, const SvgStyle& look) {
  svg_ += "<polyline" + attribute("points", std::string_view(points_text(points)));
  style(look);
}

void SvgWriter::marker(Marker marker, SvgPoint centre, double radius, const SvgStyle& look) {
  if (marker == Marker::circle) {
    svg_ +=
        "<circle" + attribute("cx", centre.x) + attribute("cy", centre.y) + attribute("r", radius);
  } else {
    svg_ += "<polygon" +
            attribute("points", std::string_view(points_text(outline(marker, centre, radius))));
  }
  style(look);
}

void SvgWriter::text(SvgPoint where, std::string_view text, const SvgText& look) {
  constexpr std::array<std::string_view, 3> kAnchors = {"start", "middle", "end"};
  svg_ += "<text" + attribute("x", where.x) + attribute("y", where.y) +
          attribute("font-size", look.size) + attribute("fill", look.colour) +
          attribute("text-anchor", kAnchors[static_cast<std::size_t>(look.anchor)]);
  if (look.bold) svg_ += attribute("font-weight", std::string_view("bold"));
  if (look.upright) {
    const std::string turn = "rotate(-90 " + digits(where.x) + " " + digits(where.y) + ")";
    svg_ += attribute("transform", std::string_view(turn));
  }
  svg_ += ">" + xml_escaped(text) + "</text>\n";
}

void SvgWriter::begin_group(std::string_view label) {
  svg_ += "<g><title>" + xml_escaped(label) + "</title>\n";
}

void SvgWriter::end_group() { svg_ += "</g>\n"; }

std::string SvgWriter::finish() && { return std::move(svg_) + "</svg>\n"; }

std::string xml_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20 || c == '\t' || c == '\n') escaped += c;
    }
  }
  return escaped;
}

}  // namespace fstop
