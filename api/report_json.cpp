#include "api/report_json.h"

#include <utility>

#include "api/json_text.h"
#include "api/json_writer.h"

namespace fstop::api {
namespace {

Json error_json(const ImageError& error) {
  return {{"estimate", number_json(error.estimate)},
          {"upper_95", number_json(error.upper_95)},
          {"target", number_json(error.target)},
          {"energy", number_json(error.energy)},
          {"energy_upper_95", number_json(error.energy_upper_95)}};
}

Json cost_json(const RenderCost& cost) {
  return {{"rays", cost.rays},
          {"samples_mean", number_json(cost.samples_mean)},
          {"samples_max", cost.samples_max}};
}

Json cost_json(const RenderCost& cost, const Timing& timing) {
  Json value = cost_json(cost);
  value["render_ms"] = number_json(timing.render_ms);
  value["queue_ms"] = number_json(timing.queue_ms);
  value["encode_ms"] = number_json(timing.encode_ms);
  value["cpu_ms"] = number_json(timing.cpu_ms);
  return value;
}

Json report_members(const RenderReport& report, Json cost) {
  Json members = {{"method", report.method},
                  {"model", model_json(report.model)},
                  {"passed_over", passed_over_json(report.passed_over)},
                  {"error", error_json(report.error)},
                  {"optics", optics_members(report.optics)},
                  {"cost", std::move(cost)},
                  {"warnings", report.warnings}};
  if (report.alpha_error) members["alpha_error"] = error_json(*report.alpha_error);
  return members;
}

}  // namespace

std::string report_json(std::string_view id, const RenderReport& report, const Timing& timing,
                        std::string_view normalised) {
  Json value = {{"id", id}};
  value.update(report_members(report, cost_json(report.cost, timing)));
  value["request"] = Json::parse(normalised);
  return json_text(value);
}

std::string lasting_report_json(const RenderReport& report, std::string_view scene_hash) {
  Json value = {{"scene_sha256", scene_hash}};
  value.update(report_members(report, cost_json(report.cost)));
  return json_text(value);
}

std::optional<ImageError> alpha_error_of(std::string_view report) {
  const auto value = nlohmann::json::parse(report, nullptr, false);
  const auto member = value.find("alpha_error");
  if (!value.is_object() || member == value.end() || !member->is_object()) return std::nullopt;
  const auto number = [&](const char* key) { return member->value(key, 1.0); };
  return ImageError{.estimate = number("estimate"),
                    .upper_95 = number("upper_95"),
                    .target = number("target"),
                    .energy = number("energy"),
                    .energy_upper_95 = number("energy_upper_95")};
}

}  // namespace fstop::api
