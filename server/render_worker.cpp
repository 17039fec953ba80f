#include "server/render_worker.h"

#include <chrono>
#include <condition_variable>
#include <csignal>
#include <ctime>
#include <deque>
#include <fcntl.h>
#include <list>
#include <malloc.h>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <sys/prctl.h>
#include <thread>
#include <unistd.h>
#include <utility>

#include "core/build_stop.h"
#include "core/parallel.h"
#include "server/channel.h"
#include "server/progress.h"
#include "server/thread_priority.h"
#include "server/worker_messages.h"

namespace fstop::server {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr auto kBetweenProgress = std::chrono::milliseconds(10);
constexpr auto kLongIdle = std::chrono::seconds(1);  // then memory is given back

double processor_ms() {
  std::timespec time = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

bool is_of_scene(const Message& job, const std::string& hash) noexcept {
  try {
    return job_of(job.body).scene_hash == hash;
  } catch (...) {
    return false;  // whoever makes it says what is wrong
  }
}

// Scenes that were built, the one used last first.
class BuiltScenes {
 public:
  explicit BuiltScenes(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  std::shared_ptr<const RayScene> find(const std::string& hash) {
    for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
      if (entry->hash != hash) continue;
      entries_.splice(entries_.begin(), entries_, entry);
      return entry->scene;
    }
    return nullptr;
  }
  void keep(const std::string& hash, std::shared_ptr<const RayScene> scene, std::size_t bytes) {
    entries_.push_front({hash, std::move(scene), bytes});
    std::size_t total = 0;
    for (auto entry = entries_.begin(); entry != entries_.end();) {
      total += entry->bytes;
      const bool stays = entry == entries_.begin() || total <= max_bytes_;
      if (!stays) total -= entry->bytes;
      entry = stays ? std::next(entry) : entries_.erase(entry);
    }
  }

 private:
  struct Entry {
    std::string hash = {};
    std::shared_ptr<const RayScene> scene = {};
    std::size_t bytes = 0;
  };
  std::size_t max_bytes_;
  std::list<Entry> entries_ = {};
};

// One thread renders, another listens, so that a job can be stopped.
class RenderWorker {
 public:
  explicit RenderWorker(const WorkerShape& shape)
      : channel_(Descriptor(kWorkerSocket)), scenes_(shape.scene_bytes) {
    // It only waits: on a busy machine a stop must not wait behind what is to be stopped.
    std::thread([this] {
      make_this_thread_quick();
      listen();
    }).detach();
    make_this_thread_nice(shape.niceness);  // threads begun from here on inherit it
    pool_.emplace(shape.threads);
    channel_.send(MessageKind::hello, 0);
  }

  [[noreturn]] void run() {
    for (;;) {
      const Message message = next_message();
      try {
        if (message.kind == MessageKind::scene) {
          build_ahead(message);
        } else {
          make(message);
        }
      } catch (const std::exception& exception) {
        // A scene that is not built now is built when a job needs it.
        if (message.kind == MessageKind::job)
          channel_.send(MessageKind::failed, message.job, failure_bytes(exception));
      }
    }
  }

 private:
  void listen() {
    for (;;) {
      std::optional<Message> message = channel_.receive();
      if (!message) ::_exit(0);  // the server has gone
      const std::lock_guard lock(mutex_);
      if (message->kind == MessageKind::job) {
        stop_ = std::stop_source();
        newest_job_ = message->job;
        if (!is_of_scene(*message, ahead_)) stop_ahead_.request_stop();
        job_ = std::move(message);
        news_.notify_one();
      } else if (message->kind == MessageKind::scene) {
        scene_ = std::move(message);
        news_.notify_one();
      } else if (message->kind == MessageKind::cancel && message->job == newest_job_) {
        stop_.request_stop();
        stop_ahead_.request_stop();
      }
    }
  }

  // A job, or a scene while there is none.
  Message next_message() {
    std::unique_lock lock(mutex_);
    ahead_.clear();
    const auto is_news = [this] { return job_ || scene_; };
    if (!news_.wait_for(lock, kLongIdle, is_news)) {
      lock.unlock();
      ::malloc_trim(0);  // what a large picture has left
      lock.lock();
      news_.wait(lock, is_news);
    }
    std::optional<Message>& next = job_ ? job_ : scene_;
    Message message = std::move(*next);
    next.reset();
    if (message.kind == MessageKind::scene) {
      ahead_ = message.body;
      stop_ahead_ = std::stop_source();
    }
    return message;
  }

  void build_ahead(const Message& message) {
    std::stop_token stop;
    {
      const std::lock_guard lock(mutex_);
      stop = stop_ahead_.get_token();
    }
    if (!scenes_.find(message.body)) build(message, message.body, stop);
  }

  std::stop_token stop_of_job() {
    const std::lock_guard lock(mutex_);
    return stop_.get_token();
  }

  void make(const Message& message) {
    const WorkerJob job = job_of(message.body);
    const std::stop_token stop = stop_of_job();
    WorkerResult result;
    const std::shared_ptr<const RayScene> scene = scene_of_job(message, job, stop, result);
    const RunControl run = control_of(message.job, job, stop);
    const double start_ms = processor_ms();
    result.photograph = simulate(job.spec, *scene, run);
    result.cpu_ms = processor_ms() - start_ms;
    const MemoryFile file = result_file(result);
    channel_.send(MessageKind::done, message.job, {}, file.descriptor());
  }

  std::shared_ptr<const RayScene> scene_of_job(const Message& message, const WorkerJob& job,
                                               const std::stop_token& stop, WorkerResult& result) {
    if (auto known = scenes_.find(job.scene_hash)) return known;
    const double start_ms = processor_ms();
    auto built = build(message, job.scene_hash, stop);
    result.build_ms = processor_ms() - start_ms;
    return built;
  }

  std::shared_ptr<const RayScene> build(const Message& message, const std::string& hash,
                                        const std::stop_token& stop) {
    const MemoryFile file(Descriptor(::fcntl(message.file.get(), F_DUPFD_CLOEXEC, 0)));
    const BuildStop until(stop);
    auto built = std::make_shared<const RayScene>(scene_of(file));
    scenes_.keep(hash, built, built->memory_bytes() + file.size());
    return built;
  }

  // Progress that the server has no room for is left out: there will be newer.
  RunControl control_of(std::uint64_t number, const WorkerJob& job, const std::stop_token& stop) {
    RunControl run{.stop = stop, .workers = &*pool_};
    run.progress = [this, number](double fraction) {
      const std::lock_guard lock(progress_mutex_);
      const auto now = SteadyClock::now();
      if (now - told_ < kBetweenProgress) return;
      told_ = now;
      channel_.send(MessageKind::progress, number, number_bytes(fraction), -1, false);
    };
    if (!job.wants_previews) return run;
    run.preview = [this, number](const Image& picture, double upper_95) {
      const auto now = SteadyClock::now();
      if (now - shown_ < Progress::kBetweenPreviews) return;
      shown_ = now;
      const MemoryFile file = image_file(thumbnail(picture, Progress::kPreviewSide));
      channel_.send(MessageKind::preview, number, number_bytes(upper_95), file.descriptor(), false);
    };
    return run;
  }

  Channel channel_;
  std::optional<WorkerPool> pool_ = {};
  BuiltScenes scenes_;
  std::mutex mutex_;
  std::condition_variable news_;
  std::optional<Message> job_ = {};    // not begun yet
  std::optional<Message> scene_ = {};  // to be built while there is no job
  std::string ahead_ = {};             // the scene that is being built without a job
  std::stop_source stop_ahead_ = {};
  std::uint64_t newest_job_ = 0;
  std::stop_source stop_ = {};  // of the newest job
  std::mutex progress_mutex_;
  SteadyClock::time_point told_ = {};
  SteadyClock::time_point shown_ = {};
};

// Where memory runs out the kernel takes a worker before it takes the server.
void offer_oneself() {
  const int file = ::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
  if (file < 0) return;
  const ssize_t ignored = ::write(file, "500", 3);
  (void)ignored;
  ::close(file);
}

}  // namespace

void work_for_server(const WorkerShape& shape) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::prctl(PR_SET_NAME, "fstop-worker");
  // A terminal or a service manager may signal the whole group: the server says when to end.
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) std::signal(number, SIG_IGN);
  offer_oneself();
  RenderWorker worker(shape);
  worker.run();
}

}  // namespace fstop::server
