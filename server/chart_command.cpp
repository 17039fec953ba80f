#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <stop_token>
#include <string>
#include <thread>
#include <unistd.h>

#include "api/chart_request.h"
#include "api/scene_store.h"
#include "core/error.h"
#include "core/parallel.h"
#include "server/commands.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

/// While it lives, the first SIGINT or SIGTERM stops `stop`, and a second one ends the process.
/// Made before other threads are: they inherit that these signals wait for it.
class SignalStop {
 public:
  explicit SignalStop(std::stop_source& stop) {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, &before_);
    watcher_ = std::jthread([this, &stop](const std::stop_token& done) { watch(stop, done); });
  }
  ~SignalStop() {
    watcher_.request_stop();
    watcher_.join();
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  SignalStop(const SignalStop&) = delete;
  SignalStop& operator=(const SignalStop&) = delete;

 private:
  void watch(std::stop_source& stop, const std::stop_token& done) const {
    constexpr std::timespec kLookAgain = {.tv_sec = 0, .tv_nsec = 20'000'000};
    while (!done.stop_requested()) {
      const int number = sigtimedwait(&signals_, nullptr, &kLookAgain);
      if (number > 0 && !stop.request_stop()) ::_exit(128 + number);
    }
  }

  sigset_t signals_ = {};
  sigset_t before_ = {};
  std::jthread watcher_;
};

/// Tells progress on standard error: in place on a terminal, else a line each twentieth.
class ProgressLine {
 public:
  explicit ProgressLine(bool is_wanted)
      : is_terminal_(::isatty(STDERR_FILENO) == 1), is_told_(is_wanted || is_terminal_) {}
  ~ProgressLine() {
    if (is_told_ && is_terminal_ && told_ >= 0) std::fputs("\r\033[K", stderr);
  }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void tell(double share) {
    const int step = is_terminal_ ? 1 : 5;  // percent
    const int percent = static_cast<int>(100.0 * share) / step * step;
    if (!is_told_ || percent <= told_) return;
    told_ = percent;
    std::fprintf(stderr, is_terminal_ ? "\rchart: %d %%" : "chart: %d %%\n", percent);
    std::fflush(stderr);
  }

 private:
  bool is_terminal_;
  bool is_told_;
  int told_ = -1;
};

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
  ProgressLine line(options.progress);
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
