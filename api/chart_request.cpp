#include "api/chart_request.h"

#include <algorithm>

#include "api/json_reader.h"
#include "api/json_text.h"
#include "api/simulation_json.h"

namespace fstop::api {
namespace {

using nlohmann::json;

// As large as a picture must be to hold a scene's edges, and small enough for a few seconds.
constexpr int kDefaultWidth = 192;
constexpr int kDefaultHeight = 128;

ImageSpec read_chart_image(ObjectReader& image, const Limits& limits) {
  ImageSpec size;
  size.width = static_cast<int>(image.integer("width", 1, limits.image_side, kDefaultWidth));
  size.height = static_cast<int>(image.integer("height", 1, limits.image_side, kDefaultHeight));
  image.reject_unread_members();
  return size;
}

std::vector<std::string> read_methods(ObjectReader& root, const std::vector<std::string>& all) {
  std::vector<Named<std::string_view>> words;
  for (const std::string& name : all) words.push_back({name, name});
  std::vector<std::string> methods;
  for (const std::string_view name : root.choices<std::string_view>("methods", words, "")) {
    methods.emplace_back(name);
  }
  if (!methods.empty()) return methods;
  root.normalise("methods", all);
  return all;
}

std::vector<int> read_samples(ObjectReader& root, const Limits& limits) {
  const std::vector<int> usual = AccuracyChartSpec{}.samples;
  std::vector<int> samples;
  for (const std::int64_t count :
       root.integers("samples", 1, limits.samples_per_pixel, limits.chart_counts,
                     std::vector<std::int64_t>(usual.begin(), usual.end()))) {
    samples.push_back(static_cast<int>(count));
  }
  return samples;
}

ReferenceSpec read_reference(ObjectReader& reference, const std::vector<std::string>& methods,
                             const Limits& limits) {
  ReferenceSpec spec;
  std::vector<Named<std::string_view>> words = {{"auto", ""}};
  for (const std::string& name : methods) words.push_back({name, name});
  spec.method = reference.choice<std::string_view>("method", words, "auto");
  spec.samples =
      static_cast<int>(reference.integer("samples", 1, limits.samples_per_pixel, spec.samples));
  spec.replicates = static_cast<int>(
      reference.integer("replicates", 2, limits.chart_replicates, spec.replicates));
  reference.reject_unread_members();
  return spec;
}

// What stands twice in a list would be rendered twice and tell nothing more.
template <typename Value>
void reject_repeats(ObjectReader& root, std::string_view key, const std::vector<Value>& list) {
  for (std::size_t i = 1; i < list.size(); ++i) {
    const auto end = list.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::find(list.begin(), end, list[i]) == end) continue;
    root.fault_at(root.pointer(key) + '/' + std::to_string(i), "must not stand twice");
  }
}

[[noreturn]] void over_budget(std::string pointer, const std::string& what, std::int64_t most) {
  throw InvalidRequest(FieldFault{std::move(pointer), what + "; at most " + std::to_string(most) +
                                                          " are allowed in a chart"},
                       ErrorCode::over_budget);
}

void require_budget(const AccuracyChartSpec& chart, const Limits& limits) {
  const std::int64_t pixels = std::int64_t{chart.shot.width} * chart.shot.height;
  if (pixels > limits.chart_pixels) {
    over_budget("#/image", "has " + std::to_string(pixels) + " pixels", limits.chart_pixels);
  }
  const std::int64_t samples = planned_samples(chart);
  if (samples > limits.chart_samples) {
    over_budget("#/samples",
                "asks, with methods and reference, for " + std::to_string(samples) +
                    " samples over all pixels",
                limits.chart_samples);
  }
}

}  // namespace

ChartRequest parse_chart_request(std::string_view body, const Limits& limits, SceneNames names) {
  const json value = parse_json(body, limits);
  FaultList faults(limits.faults);
  json normal;
  ObjectReader root(value, "#", faults, normal);
  faults.throw_if_any();  // no object: nothing further to say
  ChartRequest request;
  AccuracyChartSpec& chart = request.chart;
  const std::vector<std::string> all_methods = method_names();
  request.picture.scene = read_scene(root, names, limits, faults);
  ObjectReader camera = root.object("camera");
  chart.shot.camera = read_camera(camera);
  ObjectReader image = root.object("image");
  const ImageSpec size = read_chart_image(image, limits);
  ObjectReader effects = root.object("effects");
  chart.shot.effects = read_effects(effects);
  chart.shot.illumination = read_illumination(root);
  chart.shot.seed = static_cast<std::uint32_t>(root.integer("seed", 0, 0xFFFF'FFFF, 0));
  chart.methods = read_methods(root, all_methods);
  chart.samples = read_samples(root, limits);
  chart.max_errors =
      root.numbers("max_errors", {1e-6, 1.0}, limits.chart_targets, chart.max_errors);
  if (root.clean()) {  // placeholders of faulty elements may be alike
    reject_repeats(root, "samples", chart.samples);
    reject_repeats(root, "max_errors", chart.max_errors);
  }
  if (root.clean() && chart.samples.empty() && chart.max_errors.empty()) {
    root.fault("samples", "must not be empty where max_errors is: there would be no picture");
  }
  ObjectReader reference = root.object("reference");
  chart.reference = read_reference(reference, all_methods, limits);
  root.reject_unread_members();
  if (camera.clean() && image.clean()) require_square_pixels(image, size, chart.shot.camera);
  faults.throw_if_any();

  chart.shot.width = size.width;
  chart.shot.height = size.height;
  require_budget(chart, limits);
  request.picture.spec = chart.shot;
  request.picture.normalised = json_text(normal);
  normal.erase("scene");
  request.picture.canonical = json_text(normal);
  return request;
}

}  // namespace fstop::api
