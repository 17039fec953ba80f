#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <mutex>
#include <set>
#include <stop_token>
#include <string>
#include <thread>

#include "server/log.h"
#include "server/render_queue.h"
#include "server/worker_messages.h"
#include "server/worker_process.h"
#include "server/worker_talk.h"

namespace fstop::server {

/// The worker processes: as many as renders run at once, each replaced as soon as it ends.
class WorkerCrew {
 public:
  struct Shape {
    std::string program = {};
    int workers = 1;
    int express_workers = 0;  // for small work
    int threads = 0;          // of each
    int niceness = 0;
    int express_niceness = 0;
    std::size_t scene_bytes = 0;  // of built scenes that each keeps
  };
  struct Counts {
    int workers = 0;
    std::uint64_t deaths = 0;   // of workers, unasked for
    std::uint64_t stopped = 0;  // ended because they did not stop in time
    std::uint64_t builds = 0;   // of scenes
    std::size_t resident_bytes = 0;
  };

  /// Throws: Error{io_failure} where there is no such program.
  WorkerCrew(Shape shape, Log& log);
  ~WorkerCrew();
  WorkerCrew(const WorkerCrew&) = delete;
  WorkerCrew& operator=(const WorkerCrew&) = delete;

  /// A worker makes the photograph, for at most `time`.
  /// Throws: what simulate() throws; Refusal 504 past `time`; WorkerLost; Error{internal} where no
  ///         worker can be started.
  WorkerResult render(const WorkerJob& job, const MemoryFile& scene, const RenderQueue::Turn& turn,
                      std::chrono::milliseconds time);

  Counts counts() const;

 private:
  struct Worker {
    Worker(int program, const WorkerShape& shape) : process(program, shape) {}
    WorkerProcess process;
    std::chrono::steady_clock::time_point begun = std::chrono::steady_clock::now();
    std::deque<std::string> scenes = {};  // that it has, the newest last
    bool has(const std::string& scene) const;
    void remember(const std::string& scene);
  };
  struct Kind {
    WorkerShape shape = {};
    int wanted = 0;
    int busy = 0;
    std::list<std::unique_ptr<Worker>> idle = {};  // the one used last first
  };

  std::unique_ptr<Worker> take(Kind& kind, const std::string& scene, const std::stop_token& stop);
  void announce(const std::string& scene_hash, const MemoryFile& scene);
  void give_back(Kind& kind, std::unique_ptr<Worker> worker, const std::string& scene);
  void bury(Kind& kind, std::unique_ptr<Worker> worker, bool was_asked_for);
  void supervise(const std::stop_token& stop);
  void start_missing();
  void bury_ended(Kind& kind);
  void wait_for_news(const std::stop_token& stop);
  void wake() const;
  void log_death(pid_t process, const std::string& how);

  Log& log_;
  Descriptor program_;
  Descriptor news_;  // an eventfd
  mutable std::mutex mutex_;
  std::condition_variable_any worker_there_;
  std::array<Kind, 2> kinds_ = {};  // usual, express
  std::set<pid_t> processes_ = {};
  Counts counts_ = {};
  int failures_ = 0;  // starts in a row that led to nothing
  std::jthread supervisor_;
};

}  // namespace fstop::server
