#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/study/log_axis.h"
#include "core/study/svg_writer.h"
#include "core/study/verification_report.h"

namespace fstop {
namespace {

constexpr double kWidth = 520.0;  // px
constexpr double kHeight = 320.0;
constexpr double kLeft = 70.0;
constexpr double kRight = 18.0;
constexpr double kTop = 34.0;
constexpr double kBottom = 48.0;
constexpr std::string_view kLineColour = "#1f5fa8";
constexpr std::string_view kPointColour = "#b3400e";

/// An axis on which equal differences are equal lengths, with some room at its ends.
class LinearAxis {
 public:
  LinearAxis(const std::vector<double>& values, double begin, double end)
      : begin_(begin), end_(end) {
    const auto [low, high] = std::ranges::minmax_element(values);
    const double span = *high - *low;
    const double room = span > 0.0 ? 0.06 * span : 0.1 * std::max(1e-9, std::abs(*high));
    low_ = *low - room;
    high_ = *high + room;
  }
  double position(double value) const {
    return begin_ + (end_ - begin_) * (value - low_) / (high_ - low_);
  }
  /// Multiples of 1, 2 or 5 times a power of ten, four to nine of them.
  std::vector<double> ticks() const {
    const double rough = (high_ - low_) / 6.0;
    const double power = std::pow(10.0, std::floor(std::log10(rough)));
    const double digit = rough / power < 1.5 ? 1.0 : rough / power < 3.5 ? 2.0 : 5.0;
    const double step = digit * power;
    std::vector<double> ticks;
    for (double k = std::ceil(low_ / step); k * step <= high_; k += 1.0) {
      ticks.push_back(k * step + 0.0);  // no minus before a zero
    }
    return ticks;
  }

 private:
  double low_ = 0.0;
  double high_ = 1.0;
  double begin_;
  double end_;
};

void draw_axes(SvgWriter& svg, const LinearAxis& x, const LinearAxis& y,
               const VerificationCurve& curve) {
  const SvgStyle grid{.stroke = "#d9d9d9"};
  for (const double tick : x.ticks()) {
    const double at = x.position(tick);
    svg.line({at, kTop}, {at, kHeight - kBottom}, grid);
    svg.text({at, kHeight - kBottom + 16.0}, short_number(tick), {.anchor = TextAnchor::middle});
  }
  for (const double tick : y.ticks()) {
    const double at = y.position(tick);
    svg.line({kLeft, at}, {kWidth - kRight, at}, grid);
    svg.text({kLeft - 6.0, at + 4.0}, short_number(tick), {.anchor = TextAnchor::end});
  }
  svg.rectangle({kLeft, kTop}, kWidth - kLeft - kRight, kHeight - kTop - kBottom,
                {.stroke = "#555555"});
  svg.text({0.5 * (kLeft + kWidth - kRight), kHeight - 10.0}, curve.x_label,
           {.anchor = TextAnchor::middle});
  svg.text({16.0, 0.5 * (kTop + kHeight - kBottom)}, curve.y_label,
           {.anchor = TextAnchor::middle, .upright = true});
  svg.text({kLeft, 20.0}, curve.title, {.size = 14.0, .bold = true});
}

}  // namespace

std::string verification_plot(const VerificationCurve& curve) {
  SvgWriter svg(kWidth, kHeight, curve.title,
                curve.y_label + " over " + curve.x_label + ": measured as circles" +
                    (curve.expected.empty() ? "" : ", closed forms joined by a line"));
  svg.rectangle({0.0, 0.0}, kWidth, kHeight, {.fill = "#ffffff"});
  if (!curve.x.empty()) {
    std::vector<double> heights = curve.measured;
    heights.insert(heights.end(), curve.expected.begin(), curve.expected.end());
    const LinearAxis x(curve.x, kLeft, kWidth - kRight);
    const LinearAxis y(heights, kHeight - kBottom, kTop);
    draw_axes(svg, x, y, curve);
    std::vector<SvgPoint> line;
    for (std::size_t i = 0; i < curve.expected.size(); ++i) {
      line.push_back({x.position(curve.x[i]), y.position(curve.expected[i])});
    }
    std::ranges::sort(line, {}, &SvgPoint::x);
    if (!line.empty()) svg.polyline(line, {.stroke = kLineColour, .stroke_width = 1.6});
    for (std::size_t i = 0; i < curve.measured.size(); ++i) {
      svg.marker(Marker::circle, {x.position(curve.x[i]), y.position(curve.measured[i])}, 3.2,
                 {.stroke = kPointColour, .stroke_width = 1.6});
    }
  }
  return std::move(svg).finish();
}

}  // namespace fstop
