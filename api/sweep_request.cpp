#include "api/sweep_request.h"

#include <algorithm>
#include <map>
#include <utility>

#include "api/dataset_scene.h"
#include "api/json_reader.h"
#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/render_id.h"
#include "api/sweep_axis.h"
#include "api/sweep_recipe.h"
#include "core/build_stop.h"

namespace fstop::api {
namespace {

using nlohmann::json;

/// Faults of cells: each is told once, of the first cell that has it.
class CellFaults {
 public:
  explicit CellFaults(const Limits& limits) : most_(limits.faults) {}

  void add(const std::string& pointer, const std::string& detail, std::size_t cell) {
    const auto [place, is_new] = numbers_.try_emplace({pointer, detail}, faults_.size());
    if (is_new) {
      faults_.push_back({.pointer = pointer, .detail = detail, .cell = cell});
    } else {
      ++faults_[place->second].more;
    }
  }
  bool are_many() const { return faults_.size() >= most_; }
  bool empty() const { return faults_.empty(); }

  [[noreturn]] void fail(ErrorCode code) const {
    std::vector<FieldFault> list;
    for (const Fault& fault : faults_) {
      std::string where = "in cell " + std::to_string(fault.cell);
      if (fault.more > 0) where += " and " + std::to_string(fault.more) + " more";
      list.push_back({fault.pointer, where + ": " + fault.detail});
    }
    throw InvalidRequest(std::move(list), code);
  }

 private:
  struct Fault {
    std::string pointer = {};
    std::string detail = {};
    std::size_t cell = 0;
    std::size_t more = 0;
  };
  std::size_t most_;
  std::vector<Fault> faults_ = {};
  std::map<std::pair<std::string, std::string>, std::size_t> numbers_ = {};
};

bool is_at_or_below(const std::string& pointer, const std::string& above) {
  return pointer == above || pointer.starts_with(above + "/");
}

// Faults are looked for in this many bytes of requests: a base whose every cell is wrong is not
// read ten thousand times.
constexpr std::size_t kBytesWithFaults = std::size_t{4} << 20;
constexpr const char* kSomeScene = "scene";  // a name, for requests whose scene was read already

/// Makes the cells of an outline, one after the other.
class Expansion {
 public:
  Expansion(const SweepOutline& outline, const Limits& limits, SceneNames names)
      : outline_(outline), limits_(limits), names_(names), faults_(limits) {
    changes_scene_ = outline.recipe == Recipe::defocus_dataset;
    for (const AxisValues& axis : outline.axes) {
      fragments_.push_back(fragment_of(axis.member));
      changes_scene_ =
          changes_scene_ || axis.member.empty() || is_at_or_below(axis.member, "/scene");
    }
  }

  // The number of cells, within limits. Throws: InvalidRequest.
  std::size_t checked_count() const {
    if (outline_.recipe == Recipe::defocus_dataset) return outline_.images;
    double count = outline_.axes.empty() || !outline_.zips
                       ? 1.0
                       : static_cast<double>(outline_.axes.front().values.size());
    for (const AxisValues& axis : outline_.axes) {
      const std::size_t size = axis.values.size();
      if (!outline_.zips) {
        count *= static_cast<double>(size);
      } else if (size != outline_.axes.front().values.size()) {
        throw InvalidRequest(
            FieldFault{axis.where, "has " + std::to_string(size) + " values, the first axis " +
                                       std::to_string(outline_.axes.front().values.size()) +
                                       ": zipped axes are equally long"});
      }
    }
    if (count > static_cast<double>(limits_.sweep_cells)) {
      throw InvalidRequest(
          FieldFault{"#/axes", "make " + number_text(count) + " cells; at most " +
                                   std::to_string(limits_.sweep_cells) + " are allowed"},
          ErrorCode::over_budget);
    }
    return static_cast<std::size_t>(count);
  }

  void make_cells(SweepRequest& sweep) {
    const std::size_t count = checked_count();
    sweep.cells.reserve(count);
    for (std::size_t i = 0; i < count && !faults_.are_many(); ++i) {
      BuildStop::throw_if_requested();
      if (!faults_.empty() && bytes_ > kBytesWithFaults) break;
      make_cell(sweep, i, place_of(i));
    }
    if (!faults_.empty())
      faults_.fail(only_too_much_ ? ErrorCode::over_budget : ErrorCode::invalid_request);
  }

 private:
  // The number of cell `index`'s value on each axis: the last axis fastest.
  std::vector<std::uint32_t> place_of(std::size_t index) const {
    std::vector<std::uint32_t> place(outline_.axes.size());
    if (outline_.zips) {
      std::ranges::fill(place, static_cast<std::uint32_t>(index));
      return place;
    }
    for (std::size_t axis = place.size(); axis-- > 0;) {
      const std::size_t size = outline_.axes[axis].values.size();
      place[axis] = static_cast<std::uint32_t>(index % size);
      index /= size;
    }
    return place;
  }

