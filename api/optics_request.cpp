#include "api/optics_request.h"

#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "api/json_reader.h"
#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/length_unit.h"
#include "api/simulation_json.h"
#include "core/error.h"
#include "core/optics/pinhole.h"
#include "core/optics/pinhole_figures.h"

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

constexpr double kRounding = 1e-12;  // of a figure over its best

// A figure of merit and the best that any hole has of it; the same for every f' and lambda.
struct FigureOfMerit {
  std::string_view criterion = {};
  PinholeFigure figure = {};
  double best = 0.0;
};

const std::vector<FigureOfMerit>& figures_of_merit() {
  static const std::vector<FigureOfMerit> figures = [] {
    std::vector<FigureOfMerit> list;
    for (const PinholeCriterion& criterion : pinhole_criteria()) {
      const std::optional<PinholeFigure> figure = pinhole_figure(criterion.name);
      if (!figure) continue;
      list.push_back({criterion.name, *figure, figure_value(*figure, best_coefficient(*figure))});
    }
    return list;
  }();
  return figures;
}

// None where a hole of coefficient c has no such figure: too large, or a ring outshines the axis.
std::optional<double> figure_at(PinholeFigure figure, double c) {
  try {
    return figure_value(figure, c);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::outside_domain) throw;
    return std::nullopt;
  }
}

// All figures at c, in the order of figures_of_merit().
using Figures = std::vector<std::optional<double>>;

Figures figures_at(double c) {
  Figures values;
  for (const FigureOfMerit& merit : figures_of_merit()) {
    values.push_back(figure_at(merit.figure, c));
  }
  return values;
}

// At the optimum of every criterion, computed once.
const std::vector<Figures>& figures_at_optima() {
  static const std::vector<Figures> table = [] {
    std::vector<Figures> rows;
    for (const PinholeCriterion& criterion : pinhole_criteria()) {
      rows.push_back(figures_at(criterion.coefficient));
    }
    return rows;
  }();
  return table;
}

// A figure's unit, and how many of them sqrt(f' lambda) = `scale` makes of its reduced value.
struct FigureUnit {
  std::string_view name = {};
  double factor = 1.0;
};

FigureUnit unit_of(PinholeFigure figure, Length scale) {
  const double millimetres = unit_of_suffix("_mm").number(scale);
  switch (figure) {
    case PinholeFigure::brightest:
      return {"1", 1.0};
    case PinholeFigure::peak_per_energy:
      return {"1/mm^2", 1.0 / (millimetres * millimetres)};
    case PinholeFigure::energy50:
    case PinholeFigure::energy80:
    case PinholeFigure::fwhm:
      return {"mm", millimetres};
    case PinholeFigure::mtf50:
    case PinholeFigure::mtf10:
    case PinholeFigure::line_spread:
      return {"cycles/mm", 1.0 / millimetres};
  }
  throw Error(ErrorCode::internal, "a pinhole figure without a unit");
}

// What each figure is in a camera of sqrt(f' lambda) = `scale`, and how far behind its best.
Json figures_json(const Figures& values, Length scale) {
  Json list = Json::array();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const FigureOfMerit& merit = figures_of_merit()[i];
    const FigureUnit unit = unit_of(merit.figure, scale);
    Json& item = list.emplace_back(
        Json{{"criterion", merit.criterion}, {"value", nullptr}, {"unit", unit.name}});
    item["loss"] = nullptr;
    if (!values[i]) continue;
    const double ratio = *values[i] / merit.best;
    item["value"] = number_json(*values[i] * unit.factor);
    const double loss = larger_is_better(merit.figure) ? 1.0 - ratio : ratio - 1.0;
    item["loss"] = number_json(std::abs(loss) < kRounding ? 0.0 : loss);
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
  const Length scale = sqrt(image_distance * camera.wavelength);
  Json& criteria = value["criteria"] = Json::array();
  for (std::size_t i = 0; i < pinhole_criteria().size(); ++i) {
    const PinholeCriterion& criterion = pinhole_criteria()[i];
    Json& item = criteria.emplace_back(Json{{"criterion", criterion.name},
                                            {"coefficient", number_json(criterion.coefficient)},
                                            {"meaning", criterion.meaning}});
    put_length(item, "diameter_mm",
               optimal_pinhole_diameter(image_distance, camera.wavelength, criterion.coefficient));
    item["figures"] = figures_json(figures_at_optima()[i], scale);
  }
  if (const auto* hole = std::get_if<PinholeSpec>(&camera.optics)) {
    put_length(value, "diameter_mm", hole->diameter);
    value["fresnel_number"] =
        number_json(fresnel_number(hole->diameter, image_distance, camera.wavelength));
    value["figures"] = figures_json(figures_at(hole->diameter / scale), scale);
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
