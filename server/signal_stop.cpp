#include "server/signal_stop.h"

#include <ctime>
#include <unistd.h>

namespace fstop::server {

SignalStop::SignalStop(std::stop_source& stop) {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, &before_);
  watcher_ = std::jthread([this, &stop](const std::stop_token& done) { watch(stop, done); });
}

SignalStop::~SignalStop() {
  watcher_.request_stop();
  watcher_.join();
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

void SignalStop::watch(std::stop_source& stop, const std::stop_token& done) const {
  constexpr std::timespec kLookAgain = {.tv_sec = 0, .tv_nsec = 20'000'000};
  while (!done.stop_requested()) {
    const int number = sigtimedwait(&signals_, nullptr, &kLookAgain);
    if (number > 0 && !stop.request_stop()) ::_exit(128 + number);
  }
}

}  // namespace fstop::server