  // The request of a cell; nothing where a value cannot be set.
  std::optional<json> request_of(std::size_t index, const std::vector<std::uint32_t>& place) {
    const auto number = static_cast<std::uint32_t>(index);
    if (outline_.recipe == Recipe::defocus_dataset) {
      json request = dataset_request(
          outline_.base,
          {.seed = *outline_.seed, .image = number, .images_per_scene = outline_.images_per_scene});
      request["seed"] = cell_seed(*outline_.seed, number);
      return request;
    }
    json request = outline_.base;
    // A seed that an axis sets is that axis'.
    if (outline_.seed) request["seed"] = cell_seed(*outline_.seed, number);
    for (std::size_t axis = 0; axis < place.size(); ++axis) {
      const AxisValues& values = outline_.axes[axis];
      const std::string why = set_member(request, values.member, values.values[place[axis]]);
      if (why.empty()) continue;
      faults_.add(values.where + "/member", why, index);
      only_too_much_ = false;
      return std::nullopt;
    }
    return request;
  }

  void make_cell(SweepRequest& sweep, std::size_t index, const std::vector<std::uint32_t>& place) {
    std::optional<json> request = request_of(index, place);
    if (!request) return;
    // Where all cells have one scene it is read with the first of them.
    const bool has_scene = !sweep.cells.empty() && !changes_scene_;
    if (has_scene) (*request)["scene"] = kSomeScene;
    const std::string text = json_text(*request);
    const std::size_t bytes = text.size() + (has_scene ? scene_bytes_ : 0);
    count_bytes(bytes, index);
    try {
      Limits whole = limits_;
      whole.body_bytes = limits_.scene_bytes;
      RenderRequest parsed = parse_render_request(text, whole, names_);
      if (parsed.spec.quality.max_time_ms) {
        only_too_much_ = false;
        return add_fault({"#/quality/max_time_ms",
                          "must be null in a sweep: how far a render gets in a time differs from "
                          "run to run"},
                         index, place);
      }
      json own = whole_request(parsed);
      if (has_scene) {
        own["scene"] = scene_;
      } else if (sweep.cells.empty()) {
        scene_ = own["scene"];
        scene_bytes_ = json_text(scene_).size();
      }
      sweep.cells.push_back({.request = json_text(own),
                             .spec = parsed.spec,
                             .scene = has_scene ? 0 : number_of_scene(sweep, *request, parsed),
                             .place = place});
    } catch (const InvalidRequest& invalid) {
      only_too_much_ = only_too_much_ && invalid.code() == ErrorCode::over_budget;
      for (const FieldFault& fault : invalid.faults()) add_fault(fault, index, place);
      return;
    }
    // With every default filled it is longer.
    const std::size_t whole_bytes = sweep.cells.back().request.size();
    count_bytes(whole_bytes > bytes ? whole_bytes - bytes : 0, index);
  }

  void add_fault(const FieldFault& fault, std::size_t index,
                 const std::vector<std::uint32_t>& place) {
    if (outline_.recipe == Recipe::defocus_dataset) {
      return faults_.add("#/base" + fault.pointer.substr(1), fault.detail, index);
    }
    for (std::size_t axis = 0; axis < place.size(); ++axis) {
      if (!is_at_or_below(fault.pointer, fragments_[axis])) continue;
      const AxisValues& values = outline_.axes[axis];
      const std::string rest = fault.pointer.substr(fragments_[axis].size());
      const std::string value =
          shortened(json_text(values.values[place[axis]]), limits_.echo_bytes / 2);
      return faults_.add(values.pointer_of(place[axis]) + rest,
                         fault.pointer + " = " + value + " " + fault.detail, index);
    }
    faults_.add("#/base" + fault.pointer.substr(1), fault.detail, index);
  }

  void count_bytes(std::size_t of_request, std::size_t index) {
    bytes_ += of_request;
    if (bytes_ <= limits_.sweep_bytes) return;
    throw InvalidRequest(
        FieldFault{"#", "has requests of more than " + std::to_string(limits_.sweep_bytes) +
                            " bytes in all, from cell " + std::to_string(index) + " on"},
        ErrorCode::over_budget);
  }

  static json whole_request(const RenderRequest& parsed) {
    json whole = json::parse(parsed.normalised);
    whole["image"]["format"] = format_name(parsed.format);
    whole["image"]["precision"] = parsed.precision == Precision::half ? "half" : "single";
    return whole;
  }

