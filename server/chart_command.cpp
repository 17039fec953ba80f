#include <filesystem>
#include <iostream>
#include <stop_token>
#include <string>

#include "api/chart_request.h"
#include "api/scene_store.h"
#include "core/error.h"
#include "core/parallel.h"
#include "server/commands.h"
#include "server/progress_line.h"
#include "server/signal_stop.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

bool is_drawing(const fs::path& out) {
  if (out.empty() || out.extension() == ".json") return false;
  if (out.extension() == ".svg") return true;
  throw Error(ErrorCode::unsupported,
              "--out must end in .svg or .json, not in " +
                  (out.extension().empty() ? out.filename().string() : out.extension().string()));
}

AccuracyChart measured(const api::ChartRequest& request, const ChartOptions& options,
                       const api::Limits& limits) {
  const fs::path folder =
      options.request == "-" ? fs::path(".") : fs::absolute(options.request).parent_path();
  const api::SceneStore store(
      {options.scenes_dir.empty() ? bundled_scenes() : fs::path(options.scenes_dir)}, limits);
  std::stop_source stop;
  const SignalStop signals(stop);
  ProgressLine line("chart", options.progress);
  const RayScene scene(api::load_beside(request.picture, folder, store, limits).scene);
  WorkerPool pool(options.threads);
  const RunControl run{.stop = stop.get_token(),
                       .progress = [&](double share) { line.tell(share); },
                       .workers = &pool};
  try {
    return accuracy_chart(request.chart, scene, run);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::cancelled) throw;
    throw Error(ErrorCode::cancelled,
                "the chart was stopped by a signal before it was done; nothing was written");
  }
}

}  // namespace

int chart(const ChartOptions& options) {
  const bool draws = is_drawing(options.out);
  const api::Limits limits = api::command_line_limits();
  const api::ChartRequest request = api::parse_chart_request(
      text_of(options.request, limits.body_bytes), limits, api::SceneNames::stored_or_files);
  const AccuracyChart chart = measured(request, options, limits);
  const std::string numbers = api::chart_json(request, chart);
  if (!options.out.empty()) {
    write_file(options.out, draws ? api::chart_svg(request, chart) : numbers + "\n");
  }
  std::cout << numbers << '\n' << std::flush;
  if (!std::cout) throw Error(ErrorCode::io_failure, "cannot write to standard output");
  return 0;
}

}  // namespace fstop::server
