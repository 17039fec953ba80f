#include <array>
#include <chrono>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <unistd.h>

#include "core/error.h"
#include "core/parallel.h"
#include "server/cell_work.h"
#include "server/commands.h"
#include "server/http_file_store.h"
#include "server/log.h"
#include "server/nats_queue.h"
#include "server/queue_worker.h"
#include "server/worker_scenes.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

/// The first SIGTERM or SIGINT lets the cell in hand be finished within a time, then abandons it; a
/// second one abandons it at once, a third one ends the process. Made before other threads are:
/// they inherit that these signals wait for it.
class WorkerSignals {
 public:
  explicit WorkerSignals(std::chrono::milliseconds drain) : drain_(drain) {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    watcher_ = std::jthread([this](const std::stop_token& done) { watch(done); });
  }
  std::stop_token stop() const { return stop_.get_token(); }
  std::stop_token abandon() const { return abandon_.get_token(); }

 private:
  void watch(const std::stop_token& done) {
    constexpr std::timespec kLookAgain = {.tv_sec = 0, .tv_nsec = 20'000'000};
    std::optional<std::chrono::steady_clock::time_point> deadline;
    while (!done.stop_requested()) {
      const int number = sigtimedwait(&signals_, nullptr, &kLookAgain);
      const auto now = std::chrono::steady_clock::now();
      if (number > 0 && !deadline) {
        stop_.request_stop();
        deadline = now + drain_;
      } else if (number > 0 && !abandon_.request_stop()) {
        ::_exit(128 + number);
      }
      if (deadline && now >= *deadline) abandon_.request_stop();
    }
  }

  std::chrono::milliseconds drain_;
  sigset_t signals_ = {};
  std::stop_source stop_;
  std::stop_source abandon_;
  std::jthread watcher_;
};

// Of this machine and process, as names in the queue's tables may be.
std::string worker_name() {
  std::array<char, 256> host = {};
  ::gethostname(host.data(), host.size() - 1);
  std::string name;
  for (const char* c = host.data(); *c != '\0'; ++c) {
    const bool is_plain = (*c >= 'a' && *c <= 'z') || (*c >= 'A' && *c <= 'Z') ||
                          (*c >= '0' && *c <= '9') || *c == '-';
    name += is_plain ? *c : '_';
  }
  return name + "-" + std::to_string(::getpid());
}

void require(bool holds, const char* message) {
  if (!holds) throw Error(ErrorCode::invalid_request, message);
}

}  // namespace

int queue_worker(const QueueWorkerOptions& options) {
  require(options.threads >= 0 && options.threads <= 1024, "--threads: must be 0 to 1024");
  require(options.attempts >= 1 && options.attempts <= 1000, "--attempts: must be 1 to 1000");
  require(options.drain_s >= 0.0 && options.drain_s <= 86'400.0, "--drain-s: must be 0 to 86400 s");
  const std::string token =
      options.token_file.empty() ? "" : secret_of(options.token_file, "--token-file");
  WorkerSignals signals(
      std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * options.drain_s)));
  Log log(options.log_file);
  api::Limits limits;
  limits.body_bytes = limits.scene_bytes;  // a cell may bring its scene with it
  WorkerScenes scenes(options.scenes_dir.empty() ? bundled_scenes() : fs::path(options.scenes_dir),
                      limits);
  CellScenes* chosen = nullptr;
  WorkerPool pool(options.threads);
  HttpFileStore store(options.results, token);
  const std::string name = worker_name();
  NatsQueue queue({.url = options.queue, .name = "fstop worker " + name}, log);
  QueueWorker worker(
      {.queue = queue,
       .store = store,
       .log = log,
       .make_cell =
           [&](const SweepCell& cell, ContentStore& files, std::stop_token stop) {
             const CellTools tools{.limits = limits, .scenes = *chosen, .workers = pool};
             return make_cell(cell, tools, files, std::move(stop));
           },
       .has_scene =
           [&](const SweepCell& cell, const api::CellOrder& order, ContentStore& files) {
             chosen = scenes.with(cell, order, files);
             return chosen != nullptr;
           },
       .make_part =
           [&](const SweepCell& cell, std::string_view order, ContentStore& files,
               std::stop_token stop) {
             const CellTools tools{.limits = limits, .scenes = *chosen, .workers = pool};
             return make_part(cell, order, tools, files, std::move(stop));
           }},
      {.name = name, .most_attempts = options.attempts, .store = store.address()});
  log.event("working", {{"queue", queue.address()},
                        {"results", store.address()},
                        {"worker", name},
                        {"threads", pool.threads()}});
  worker.run(signals.stop(), signals.abandon());
  log.event("stopped");
  return 0;
}

}  // namespace fstop::server
