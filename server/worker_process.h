#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <sys/types.h>

#include "server/channel.h"
#include "server/render_worker.h"

namespace fstop::server {

/// A process that makes photographs, and the channel to it. Ends with this object.
class WorkerProcess {
 public:
  /// `program`: an open descriptor of it, so that all workers are of one build.
  /// Throws: Error{io_failure} where it cannot be started.
  WorkerProcess(int program, const WorkerShape& shape);
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  const Channel& channel() const noexcept { return channel_; }
  pid_t id() const noexcept { return process_; }
  std::uint64_t next_job() noexcept { return ++last_job_; }
  bool has_ended() const;
  /// Ends it now, if it has not ended; says how it ended: "signal 9", "exit code 1".
  std::string end();

 private:
  WorkerProcess(int program, const WorkerShape& shape, std::pair<Descriptor, Descriptor> ends);

  Channel channel_;
  pid_t process_ = -1;
  std::uint64_t last_job_ = 0;
};

}  // namespace fstop::server
