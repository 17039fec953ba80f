#include "server/worker_crew.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>
#include <vector>

#include "core/error.h"

namespace fstop::server {
namespace {

constexpr std::size_t kKnownScenes = 8;
constexpr auto kTooSoon = std::chrono::seconds(1);  // for a worker to end
constexpr auto kStartPatience = std::chrono::seconds(10);
// Between attempts to start workers that end at once: doubled each time.
constexpr int kFirstPause_ms = 20;
constexpr int kLongestPause_ms = 5000;

Descriptor opened(const std::string& program) {
  Descriptor file(::open(program.c_str(), O_PATH | O_CLOEXEC));
  if (file) return file;
  throw Error(ErrorCode::io_failure, "the program that renders cannot be opened: " + program +
                                         ": " + std::strerror(errno));
}

std::size_t resident_bytes(pid_t process) {
  std::ifstream statm("/proc/" + std::to_string(process) + "/statm");
  std::size_t total_pages = 0;
  std::size_t resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return resident_pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

WorkerCrew::WorkerCrew(Shape shape, Log& log)
    : log_(log), program_(opened(shape.program)), news_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  const auto kind = [&](int wanted, int niceness) {
    return Kind{
        .shape = {.threads = shape.threads, .niceness = niceness, .scene_bytes = shape.scene_bytes},
        .wanted = wanted};
  };
  kinds_ = {kind(shape.workers, shape.niceness),
            kind(shape.express_workers, shape.express_niceness)};
  // Its thread outlives all workers, which the kernel ends with the thread that began them.
  supervisor_ = std::jthread([this](const std::stop_token& stop) { supervise(stop); });
}

WorkerCrew::~WorkerCrew() {
  supervisor_.request_stop();
  wake();
}

bool WorkerCrew::Worker::has(const std::string& scene) const {
  return std::ranges::find(scenes, scene) != scenes.end();
}

void WorkerCrew::Worker::remember(const std::string& scene) {
  std::erase(scenes, scene);
  scenes.push_back(scene);
  if (scenes.size() > kKnownScenes) scenes.pop_front();
}

WorkerResult WorkerCrew::render(const WorkerJob& job, const MemoryFile& scene,
                                const RenderQueue::Turn& turn, std::chrono::milliseconds time) {
  Kind& kind = kinds_[turn.is_express ? 1 : 0];
  std::unique_ptr<Worker> worker = take(kind, job.scene_hash, turn.stop);
  try {
    WorkerResult result = talked_through(worker->process, job, scene, turn, time);
    {
      const std::lock_guard lock(mutex_);
      counts_.builds += result.build_ms > 0.0 ? 1 : 0;
      failures_ = 0;
    }
    const bool is_repeated = worker->has(job.scene_hash);
    give_back(kind, std::move(worker), job.scene_hash);
    if (is_repeated) announce(job.scene_hash, scene);
    return result;
  } catch (const WorkerLost&) {
    bury(kind, std::move(worker), false);
    throw;
  } catch (const WorkerStuck&) {
    bury(kind, std::move(worker), true);
    throw Error(ErrorCode::cancelled, "stopped before it was done");
  } catch (...) {
    give_back(kind, std::move(worker), {});
    throw;
  }
}

// One that has the scene; else the one whose scenes have waited longest.
std::unique_ptr<WorkerCrew::Worker> WorkerCrew::take(Kind& kind, const std::string& scene,
                                                     const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const auto is_there = [&] {
    bury_ended(kind);
    return !kind.idle.empty();
  };
  while (!is_there()) {
    wake();
    if (worker_there_.wait_for(lock, stop, kStartPatience, is_there)) break;
    if (stop.stop_requested()) throw Error(ErrorCode::cancelled, "stopped before it was begun");
    throw Error(ErrorCode::internal, "no worker process can be started");
  }
  auto place = std::ranges::find_if(
      kind.idle, [&](const std::unique_ptr<Worker>& worker) { return worker->has(scene); });
  if (place == kind.idle.end()) place = std::prev(kind.idle.end());
  std::unique_ptr<Worker> worker = std::move(*place);
  kind.idle.erase(place);
  ++kind.busy;
  return worker;
}

// A scene that is photographed again will be once more, maybe while the worker that has it is busy:
// the idle ones build it, too, so that no later picture waits for that. Large scenes are built
// where they are needed alone.
void WorkerCrew::announce(const std::string& scene_hash, const MemoryFile& scene) {
  constexpr std::size_t kMostBytes = std::size_t{64} << 20;
  if (scene.size() > kMostBytes) return;
  const std::lock_guard lock(mutex_);
  for (Kind& kind : kinds_) {
    for (const std::unique_ptr<Worker>& worker : kind.idle) {
      if (worker->has(scene_hash)) continue;
      const Channel& channel = worker->process.channel();
      if (channel.send(MessageKind::scene, 0, scene_hash, scene.descriptor(), false))
        worker->remember(scene_hash);
    }
  }
}

void WorkerCrew::give_back(Kind& kind, std::unique_ptr<Worker> worker, const std::string& scene) {
  if (!scene.empty()) worker->remember(scene);
  {
    const std::lock_guard lock(mutex_);
    --kind.busy;
    kind.idle.push_front(std::move(worker));
  }
  worker_there_.notify_all();
  wake();  // what is idle is watched
}

void WorkerCrew::bury(Kind& kind, std::unique_ptr<Worker> worker, bool was_asked_for) {
  const pid_t process = worker->process.id();
  const std::string how = worker->process.end();
  {
    const std::lock_guard lock(mutex_);
    --kind.busy;
    if (was_asked_for) {
      ++counts_.stopped;
      processes_.erase(process);
      log_.warning("worker_stopped", {{"worker", static_cast<int>(process)}});
    } else {
      log_death(process, how);
    }
  }
  wake();
}

// With the mutex held.
void WorkerCrew::log_death(pid_t process, const std::string& how) {
  ++counts_.deaths;
  processes_.erase(process);
  log_.warning("worker_died", {{"worker", static_cast<int>(process)}, {"how", how}});
}

void WorkerCrew::wake() const {
  const std::uint64_t one = 1;
  const ssize_t ignored = ::write(news_.get(), &one, sizeof one);
  (void)ignored;
}

void WorkerCrew::supervise(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    start_missing();
    wait_for_news(stop);
    const std::lock_guard lock(mutex_);
    for (Kind& kind : kinds_) bury_ended(kind);
  }
  const std::lock_guard lock(mutex_);
  for (Kind& kind : kinds_) kind.idle.clear();
}

void WorkerCrew::start_missing() {
  for (Kind& kind : kinds_) {
    for (;;) {
      {
        const std::lock_guard lock(mutex_);
        if (kind.busy + static_cast<int>(kind.idle.size()) >= kind.wanted) break;
      }
      try {
        auto worker = std::make_unique<Worker>(program_.get(), kind.shape);
        const std::lock_guard lock(mutex_);
        processes_.insert(worker->process.id());
        kind.idle.push_back(std::move(worker));
      } catch (const std::exception& exception) {
        log_.warning("worker_not_started", {{"why", exception.what()}});
        const std::lock_guard lock(mutex_);
        ++failures_;
        return;
      }
      worker_there_.notify_all();
    }
  }
}

// Those that ended while nothing was asked of them; with the mutex held.
void WorkerCrew::bury_ended(Kind& kind) {
  std::erase_if(kind.idle, [&](std::unique_ptr<Worker>& worker) {
    if (!worker->process.has_ended()) return false;
    failures_ = std::chrono::steady_clock::now() - worker->begun < kTooSoon ? failures_ + 1 : 0;
    log_death(worker->process.id(), worker->process.end());
    return true;
  });
}

// Until an idle worker ends or wake() is called. Workers that end at once are not replaced at once.
void WorkerCrew::wait_for_news(const std::stop_token& stop) {
  std::vector<pollfd> watched = {{.fd = news_.get(), .events = POLLIN, .revents = 0}};
  int pause_ms = 0;
  bool is_one_missing = false;
  {
    const std::lock_guard lock(mutex_);
    for (const Kind& kind : kinds_) {
      for (const auto& worker : kind.idle) {
        watched.push_back(
            {.fd = worker->process.channel().descriptor(), .events = 0, .revents = 0});
      }
      is_one_missing =
          is_one_missing || kind.busy + static_cast<int>(kind.idle.size()) < kind.wanted;
    }
    if (failures_ > 0)
      pause_ms = std::min(kLongestPause_ms, kFirstPause_ms << std::min(failures_, 8));
  }
  ::poll(watched.data(), watched.size(), is_one_missing ? pause_ms : -1);
  std::uint64_t count = 0;
  const ssize_t ignored = ::read(news_.get(), &count, sizeof count);
  (void)ignored;
  if (pause_ms == 0 || stop.stop_requested()) return;
  // Whatever the news: the next start waits.
  pollfd end = {.fd = news_.get(), .events = POLLIN, .revents = 0};
  ::poll(&end, 1, pause_ms);
}

WorkerCrew::Counts WorkerCrew::counts() const {
  Counts counts;
  std::set<pid_t> processes;
  {
    const std::lock_guard lock(mutex_);
    counts = counts_;
    processes = processes_;
  }
  counts.workers = static_cast<int>(processes.size());
  for (const pid_t process : processes) counts.resident_bytes += resident_bytes(process);
  return counts;
}

}  // namespace fstop::server
