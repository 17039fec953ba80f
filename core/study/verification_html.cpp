#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "core/encode/image_codec.h"
#include "core/study/svg_writer.h"
#include "core/study/verification_report.h"
#include "core/study/verification_words.h"

namespace fstop {
namespace {

constexpr std::string_view kStyle = R"css(
:root { color-scheme: light dark; --text: #1c1c1c; --page: #fdfdfc; --line: #c9c9c4; --good: #14632c;
  --bad: #a01313; --soft: #55554f; }
@media (prefers-color-scheme: dark) { :root { --text: #e9e9e4; --page: #17181a; --line: #45474c;
  --good: #7fd497; --bad: #ff9a8f; --soft: #a9aaa4; } }
body { color: var(--text); background: var(--page); font: 16px/1.5 system-ui, sans-serif;
  margin: 0 auto; padding: 1rem; max-width: 76rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2.5rem; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; width: 100%; font-size: 0.9rem; }
caption { text-align: left; color: var(--soft); padding: 0.3rem 0; }
th, td { text-align: left; vertical-align: top; padding: 0.3rem 0.6rem;
  border-bottom: 1px solid var(--line); }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.green { color: var(--good); font-weight: 600; } .red { color: var(--bad); font-weight: 600; }
.soft { color: var(--soft); }
.figures { display: flex; flex-wrap: wrap; gap: 1rem; margin: 1rem 0; }
figure { margin: 0; } figcaption { color: var(--soft); font-size: 0.85rem; }
figure img { max-width: 100%; height: auto; border: 1px solid var(--line); background: #fff; }
img.picture { width: 14rem; image-rendering: pixelated; }
)css";

std::string base64(std::span<const unsigned char> bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8U | (k < left ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= left ? kDigits[group >> (18U - 6U * k) & 63U] : '=';
    }
  }
  return text;
}

std::string base64(std::string_view text) {
  return base64({reinterpret_cast<const unsigned char*>(text.data()), text.size()});
}

// The first picture, as bright as it can be shown.
std::string picture_figure(const VerificationOutcome& outcome) {
  if (outcome.picture.empty()) return {};
  Image image = outcome.picture;
  const float largest = *std::ranges::max_element(image.pixels());
  if (largest > 0.0F && std::isfinite(largest)) {
    for (float& value : image.pixels()) value /= largest;
  }
  const std::vector<std::byte> png =
      encode({.layers = {{.channel_names = {"R", "G", "B"}, .image = std::move(image)}}},
             ImageFormat::png);
  const std::string what =
      "The first of " + std::to_string(outcome.pictures) + " pictures, its brightest pixel white";
  return "<figure><img class=\"picture\" alt=\"" + xml_escaped(what) +
         "\" src=\"data:image/png;base64," +
         base64({reinterpret_cast<const unsigned char*>(png.data()), png.size()}) +
         "\"><figcaption>" + xml_escaped(what) + "</figcaption></figure>\n";
}

std::string curve_figure(const VerificationCurve& curve) {
  const std::string what = curve.title + ": " + curve.y_label + " over " + curve.x_label +
                           ", measured as circles" +
                           (curve.expected.empty() ? "" : ", closed forms joined by a line");
  return "<figure><img alt=\"" + xml_escaped(what) + "\" src=\"data:image/svg+xml;base64," +
         base64(verification_plot(curve)) + "\"><figcaption>" + xml_escaped(what) +
         "</figcaption></figure>\n";
}

std::string cell(const std::string& text, std::string_view kind = {}) {
  return "<td" + (kind.empty() ? std::string() : " class=\"" + std::string(kind) + "\"") + ">" +
         xml_escaped(text) + "</td>";
}

std::string result_row(const VerificationResult& result) {
  return "<tr><th scope=\"row\">" + xml_escaped(result.name) + "</th>" +
         cell(verdict_of(result), result.holds() ? "green" : "red") +
         cell(with_unit(result.measured, result.unit), "number") +
         cell(with_unit(result.expected, result.unit), "number") +
         cell(number_text(result.measured - result.expected, 2), "number") +
         cell("\u00b1" + number_text(result.tolerance(), 2), "number") +
         cell(shares_text(result), "soft") + "</tr>\n";
}

std::string check_section(const VerificationOutcome& outcome) {
  std::string html = "<section><h2>" + xml_escaped(outcome.check) + "</h2>\n<p class=\"soft\">" +
                     xml_escaped(std::string(verification_kind_name(outcome.kind)) + ", camera " +
                                 outcome.camera) +
                     "</p>\n";
  if (!outcome.failure.empty()) {
    html += "<p class=\"red\">Not measured: " + xml_escaped(outcome.failure) + "</p>\n";
  }
  if (!outcome.results.empty()) {
    html += "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Results of " +
            xml_escaped(outcome.check) +
            "\"><table><caption>Measured in finished pictures, beside the closed form</caption>\n"
            "<thead><tr><th scope=\"col\">Result</th><th scope=\"col\">Verdict</th>"
            "<th scope=\"col\">Measured</th><th scope=\"col\">Expected</th>"
            "<th scope=\"col\">Difference</th><th scope=\"col\">Tolerance</th>"
            "<th scope=\"col\">Tolerance, by cause</th></tr></thead>\n<tbody>\n";
    for (const VerificationResult& result : outcome.results) html += result_row(result);
    html += "</tbody></table></div>\n";
  }
  html += "<div class=\"figures\">\n" + picture_figure(outcome);
  for (const VerificationCurve& curve : outcome.curves) html += curve_figure(curve);
  return html + "</div></section>\n";
}

std::string trial_section(std::span<const PlantedTrial> trials) {
  if (trials.empty()) return {};
  std::string html =
      "<section><h2>Planted errors</h2>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" "
      "aria-label=\"Planted errors\"><table><caption>The camera that was sent was wrong by so "
      "much; what was expected was not</caption>\n<thead><tr><th scope=\"col\">Error</th>"
      "<th scope=\"col\">Verdict</th><th scope=\"col\">Red results</th></tr></thead>\n<tbody>\n";
  for (const PlantedTrial& trial : trials) {
    html += "<tr><th scope=\"row\">" + xml_escaped(trial_name(trial)) + "</th>" +
            cell(trial.is_caught() ? "caught" : "not caught", trial.is_caught() ? "green" : "red") +
            cell(trial_text(trial), "soft") + "</tr>\n";
  }
  return html + "</tbody></table></div></section>\n";
}

}  // namespace

std::string verification_html(const VerificationHeading& heading,
                              std::span<const VerificationOutcome> outcomes,
                              std::span<const PlantedTrial> trials) {
  std::size_t results = 0;
  std::size_t red = 0;
  for (const VerificationOutcome& outcome : outcomes) {
    results += outcome.results.size();
    red += static_cast<std::size_t>(
        std::ranges::count_if(outcome.results, [](const auto& r) { return !r.holds(); }));
    red += outcome.failure.empty() ? 0 : 1;
  }
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
      "img-src data:; style-src 'unsafe-inline'\">\n<title>" +
      xml_escaped(heading.suite) + ": optics verification</title>\n<style>" + std::string(kStyle) +
      "</style>\n</head>\n<body>\n<main>\n<h1>" + xml_escaped(heading.suite) + "</h1>\n<p>" +
      xml_escaped("Rendered by " + heading.target + ", verified by " + heading.engine) + ".</p>\n";
  html += "<p class=\"" + std::string(red == 0 ? "green" : "red") + "\">" +
          (red == 0 ? "All " + std::to_string(results) + " results agree with their closed forms."
                    : std::to_string(red) + " of " + std::to_string(results) +
                          " results are red or missing.") +
          "</p>\n";
  for (const VerificationOutcome& outcome : outcomes) html += check_section(outcome);
  return html + trial_section(trials) + "</main>\n</body>\n</html>\n";
}

}  // namespace fstop
