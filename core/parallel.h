#pragma once

#include <functional>
#include <memory>
#include <stop_token>

namespace fstop {

class Image;

/// How a long computation is run, stopped and watched; never what it computes.
struct RunControl {
  std::stop_token stop = {};                  // asked for often: work ends within 50 ms
  std::function<void(double)> progress = {};  // fraction done, 0 to 1, not decreasing
  /// The picture so far and its RMSE's 95 % bound (noise and omissions) from time to time: the
  /// first as soon as there is one, then at most one in 50 ms. On the calling thread, which waits.
  std::function<void(const Image&, double)> preview = {};
  class WorkerPool* workers = nullptr;  // null: the calling thread alone
};

/// Threads that share tile loops. Results never depend on their number.
class WorkerPool {
 public:
  /// `threads` 0: as many as the machine (or its cgroup) gives. `niceness` is added to the
  /// workers' own, so that I/O threads go first.
  explicit WorkerPool(int threads, int niceness = 0);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  int threads() const noexcept;
  /// Calls `body(i)` for i in [0, count), in any order, and returns when all have returned.
  /// An exception of a body is thrown here after the others have ended.
  void for_each(int count, const std::function<void(int)>& body);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// for_each on `run.workers`, or in order on this thread; throws Error{cancelled} once
/// `run.stop` is requested.
void parallel_for(const RunControl& run, int count, const std::function<void(int)>& body);

/// Throws: Error{cancelled} if stopping was asked for.
void throw_if_stopped(const RunControl& run);

}  // namespace fstop
