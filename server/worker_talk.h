#pragma once

#include <chrono>
#include <exception>
#include <string>
#include <utility>

#include "server/render_queue.h"
#include "server/worker_messages.h"
#include "server/worker_process.h"

namespace fstop::server {

/// A worker process ended before it had answered.
class WorkerLost : public std::exception {
 public:
  const char* what() const noexcept override { return "the worker process ended"; }
};

/// A worker process did not stop when it was told to.
class WorkerStuck : public std::exception {
 public:
  const char* what() const noexcept override { return "the worker process did not stop"; }
};

/// What `worker` makes of one job: passes its progress on to `turn`, and a stop of `turn` or the
/// end of `time` on to it. Throws: what simulate() throws; Refusal 504 past `time`; WorkerLost;
/// WorkerStuck.
WorkerResult talked_through(WorkerProcess& worker, const WorkerJob& job, const MemoryFile& scene,
                            const RenderQueue::Turn& turn, std::chrono::milliseconds time);

}  // namespace fstop::server