  // Scenes of a data set are made of what is bundled: none of them stands in the request.
  std::uint32_t number_of_scene(SweepRequest& sweep, const json& request, RenderRequest& parsed) {
    if (sweep.generates_scenes) return 0;
    const auto [place, is_new] = scenes_.try_emplace(
        json_text(request.at("scene")), static_cast<std::uint32_t>(sweep.scenes.size()));
    if (is_new) sweep.scenes.push_back(std::move(parsed));
    return place->second;
  }

  const SweepOutline& outline_;
  const Limits& limits_;
  SceneNames names_;
  std::vector<std::string> fragments_ = {};  // of the axes' members
  bool changes_scene_ = false;
  std::map<std::string, std::uint32_t> scenes_ = {};
  CellFaults faults_;
  json scene_ = {};  // the first cell's
  std::size_t scene_bytes_ = 0;
  std::size_t bytes_ = 0;      // of all requests so far
  bool only_too_much_ = true;  // all faults so far are of work asked for
};

// The middle of the picture, large enough for its blur and small enough to hold nothing else.
SlantedEdgeSpec middle_of(const SimulationSpec& spec) {
  return {.region = {.x = spec.width / 8,
                     .y = spec.height / 4,
                     .width = spec.width - 2 * (spec.width / 8),
                     .height = spec.height - 2 * (spec.height / 4)},
          .channel = 1,
          .levels = kTargetLevels};
}

}  // namespace

std::uint32_t cell_seed(std::uint32_t seed, std::uint32_t index) noexcept {
  std::uint64_t z = (std::uint64_t{seed} << 32) + 0x9E3779B97F4A7C15 * (std::uint64_t{index} + 1);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
  return static_cast<std::uint32_t>((z ^ (z >> 31)) >> 32);
}

SweepRequest parse_sweep_request(std::string_view body, const Limits& limits, SceneNames names) {
  const json value = parse_json(body, limits);
  FaultList faults(limits.faults);
  json normal;
  ObjectReader root(value, "#", faults, normal);
  faults.throw_if_any();  // no object: nothing further to say
  SweepRequest sweep;
  const SweepOutline outline = read_outline(root, limits);
  sweep.dry_run = root.boolean("dry_run", false);
  root.leave_out("dry_run");
  // With a fault not all was read that may stand there.
  if (faults.empty()) root.reject_unread_members();
  faults.throw_if_any();

  sweep.generates_scenes = outline.recipe == Recipe::defocus_dataset;
  Expansion expansion(outline, limits, sweep.generates_scenes ? SceneNames::stored_only : names);
  expansion.make_cells(sweep);
  for (const AxisValues& axis : outline.axes) {
    SweepAxis told{.member = axis.member};
    for (const json& one : axis.values) told.values.push_back(json_text(one));
    sweep.axes.push_back(std::move(told));
  }
  if (outline.measures_edge) sweep.edge = middle_of(sweep.cells.front().spec);
  sweep.recipe = json_text(normal);
  return sweep;
}

std::string sweep_id(const SweepRequest& request, std::span<const std::string> scene_hashes) {
  std::string hashes;
  for (const std::string& hash : scene_hashes) hashes += hash + ' ';
  return render_id("sweep " + request.recipe, hashes, engine_version());
}

InvalidRequest in_sweep(const InvalidRequest& of_scene, const SweepRequest& sweep) {
  constexpr std::string_view kScene = "#/scene";
  std::string where = "#/base/scene";
  for (std::size_t i = 0; i < sweep.axes.size(); ++i) {
    if (is_at_or_below(sweep.axes[i].member, "/scene")) where = "#/axes/" + std::to_string(i);
  }
  std::vector<FieldFault> faults = of_scene.faults();
  for (FieldFault& fault : faults) {
    if (fault.pointer.starts_with(kScene)) fault.pointer.replace(0, kScene.size(), where);
  }
  return InvalidRequest(std::move(faults), of_scene.code(), of_scene.unlisted());
}

std::string sweep_summary_json(const SweepSummary& summary) {
  return json_text(Json{{"sweep", summary.sweep},
                        {"cells", summary.cells},
                        {"kept", summary.kept},
                        {"made", summary.made},
                        {"failed", summary.failed},
                        {"manifest", summary.manifest}});
}

std::string sweep_cost_json(std::string_view id, std::size_t cells, const CostPrediction& cost) {
  return json_text(Json{{"sweep", id},
                        {"cells", cells},
                        {"predicted",
                         {{"samples", number_json(cost.samples)},
                          {"cpu_s", number_json(cost.cpu_s)},
                          {"wall_s", number_json(cost.wall_s)},
                          {"memory_bytes", number_json(cost.memory_bytes)}}}});
}

}  // namespace fstop::api
