#include "server/patient_store.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>

#include "core/error.h"
#include "server/http_message.h"

namespace fstop::server {
namespace {

constexpr std::chrono::milliseconds kFirstPause{100};
constexpr std::chrono::milliseconds kLongestPause{5'000};

void pause(std::chrono::milliseconds time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, stop, time, [] { return false; });
  if (stop.stop_requested())
    throw Error(ErrorCode::cancelled, "stopped while it waited for disk space");
}

}  // namespace

void when_there_is_room(const std::function<void()>& attempt, const WaitingFor& waiting,
                        const std::stop_token& stop) {
  auto time = kFirstPause;
  for (bool waits = false;; waits = true) {
    try {
      attempt();
      if (waits) waiting("");
      return;
    } catch (const Refusal& refusal) {
      if (refusal.status() != http::status::insufficient_storage) throw;
    }
    if (!waits) waiting("disk space");
    pause(time, stop);
    time = std::min(2 * time, kLongestPause);
  }
}

std::string PatientStore::put(std::string_view bytes) {
  std::string hash;
  when_there_is_room([&] { hash = store_.put(bytes); }, waiting_, stop_);
  return hash;
}

}  // namespace fstop::server
