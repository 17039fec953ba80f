#pragma once

#include <csignal>
#include <stop_token>
#include <thread>

namespace fstop::server {

/// While it lives, the first SIGINT or SIGTERM stops `stop`, and a second one ends the process.
/// Made before other threads are: they inherit that these signals wait for it.
class SignalStop {
 public:
  explicit SignalStop(std::stop_source& stop);
  ~SignalStop();
  SignalStop(const SignalStop&) = delete;
  SignalStop& operator=(const SignalStop&) = delete;

 private:
  void watch(std::stop_source& stop, const std::stop_token& done) const;

  sigset_t signals_ = {};
  sigset_t before_ = {};
  std::jthread watcher_;
};

}  // namespace fstop::server
