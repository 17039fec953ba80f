#include "server/negotiation.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "server/header_list.h"
#include "server/static_files.h"

namespace fstop::server {
namespace {

constexpr std::array kFormats = {ImageFormat::png, ImageFormat::jpeg, ImageFormat::webp,
                                 ImageFormat::tiff, ImageFormat::exr};
constexpr std::string_view kReportType = "application/json";

double quality_of(std::string_view parameters) {
  while (!parameters.empty()) {
    std::string_view parameter = next_part(parameters, ';');
    const std::string_view name = next_part(parameter, '=');
    if (!equal(name, "q")) continue;
    double quality = 0.0;
    std::from_chars(parameter.data(), parameter.data() + parameter.size(), quality);
    return quality >= 0.0 && quality <= 1.0 ? quality : 0.0;
  }
  return 1.0;
}

// How well a range fits a type: 0 not, 1 any, 2 the kind, 3 exactly.
int specificity(std::string_view range, std::string_view type) {
  if (equal(range, type)) return 3;
  const std::string kind = std::string(type.substr(0, type.find('/') + 1)) + "*";
  if (equal(range, kind)) return 2;
  return range == "*/*" || range == "*" ? 1 : 0;
}

struct Acceptance {
  double quality = 0.0;
  int specificity = 0;
};

// What the most specific range that fits says of `type`.
Acceptance acceptance(std::string_view accept, std::string_view type) {
  if (trimmed(accept).empty()) return {.quality = 1.0, .specificity = 1};
  Acceptance best;
  while (!accept.empty()) {
    std::string_view parameters = next_part(accept, ',');
    const int fit = specificity(next_part(parameters, ';'), type);
    if (fit > best.specificity) best = {quality_of(parameters), fit};
  }
  return best;
}

Refusal bad_query(std::string detail) {
  return {http::status::bad_request, "bad-query", std::move(detail)};
}

std::string format_names() {
  std::string names;
  for (const ImageFormat format : kFormats)
    names += (names.empty() ? "" : ", ") + std::string(format_name(format));
  return names;
}

Refusal nothing_acceptable(bool may_be_report) {
  return {http::status::not_acceptable, "not-acceptable",
          "Accept names nothing that there is: " + format_names() + " images" +
              (may_be_report ? " or application/json" : "")};
}

}  // namespace

Representation negotiated(std::string_view accept, ImageFormat preferred, bool may_be_report) {
  double best_quality = 0.0;
  Representation best;
  const auto consider = [&](Representation representation, double quality) {
    if (quality <= best_quality) return;
    best = representation;
    best_quality = quality;
  };
  consider(preferred, acceptance(accept, media_type(preferred)).quality);
  for (const ImageFormat format : kFormats)
    consider(format, acceptance(accept, media_type(format)).quality);
  if (may_be_report) {
    const Acceptance report = acceptance(accept, kReportType);
    if (report.specificity > 1) consider(std::nullopt, report.quality);
  }
  if (best_quality == 0.0) throw nothing_acceptable(may_be_report);
  return best;
}

Representation negotiated_numbers(std::string_view accept, ImageFormat preferred) {
  Representation best;
  Acceptance liked = acceptance(accept, kReportType);
  const auto consider = [&](ImageFormat format) {
    const Acceptance image = acceptance(accept, media_type(format));
    if (image.specificity <= 1 || image.quality < liked.quality) return;
    if (image.quality == liked.quality && image.specificity <= liked.specificity) return;
    best = format;
    liked = image;
  };
  consider(preferred);
  for (const ImageFormat format : kFormats) consider(format);
  if (liked.quality == 0.0) throw nothing_acceptable(true);
  return best;
}

std::size_t negotiated_type(std::string_view accept, std::span<const std::string_view> types) {
  std::size_t best = 0;
  Acceptance liked = acceptance(accept, types[0]);
  std::string names(types[0]);
  for (std::size_t i = 1; i < types.size(); ++i) {
    names += ", " + std::string(types[i]);
    const Acceptance other = acceptance(accept, types[i]);
    if (other.specificity <= 1 || other.quality < liked.quality) continue;
    if (other.quality == liked.quality && other.specificity <= liked.specificity) continue;
    best = i;
    liked = other;
  }
  if (liked.quality > 0.0) return best;
  throw Refusal(http::status::not_acceptable, "not-acceptable",
                "Accept names nothing that there is: " + names);
}

std::map<std::string, std::string> query_parameters(const Request& request,
                                                    std::span<const std::string_view> known) {
  std::map<std::string, std::string> parameters;
  std::string_view rest = request.query;
  while (!rest.empty()) {
    std::string_view value = next_part(rest, '&');
    const std::string name = percent_decoded(next_part(value, '='));
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      throw bad_query("the query has a parameter that is not known here");
    }
    if (!parameters.emplace(name, percent_decoded(value)).second)
      throw bad_query("the query names " + name + " twice");
  }
  return parameters;
}

ImageFormat format_of(std::string_view name) {
  for (const ImageFormat format : kFormats) {
    if (name == format_name(format)) return format;
  }
  throw bad_query("format must be one of " + format_names());
}

}  // namespace fstop::server
