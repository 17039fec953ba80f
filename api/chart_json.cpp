#include <cstdio>

#include "api/chart_request.h"
#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/length_unit.h"
#include "core/study/chart_svg.h"

namespace fstop::api {
namespace {

Json optional_json(const std::optional<double>& value) {
  return value ? number_json(*value) : Json(nullptr);
}

Json reference_json(const ChartReference& reference) {
  return {{"method", reference.method},
          {"samples", reference.samples},
          {"replicates", reference.replicates},
          {"noise", number_json(reference.noise)},
          {"rel_mse_noise", number_json(reference.rel_mse_noise)},
          {"energy_noise", number_json(reference.energy_noise)},
          {"bias_bound", number_json(reference.bias_bound)}};
}

void put_point(Json& object, const AccuracyPoint& point) {
  object["method"] = point.method;
  object["samples"] = number_json(point.cost.samples_mean);
  object["rays"] = point.cost.rays;
  object["cpu_s"] = number_json(point.cost.cpu_seconds);
  object["wall_s"] = number_json(point.cost.wall_seconds);
  object["true_error"] = {{"rmse", number_json(point.truth.rmse)},
                          {"rmse_at_most", number_json(point.truth.rmse_at_most)},
                          {"resolved", point.truth.resolved},
                          {"rel_mse", number_json(point.truth.rel_mse)},
                          {"energy", number_json(point.truth.energy)}};
  object["estimate"] = optional_json(point.estimate);
  object["upper_95"] = optional_json(point.upper_95);
}

Json point_json(const AccuracyPoint& point) {
  Json object = Json::object();
  put_point(object, point);
  return object;
}

Json pick_json(const PlannerPick& pick) {
  Json object = {{"max_error", number_json(pick.max_error)}};
  put_point(object, pick.point);
  object["meets_target"] = pick.meets_target();
  object["keeps_bound"] = pick.keeps_bound();
  object["model"] = model_json(pick.model);
  object["passed_over"] = passed_over_json(pick.passed_over);
  object["warnings"] = pick.warnings;
  return object;
}

std::string in_unit(std::string_view unit, Length length) {
  const LengthUnit& suffix = unit_of_suffix(unit);
  char text[48];
  std::snprintf(text, sizeof text, "%.4g", suffix.number(length));
  return length == kInfinitelyFar ? "infinity" : text + (" " + std::string(suffix.symbol));
}

std::string camera_text(const CameraSpec& camera) {
  if (const auto* pinhole = std::get_if<PinholeSpec>(&camera.optics)) {
    return "pinhole of " + in_unit("_mm", pinhole->diameter) + ", " +
           in_unit("_mm", pinhole->image_distance) + " from the sensor";
  }
  const auto& lens = std::get<LensSpec>(camera.optics);
  char f_number[32];
  std::snprintf(f_number, sizeof f_number, "%.3g", lens.lens.f_number);
  return in_unit("_mm", lens.lens.focal_length) + " f/" + f_number + " focused at " +
         in_unit("_m", lens.focus_distance);
}

std::string scene_text(const RenderRequest& picture) {
  if (const auto* name = std::get_if<std::string>(&picture.scene)) return *name;
  const std::string& title = std::get<SceneDocument>(picture.scene).scene.title;
  return title.empty() ? "a scene without a title" : title;
}

}  // namespace

std::string chart_json(const ChartRequest& request, const AccuracyChart& chart) {
  Json points = Json::array();
  for (const AccuracyPoint& point : chart.points) points.push_back(point_json(point));
  Json picks = Json::array();
  for (const PlannerPick& pick : chart.picks) picks.push_back(pick_json(pick));
  const Json value = {{"reference", reference_json(chart.reference)},
                      {"points", std::move(points)},
                      {"picks", std::move(picks)},
                      {"refused", passed_over_json(chart.refused)},
                      {"threads", chart.threads},
                      {"request", Json::parse(request.picture.normalised)}};
  return json_text(value);
}

std::string chart_svg(const ChartRequest& request, const AccuracyChart& chart) {
  const SimulationSpec& shot = request.chart.shot;
  return accuracy_chart_svg(
      chart,
      {.title = "Time against true error: " + scene_text(request.picture),
       .subtitle = camera_text(shot.camera) + ", " + std::to_string(shot.width) + " x " +
                   std::to_string(shot.height) + " pixels, " + std::to_string(chart.threads) +
                   (chart.threads == 1 ? " thread" : " threads")});
}

}  // namespace fstop::api
