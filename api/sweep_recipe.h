#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/json_reader.h"
#include "api/limits.h"
#include "api/sweep_axis.h"
#include "core/measure/slanted_edge.h"

namespace fstop::api {

/// Recipes by name, each with members of its own beside "base":
///
///     focus-stack        near_m, far_m, count: focus distances of equal steps in dioptres
///     aperture-bracket   from, to, step_thirds: f-numbers 2^(n/6)
///     pinhole-series     from_mm, to_mm, count: diameters of equal ratios
///     through-focus-mtf  target_m, near_m, far_m, count: a slanted edge at target_m, photographed
///                        at as many focus distances, its MTF measured in each picture
///     defocus-dataset    count, seed, images_per_scene: scenes at random (dataset_scene.h)
enum class Recipe {
  none,
  focus_stack,
  aperture_bracket,
  pinhole_series,
  through_focus_mtf,
  defocus_dataset
};

/// A sweep before its cells are made.
struct SweepOutline {
  Recipe recipe = Recipe::none;
  nlohmann::json base = {};
  std::vector<AxisValues> axes = {};
  bool zips = false;
  std::optional<std::uint32_t> seed = {};
  bool measures_edge = false;
  std::uint32_t images = 0;            // of a data set
  std::uint32_t images_per_scene = 1;  // of a data set
};

/// Reads all members of a sweep's request but "dry_run"; faults go to the reader's list.
SweepOutline read_outline(ObjectReader& root, const Limits& limits);

/// The levels of the edge that through-focus-mtf photographs.
constexpr EdgeLevels kTargetLevels{.dark = 0.1, .bright = 0.9};

}  // namespace fstop::api
