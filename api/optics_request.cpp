#include "api/optics_request.h"

#include "api/json_reader.h"
#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/simulation_json.h"
#include "core/error.h"
#include "core/optics/pinhole.h"

namespace fstop::api {
namespace {

Json planes_json(const std::vector<ObjectPlane>& planes) {
  Json list = Json::array();
  for (const ObjectPlane& plane : planes) {
    Json& item = list.emplace_back(Json::object());
    put_length(item, "object_distance_m", plane.object_distance);
    put_length(item, "image_distance_mm", plane.image_distance);
    put_length(item, "coc_mm", plane.blur_diameter);
    item["coc_px"] = number_json(plane.blur_px);
  }
  return list;
}

// The best hole at this camera's image distance by every criterion, and the hole it has.
Json pinhole_json(const CameraSpec& camera, Length image_distance) {
  Json value = Json::object();
  put_length(value, "image_distance_mm", image_distance);
  put_length(value, "wavelength_nm", camera.wavelength);
  put_length(value, "optimal_diameter_mm",
             optimal_pinhole_diameter(image_distance, camera.wavelength));
  Json& criteria = value["criteria"] = Json::array();
  for (const PinholeCriterion& criterion : pinhole_criteria()) {
    Json& item = criteria.emplace_back(Json{{"criterion", criterion.name},
                                            {"coefficient", number_json(criterion.coefficient)},
                                            {"meaning", criterion.meaning}});
    put_length(item, "diameter_mm",
               optimal_pinhole_diameter(image_distance, camera.wavelength, criterion.coefficient));
  }
  if (const auto* hole = std::get_if<PinholeSpec>(&camera.optics)) {
    put_length(value, "diameter_mm", hole->diameter);
    value["fresnel_number"] =
        number_json(fresnel_number(hole->diameter, image_distance, camera.wavelength));
  }
  return value;
}

// What a render would start from. A camera that no method can render still has its numbers.
Json plan_json(const SimulationSpec& spec) {
  try {
    const Plan plan = plan_for(spec, nullptr);
    return {{"method", plan.method},
            {"model", model_json(plan.model)},
            {"passed_over", passed_over_json(plan.passed_over)},
            {"warnings", plan.warnings}};
  } catch (const Error& error) {
    if (error.code() != ErrorCode::no_valid_method) throw;
    return {{"method", nullptr},
            {"model", Json::array()},
            {"passed_over", Json::array()},
            {"warnings", Json::array({error.what()})}};
  }
}

}  // namespace

OpticsRequest parse_optics_request(std::string_view body, const Limits& limits) {
  const nlohmann::json value = parse_json(body, limits);
  FaultList faults(limits.faults);
  nlohmann::json normal;
  ObjectReader root(value, "#", faults, normal);
  faults.throw_if_any();
  OpticsRequest request;
  ObjectReader camera = root.object("camera");
  request.spec.camera = read_camera(camera);
  ObjectReader image = root.object("image");
  const ImageSpec size = read_image(image, limits);
  request.spec.width = size.width;
  request.spec.height = size.height;
  ObjectReader quality = root.object("quality");
  request.spec.quality = read_quality(quality, limits);
  ObjectReader effects = root.object("effects");
  request.spec.effects = read_effects(effects);
  if (root.has("coc_limit_mm")) {
    request.coc_limit = root.length("coc_limit_mm", 0.000001_mm, 1000.0_mm);
  }
  request.object_distances = root.lengths("object_distances_m", 0.0001_m, kInfinitelyFar,
                                          static_cast<std::size_t>(limits.object_distances));
  root.reject_unread_members();
  if (camera.clean() && image.clean()) require_square_pixels(image, size, request.spec.camera);
  faults.throw_if_any();
  return request;
}

std::string optics_json(const OpticsRequest& request) {
  const CameraSpec& camera = request.spec.camera;
  const Sensor sensor = sensor_of(camera, request.spec.width, request.spec.height);
  const OpticalSummary summary =
      optical_summary(camera, sensor, request.coc_limit, request.object_distances);
  Json answer = optics_members(summary);
  answer["at"] = planes_json(summary.at);
  answer["pinhole"] = pinhole_json(camera, summary.image_distance);
  answer["plan"] = plan_json(request.spec);
  return json_text(answer);
}

}  // namespace fstop::api
