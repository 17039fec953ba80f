#include "api/sweep_recipe.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "core/study/sweep_range.h"

namespace fstop::api {
namespace {

using nlohmann::json;

constexpr Named<Recipe> kRecipes[] = {{"focus-stack", Recipe::focus_stack},
                                      {"aperture-bracket", Recipe::aperture_bracket},
                                      {"pinhole-series", Recipe::pinhole_series},
                                      {"through-focus-mtf", Recipe::through_focus_mtf},
                                      {"defocus-dataset", Recipe::defocus_dataset}};
constexpr Named<bool> kCombinations[] = {{"cross", false}, {"zip", true}};

constexpr const char* kFocus = "/camera/lens/focus_distance_m";
// Steep enough for the method, and no ratio of small whole numbers.
constexpr double kSlant = 5.0 * std::numbers::pi / 180.0;
constexpr double kTargetSide = 50.0;  // of its distance: beyond every frame

int cell_count(ObjectReader& root, const Limits& limits) {
  return static_cast<int>(root.integer("count", 1, static_cast<std::int64_t>(limits.sweep_cells)));
}

AxisValues focus_axis(ObjectReader& root, const Limits& limits) {
  const SweepRange range{.from = root.length("near_m", 0.01_m, kInfinitelyFar).si(),
                         .to = root.length("far_m", 0.01_m, kInfinitelyFar).si(),
                         .count = cell_count(root, limits),
                         .spacing = Spacing::reciprocal};
  return range_axis(root, "count", kFocus, range, limits);
}

AxisValues aperture_axis(ObjectReader& root, const Limits& limits) {
  const SweepRange range{.from = root.number("from", {0.5, 256.0}),
                         .to = root.number("to", {0.5, 256.0}),
                         .step = static_cast<double>(root.integer("step_thirds", 1, 54, 3)),
                         .spacing = Spacing::third_stop};
  return range_axis(root, "step_thirds", "/camera/lens/f_number", range, limits);
}

AxisValues pinhole_axis(ObjectReader& root, const Limits& limits) {
  // In the member's own unit: ratios have none.
  const SweepRange range{.from = root.number("from_mm", {1e-3, 100.0}),
                         .to = root.number("to_mm", {1e-3, 100.0}),
                         .count = cell_count(root, limits),
                         .spacing = Spacing::log};
  return range_axis(root, "count", "/camera/pinhole/diameter_mm", range, limits);
}

json grey(double level) { return json::array({level, level, level}); }

// Two halves of a plane that meet in a straight line, both as bright from everywhere.
json target_scene(double distance) {
  const double side = kTargetSide * distance;
  const double along_x = std::sin(kSlant);
  const double along_y = std::cos(kSlant);
  const auto half = [&](const char* material, double direction) {
    return json{{"type", "quad"},
                {"corner_m", {-side * along_x, -side * along_y, -distance}},
                {"edge_u_m", {direction * side * along_y, -direction * side * along_x, 0.0}},
                {"edge_v_m", {2.0 * side * along_x, 2.0 * side * along_y, 0.0}},
                {"material", material}};
  };
  return {{"format", "fstop-scene/1"},
          {"materials",
           {{"dark", {{"model", "unlit"}, {"emission", grey(kTargetLevels.dark)}}},
            {"bright", {{"model", "unlit"}, {"emission", grey(kTargetLevels.bright)}}}}},
          {"objects", json::array({half("bright", 1.0), half("dark", -1.0)})}};
}

void require_absent(ObjectReader& root, const json& base, const char* pointer, const char* why) {
  if (base.contains(json::json_pointer(pointer)))
    root.fault_at(root.pointer("base") + pointer, std::string("must be absent: ") + why);
}

void aim_at_target(ObjectReader& root, SweepOutline& outline) {
  const double distance = root.length("target_m", 0.01_m, 1e5_m).si();
  constexpr const char* kWhy = "the recipe has its own target, straight before the camera";
  for (const char* pointer : {"/scene", "/camera/position_m", "/camera/look_at_m", "/camera/up"})
    require_absent(root, outline.base, pointer, kWhy);
  if (!root.clean()) return;
  outline.base["scene"] = target_scene(distance);
  set_member(outline.base, "/image/format", "exr");  // linear values, as they are measured
  outline.measures_edge = true;
}

void read_dataset(ObjectReader& root, const Limits& limits, SweepOutline& outline) {
  constexpr const char* kWhy = "the recipe makes scenes and cameras of its own";
  for (const char* pointer : {"/scene", "/camera"})
    require_absent(root, outline.base, pointer, kWhy);
  outline.images = static_cast<std::uint32_t>(cell_count(root, limits));
  outline.images_per_scene =
      static_cast<std::uint32_t>(root.integer("images_per_scene", 1, 1000, 1));
}

void read_base(ObjectReader& root, SweepOutline& outline) {
  const bool is_required = outline.recipe != Recipe::defocus_dataset;
  const json* base = root.value("base", is_required);
  outline.base = base == nullptr ? json::object() : *base;
  if (outline.base.is_object()) return;
  root.fault("base", "must be an object, got " + std::string(outline.base.type_name()));
  outline.base = json::object();
}

void read_recipe(ObjectReader& root, const Limits& limits, SweepOutline& outline) {
  switch (outline.recipe) {
    case Recipe::none:
      outline.axes = read_axes(root, limits);
      outline.zips = root.choice<bool>("combine", kCombinations, "cross");
      break;
    case Recipe::focus_stack:
      outline.axes = {focus_axis(root, limits)};
      break;
    case Recipe::aperture_bracket:
      outline.axes = {aperture_axis(root, limits)};
      break;
    case Recipe::pinhole_series:
      outline.axes = {pinhole_axis(root, limits)};
      break;
    case Recipe::through_focus_mtf:
      outline.axes = {focus_axis(root, limits)};
      aim_at_target(root, outline);
      break;
    case Recipe::defocus_dataset:
      read_dataset(root, limits, outline);
      break;
  }
}

}  // namespace

SweepOutline read_outline(ObjectReader& root, const Limits& limits) {
  SweepOutline outline;
  if (root.has("recipe")) outline.recipe = root.choice<Recipe>("recipe", kRecipes);
  read_base(root, outline);
  if (root.clean()) read_recipe(root, limits, outline);
  if (const auto seed = root.optional_integer("seed", 0, 0xFFFF'FFFF)) {
    outline.seed = static_cast<std::uint32_t>(*seed);
  } else if (outline.recipe == Recipe::defocus_dataset) {
    outline.seed = 0;
    root.normalise("seed", 0);
  } else {
    root.leave_out("seed");
  }
  return outline;
}

}  // namespace fstop::api
