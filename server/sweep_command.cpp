#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "api/json_text.h"
#include "api/scene_store.h"
#include "api/sweep_request.h"
#include "core/error.h"
#include "core/parallel.h"
#include "server/cell_work.h"
#include "server/commands.h"
#include "server/cost_model.h"
#include "server/progress_line.h"
#include "server/remote_cells.h"
#include "server/signal_stop.h"
#include "server/sweep_run.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

constexpr int kSomeFailed = 1;

// The hashes of the scenes that the request names or holds: so they are there and whole.
std::vector<std::string> scene_hashes(const api::SweepRequest& sweep, CellScenes& scenes) {
  std::vector<std::string> hashes;
  for (const api::RenderRequest& scene : sweep.scenes) {
    try {
      hashes.push_back(scenes.scene(scene).hash);
    } catch (const api::InvalidRequest& invalid) {
      throw api::in_sweep(invalid, sweep);
    }
  }
  return hashes;
}

void print(const std::string& text) {
  std::cout << text << '\n' << std::flush;
  if (!std::cout) throw Error(ErrorCode::io_failure, "cannot write to standard output");
}

void require_sweep(const SweepOptions& options) {
  if (options.remote.queue.empty() != options.remote.results.empty())
    throw Error(ErrorCode::invalid_request, "--queue and --results go together");
  require_split_cpu_s(options.remote.split_cpu_s);
  if (options.out.empty() && !options.dry_run)
    throw Error(ErrorCode::invalid_request, "--out must name a folder");
  if (options.resume && !SweepRun::is_in(options.out)) {
    throw Error(ErrorCode::invalid_request,
                "--resume goes on with a sweep, and " + options.out + " holds none");
  }
}

int run_sweep(const std::string& recipe, const fs::path& folder, const SweepOptions& options) {
  const api::Limits limits = api::command_line_limits();
  const api::SweepRequest sweep =
      api::parse_sweep_request(recipe, limits, api::SceneNames::stored_or_files);
  const bool is_dry = options.dry_run || sweep.dry_run;
  if (!is_dry) require_sweep(options);
  const api::SceneStore store(
      {options.scenes_dir.empty() ? bundled_scenes() : fs::path(options.scenes_dir)}, limits);
  std::stop_source stop;
  const SignalStop signals(stop);
  CellScenes scenes(store, limits, sweep.generates_scenes ? std::nullopt : std::optional(folder));
  const std::vector<std::string> hashes = scene_hashes(sweep, scenes);
  const std::string id = api::sweep_id(sweep, hashes);
  WorkerPool pool(options.threads);
  const CostModel costs(pool.threads());
  const std::string cost =
      api::sweep_cost_json(id, sweep.cells.size(), predicted_cost(costs, sweep, hashes));
  if (is_dry) return print(cost), 0;

  ProgressLine line("sweep", true);
  line.say(cost);
  const SweepRun::Listener listener{
      .progress =
          [&](std::size_t done, std::size_t all) {
            line.tell(static_cast<double>(done) / static_cast<double>(all));
          },
      .waiting =
          [&](std::string_view what) {
            line.say(what.empty() ? "goes on" : "waits for " + std::string(what));
          }};
  std::optional<ContentFolder> files;
  std::optional<SweepRun> run;
  const auto open = [&] {
    files.emplace(fs::path(options.out) / "files");
    run.emplace(sweep, id, options.out, *files, true);
  };
  when_there_is_room(open, listener.waiting, stop.get_token());
  const CellTools tools{.limits = limits, .scenes = scenes, .workers = pool};
  std::unique_ptr<CellMaker> maker;
  if (options.remote.queue.empty()) {
    maker = std::make_unique<LocalCellMaker>(tools, *files);
  } else {
    maker = std::make_unique<RemoteCells>(
        options.remote, *files, store,
        RemoteCells::Splitting{
            .tools = tools, .costs = costs, .cpu_s = options.remote.split_cpu_s});
  }
  const SweepRun::Summary summary = run->run(*maker, listener, stop.get_token());
  print(api::sweep_summary_json({.sweep = id,
                                 .cells = summary.cells,
                                 .kept = summary.kept,
                                 .made = summary.made,
                                 .failed = summary.failed,
                                 .manifest = run->manifest_file().string()}));
  return summary.failed > 0 ? kSomeFailed : 0;
}

}  // namespace

int sweep(const SweepOptions& options) {
  const fs::path folder =
      options.request == "-" ? fs::path(".") : fs::absolute(options.request).parent_path();
  return run_sweep(text_of(options.request, api::command_line_limits().body_bytes), folder,
                   options);
}

int dataset(const DatasetOptions& options) {
  std::string recipe = R"({"recipe": "defocus-dataset", "count": )" +
                       std::to_string(options.count) + R"(, "seed": )" +
                       std::to_string(options.seed) + R"(, "images_per_scene": )" +
                       std::to_string(options.images_per_scene);
  if (!options.base.empty()) {
    const api::Limits limits = api::command_line_limits();
    // Read on its own: no file may say more than the base.
    recipe += R"(, "base": )" +
              api::json_text(api::parse_json(text_of(options.base, limits.body_bytes), limits));
  }
  return run_sweep(recipe + "}", ".", options.sweep);
}

}  // namespace fstop::server
