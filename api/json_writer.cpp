#include "api/json_writer.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "api/length_unit.h"
#include "core/error.h"

namespace fstop::api {

Json number_json(double value) {
  if (value == std::numeric_limits<double>::infinity()) return "infinity";
  if (!std::isfinite(value))
    throw Error(ErrorCode::internal, "a number of an answer is not a number");
  return value;
}

void put_length(Json& object, std::string_view key, Length value) {
  object[std::string(key)] = number_json(unit_of_suffix(key).number(value));
}

Json optics_members(const OpticalSummary& summary) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  Json optics = Json::object();
  put_length(optics, "image_distance_mm", summary.image_distance);
  optics["magnification"] = number_json(summary.magnification);
  put_length(optics, "near_m", summary.near);
  put_length(optics, "far_m", summary.far);
  put_length(optics, "hyperfocal_m", summary.hyperfocal);
  put_length(optics, "coc_limit_mm", summary.coc_limit);
  optics["f_number_effective"] = number_json(summary.working_f_number);
  put_length(optics, "airy_diameter_um", summary.airy_diameter);
  optics["view_angle_deg"] = {number_json(summary.view_angle[0] * kDegrees),
                              number_json(summary.view_angle[1] * kDegrees)};
  const Json focal = number_json(summary.focal_px);
  optics["intrinsics_px"] = {{focal, 0.0, number_json(summary.principal_point.x)},
                             {0.0, focal, number_json(summary.principal_point.y)},
                             {0.0, 0.0, 1.0}};
  optics["relative_illuminance"] = {{"on_axis", number_json(summary.illuminance_on_axis)},
                                    {"at_corner", number_json(summary.illuminance_at_corner)}};
  return optics;
}

Json model_json(const std::vector<ModelledEffect>& model) {
  Json list = Json::array();
  for (const ModelledEffect& effect : model) {
    list.push_back({{"effect", effect.effect},
                    {"modelled", effect.modelled},
                    {"bound", number_json(effect.bound)},
                    {"why", effect.why}});
  }
  return list;
}

Json passed_over_json(const std::vector<PassedOverMethod>& passed_over) {
  Json list = Json::array();
  for (const PassedOverMethod& method : passed_over) {
    list.push_back({{"method", method.method}, {"why", method.why}});
  }
  return list;
}

}  // namespace fstop::api
