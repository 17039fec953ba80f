#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/limits.h"
#include "api/problem.h"
#include "api/render_request.h"
#include "core/measure/slanted_edge.h"

namespace fstop::api {

/// One render of a sweep.
struct PlannedCell {
  std::string request = {};  // a whole render request, every default filled
  SimulationSpec spec = {};
  std::uint32_t scene = 0;                // index into SweepRequest::scenes
  std::vector<std::uint32_t> place = {};  // the number of its value on each axis
};

/// An axis as a manifest tells it.
struct SweepAxis {
  std::string member = {};               // JSON pointer into a request, "/camera/lens/f_number"
  std::vector<std::string> values = {};  // JSON texts
};

/// Many renders: every value of every one checked.
struct SweepRequest {
  /// The request with its defaults filled, sorted keys: equal texts, equal sweeps.
  std::string recipe = {};
  bool dry_run = false;
  /// Scenes are the sweep's own: their files are those of stored scenes, on the command line too.
  bool generates_scenes = false;
  std::vector<SweepAxis> axes = {};
  std::vector<PlannedCell> cells = {};       // the last axis fastest
  std::vector<RenderRequest> scenes = {};    // a request for each scene that stands in the request
  std::optional<SlantedEdgeSpec> edge = {};  // what is measured in each picture
};

/// Reads a sweep: {"base": a render request, "axes": [...], "combine": "cross" | "zip", "seed"} or
/// a named recipe (sweep_recipe.h). An axis sets one member of the base to one value after the
/// other:
/// {"member": "/camera/lens/f_number", "values": [2, 2.8]} or, instead of values,
/// "range": {"from", "to", "count" or "step", "spacing"} (core/study/sweep_range.h). "cross" makes
/// a cell of every combination, the last axis fastest; "zip" takes the axes' first values, then
/// their second ones. With "seed" every cell has a seed of its own, made of it and its number.
/// Throws: InvalidRequest with every fault, as parse_render_request; a fault of a cell points to
/// the
///         axis' value that it comes from ("#/axes/1/values/3"), else into "#/base", and names the
///         cell.
SweepRequest parse_sweep_request(std::string_view body, const Limits& limits, SceneNames names);

/// The seed of cell `index`: the upper half of SplitMix64's number `index` from `seed`.
/// Source: Steele, Lea & Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
std::uint32_t cell_seed(std::uint32_t seed, std::uint32_t index) noexcept;

/// The content hash that names a sweep: of its recipe, the hashes of its `scenes` and the engine.
std::string sweep_id(const SweepRequest& request, std::span<const std::string> scene_hashes);

/// The faults of a scene of `sweep` as faults of the sweep: those of the axis that sets it, or of
/// its base.
InvalidRequest in_sweep(const InvalidRequest& of_scene, const SweepRequest& sweep);

/// How a sweep on the command line ended.
struct SweepSummary {
  std::string sweep = {};
  std::size_t cells = 0;
  std::size_t kept = 0;  // recorded by earlier runs
  std::size_t made = 0;
  std::size_t failed = 0;  // of all
  std::string manifest = {};
};
std::string sweep_summary_json(const SweepSummary& summary);

/// {"sweep", "cells", "predicted": {"samples", "cpu_s", "wall_s", "memory_bytes"}}: samples and
/// seconds of all cells, memory of the largest.
std::string sweep_cost_json(std::string_view id, std::size_t cells, const CostPrediction& cost);

}  // namespace fstop::api
