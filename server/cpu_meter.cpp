#include "server/cpu_meter.h"

#include <ctime>

namespace fstop::server {
namespace {

double process_ms() {
  std::timespec time = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

}  // namespace

void CpuMeter::advance() {
  const double now_ms = process_ms();
  if (running_ > 0) share_ms_ += (now_ms - last_ms_) / running_;
  last_ms_ = now_ms;
}

double CpuMeter::start() {
  const std::lock_guard lock(mutex_);
  advance();
  ++running_;
  return share_ms_;
}

double CpuMeter::stop(double started) {
  const std::lock_guard lock(mutex_);
  advance();
  --running_;
  return share_ms_ - started;
}

}  // namespace fstop::server
