#pragma once

#include <mutex>

namespace fstop::server {

/// Divides the processor time of the process among the tasks that run at once, evenly: threads
/// that share tiles cannot be told apart by task.
class CpuMeter {
 public:
  /// A reading to hand to `stop`.
  double start();
  /// Milliseconds of processor time that fell to this task.
  double stop(double started);

 private:
  void advance();

  std::mutex mutex_;
  int running_ = 0;
  double last_ms_ = 0.0;   // of the process
  double share_ms_ = 0.0;  // what a task running all along would have got
};

}  // namespace fstop::server
