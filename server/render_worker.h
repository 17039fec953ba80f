#pragma once

#include <cstddef>

namespace fstop::server {

/// How a worker process works.
struct WorkerShape {
  int threads = 0;
  int niceness = 0;             // added to what it was started with
  std::size_t scene_bytes = 0;  // of built scenes that it keeps
};

/// Where a worker process finds its end of the channel to the server.
inline constexpr int kWorkerSocket = 3;

/// Makes photographs for the server that started this process, one at a time, until the server has
/// gone; then the process ends. Opens no file and no socket.
[[noreturn]] void work_for_server(const WorkerShape& shape);

}  // namespace fstop::server
