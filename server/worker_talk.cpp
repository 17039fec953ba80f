#include "server/worker_talk.h"

#include <algorithm>
#include <optional>
#include <poll.h>

#include "core/error.h"
#include "server/http_message.h"

namespace fstop::server {
namespace {

using SteadyClock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// Light paths stop within 50 ms, scenes while they are built about as soon; whoever takes longer
// than this hangs.
constexpr milliseconds kStopPatience{2'000};
constexpr milliseconds kLookAgain{250};

class Talk {
 public:
  Talk(WorkerProcess& worker, const RenderQueue::Turn& turn, milliseconds time)
      : worker_(worker),
        turn_(turn),
        time_(time),
        number_(worker.next_job()),
        deadline_(SteadyClock::now() + time) {}

  WorkerResult result(const WorkerJob& job, const MemoryFile& scene) {
    if (!worker_.channel().send(MessageKind::job, number_, job_bytes(job), scene.descriptor()))
      throw WorkerLost();
    const std::stop_callback pass_on(turn_.stop, [this] { cancel(); });
    for (;;) {
      if (!is_news_there()) continue;
      std::optional<Message> message = worker_.channel().receive();
      if (!message) throw WorkerLost();
      if (message->job != number_) continue;
      if (message->kind == MessageKind::done)
        return result_of(MemoryFile(std::move(message->file)));
      if (message->kind == MessageKind::failed) fail(message->body);
      tell(std::move(*message));
    }
  }

 private:
  void cancel() const { worker_.channel().send(MessageKind::cancel, number_, {}, -1, false); }

  // Looks at the clock, too.
  bool is_news_there() {
    const auto now = SteadyClock::now();
    if (now >= deadline_ && !is_late_) {
      is_late_ = true;
      cancel();
    }
    if ((is_late_ || turn_.stop.stop_requested()) && !told_to_stop_) told_to_stop_ = now;
    if (told_to_stop_ && now - *told_to_stop_ > kStopPatience) throw WorkerStuck();
    const auto until = is_late_ ? kLookAgain : std::chrono::ceil<milliseconds>(deadline_ - now);
    pollfd news = {.fd = worker_.channel().descriptor(), .events = POLLIN, .revents = 0};
    return ::poll(&news, 1, static_cast<int>(std::min(until, kLookAgain).count())) > 0;
  }

  [[noreturn]] void fail(const std::string& body) {
    try {
      throw_failure(body);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::cancelled || !is_late_ || turn_.stop.stop_requested()) throw;
      throw Refusal(http::status::gateway_timeout, "deadline",
                    "the render was stopped after " + std::to_string(time_.count()) + " ms");
    }
  }

  void tell(Message message) {
    if (message.kind == MessageKind::progress) turn_.progress->advance(number_of(message.body));
    if (message.kind == MessageKind::preview) {
      turn_.progress->keep(image_of(MemoryFile(std::move(message.file))), number_of(message.body));
    }
  }

  WorkerProcess& worker_;
  const RenderQueue::Turn& turn_;
  milliseconds time_;
  std::uint64_t number_;
  SteadyClock::time_point deadline_;
  bool is_late_ = false;
  std::optional<SteadyClock::time_point> told_to_stop_ = {};
};

}  // namespace

WorkerResult talked_through(WorkerProcess& worker, const WorkerJob& job, const MemoryFile& scene,
                            const RenderQueue::Turn& turn, milliseconds time) {
  return Talk(worker, turn, time).result(job, scene);
}

}  // namespace fstop::server
