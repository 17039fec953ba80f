#include "server/sweep_run.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/file.h>
#include <utility>

#include "api/sweep_manifest.h"
#include "core/error.h"
#include "server/commands.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStateFile = "state.db";

Descriptor locked(const fs::path& folder) {
  make_folder_durably(folder);
  Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor.get() < 0) {
    throw Error(ErrorCode::io_failure,
                "cannot open " + folder.string() + ": " + std::strerror(errno));
  }
  if (::flock(descriptor.get(), LOCK_EX | LOCK_NB) != 0) {
    throw Error(ErrorCode::invalid_request,
                "another process sweeps into " + folder.string() + " now");
  }
  return descriptor;
}

api::ManifestCell told(const CellOutcome& outcome) {
  api::ManifestCell cell{
      .render_id = outcome.render_id, .report = outcome.report, .problem = outcome.problem};
  for (const CellFile& file : outcome.files)
    cell.files.push_back({.name = file.name, .sha256 = file.sha256, .bytes = file.bytes});
  return cell;
}

}  // namespace

SweepRun::SweepRun(const api::SweepRequest& sweep, std::string id, fs::path folder,
                   ContentFolder& files, bool names_files)
    : sweep_(sweep),
      id_(std::move(id)),
      folder_(std::move(folder)),
      files_(files),
      names_files_(names_files),
      lock_(locked(folder_)),
      state_(folder_ / kStateFile) {
  const std::optional<std::string> there = state_.fact("sweep");
  if (there && *there != id_) {
    throw Error(
        ErrorCode::invalid_request,
        folder_.string() + " holds another sweep: of another recipe, scene or version of fstop");
  }
  if (there) return;
  state_.set_fact("cells", std::to_string(sweep_.cells.size()));
  state_.set_fact("sweep", id_);
}

bool SweepRun::is_in(const fs::path& folder) { return fs::exists(folder / kStateFile); }

// The cells without an outcome whose files are all there.
std::vector<SweepCell> SweepRun::missing() {
  std::vector<bool> is_there(sweep_.cells.size(), false);
  for (const std::uint32_t index : state_.recorded()) {
    const std::optional<CellOutcome> outcome = state_.outcome(index);
    const auto is_whole = [&](const CellFile& file) { return files_.is_whole(file); };
    if (outcome && index < is_there.size() && std::ranges::all_of(outcome->files, is_whole)) {
      is_there[index] = true;
    } else {
      state_.forget(index);
    }
  }
  std::vector<SweepCell> cells;
  for (std::uint32_t i = 0; i < is_there.size(); ++i) {
    if (is_there[i]) continue;
    cells.push_back({.sweep = id_, .index = i, .request = sweep_.cells[i].request});
  }
  return cells;
}

// The names come first: what is recorded is all there.
void SweepRun::keep(const CellOutcome& outcome) {
  if (names_files_) {
    for (const CellFile& file : outcome.files) {
      link_durably(files_.path_of(file.sha256),
                   folder_ / api::path_of_cell_file(outcome.index, file.name));
    }
  }
  state_.record(outcome);
}

SweepRun::Summary SweepRun::run(CellMaker& maker, const Listener& listener,
                                const std::stop_token& stop) {
  Summary summary{.cells = sweep_.cells.size()};
  const auto tell = [&] {
    if (listener.progress) listener.progress(summary.kept + summary.made, summary.cells);
  };
  const WaitingFor waiting = [&](std::string_view what) {
    if (listener.waiting) listener.waiting(what);
  };
  std::vector<SweepCell> cells;
  when_there_is_room([&] { cells = missing(); }, waiting, stop);
  summary.kept = summary.cells - cells.size();
  tell();
  if (!cells.empty()) {
    maker.make(cells,
               {.done =
                    [&](const CellOutcome& outcome) {
                      when_there_is_room([&] { keep(outcome); }, waiting, stop);
                      ++summary.made;
                      tell();
                    },
                .waiting = waiting},
               stop);
  }
  if (summary.made < cells.size()) {
    if (!stop.stop_requested()) throw Error(ErrorCode::internal, "cells were left out");
    throw Error(ErrorCode::cancelled,
                "the sweep was stopped: " + std::to_string(summary.kept + summary.made) + " of " +
                    std::to_string(summary.cells) + " cells are recorded");
  }
  const std::string text = manifest();
  when_there_is_room([&] { write_durably(manifest_file().string(), text); }, waiting, stop);
  summary.failed = state_.failed();
  return summary;
}

std::string SweepRun::manifest() {
  return api::sweep_manifest(sweep_, id_, [&](std::uint32_t index) {
    const std::optional<CellOutcome> outcome = state_.outcome(index);
    if (!outcome) throw Error(ErrorCode::internal, "a recorded cell is gone");
    api::ManifestCell cell = told(*outcome);
    if (!sweep_.edge || !cell.problem.empty()) return cell;
    const std::optional<std::string> picture = files_.get(cell.files.front().sha256);
    if (!picture) throw Error(ErrorCode::io_failure, "a picture of the sweep is damaged");
    const SimulationSpec& spec = sweep_.cells[index].spec;
    cell.measurement = api::edge_measurement(std::as_bytes(std::span(*picture)), *sweep_.edge,
                                             spec.camera.sensor_width / spec.width);
    return cell;
  });
}

api::CostPrediction predicted_cost(const CostModel& costs, const api::SweepRequest& sweep,
                                   const std::vector<std::string>& scene_hashes) {
  api::CostPrediction all;
  for (const api::PlannedCell& cell : sweep.cells) {
    const std::string hash =
        cell.scene < scene_hashes.size() ? scene_hashes[cell.scene] : std::string();
    const api::CostPrediction one = costs.predict(cell.spec, hash);
    all.samples += one.samples;
    all.cpu_s += one.cpu_s;
    all.wall_s += one.wall_s;
    all.memory_bytes = std::max(all.memory_bytes, one.memory_bytes);
  }
  return all;
}

}  // namespace fstop::server
