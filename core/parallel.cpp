#include "core/parallel.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <thread>
#include <unistd.h>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include "core/error.h"

#if defined(FSTOP_THREAD_SANITIZER)
#include <sanitizer/tsan_interface.h>
#endif

namespace fstop {
namespace {

// ThreadSanitizer cannot see how oneTBB orders its threads: neither its library nor its headers,
// in this file, are instrumented. These are the two orders it promises: a loop's start before its
// bodies, and those before its end.
class LoopOrder {
 public:
#if defined(FSTOP_THREAD_SANITIZER)
  void begin() noexcept { __tsan_release(&started_); }
  void enter() noexcept { __tsan_acquire(&started_); }
  void leave() noexcept { __tsan_release(&ended_); }
  void end() noexcept { __tsan_acquire(&ended_); }

 private:
  char started_ = 0;
  char ended_ = 0;
#else
  void begin() noexcept {}
  void enter() noexcept {}
  void leave() noexcept {}
  void end() noexcept {}
#endif
};

// The processors this process may use: the affinity mask, cut by a cgroup v2 CPU quota.
int available_processors() {
  int count = std::max(1U, std::thread::hardware_concurrency());
  std::ifstream file("/sys/fs/cgroup/cpu.max");
  std::string quota;
  double period = 0.0;
  if (file >> quota >> period && quota != "max" && period > 0.0) {
    count = std::min(count, std::max(1, static_cast<int>(std::ceil(std::stod(quota) / period))));
  }
  return count;
}

// Linux keeps a niceness per thread.
class NicenessObserver : public tbb::task_scheduler_observer {
 public:
  NicenessObserver(tbb::task_arena& arena, int niceness)
      : tbb::task_scheduler_observer(arena), niceness_(niceness) {
    observe(true);
  }
  ~NicenessObserver() override { observe(false); }
  void on_scheduler_entry(bool) override {
    const auto thread = static_cast<id_t>(syscall(SYS_gettid));
    setpriority(PRIO_PROCESS, thread, niceness_);
  }

 private:
  int niceness_;
};

}  // namespace

struct WorkerPool::Impl {
  Impl(int threads, int niceness)
      : limit(tbb::global_control::max_allowed_parallelism,
              static_cast<std::size_t>(std::max(threads, available_processors()))),
        arena(threads, 1) {  // one slot is the caller's own
    arena.initialize();
    if (niceness != 0) observer = std::make_unique<NicenessObserver>(arena, niceness);
  }
  tbb::global_control limit;  // more threads than processors are legal: tests ask for them
  tbb::task_arena arena;
  std::unique_ptr<NicenessObserver> observer;
};

WorkerPool::WorkerPool(int threads, int niceness)
    : impl_(std::make_unique<Impl>(threads > 0 ? threads : available_processors(), niceness)) {}
WorkerPool::~WorkerPool() = default;

int WorkerPool::threads() const noexcept { return impl_->arena.max_concurrency(); }

void WorkerPool::for_each(int count, const std::function<void(int)>& body) {
  LoopOrder order;
  order.begin();
  const auto ordered = [&](int i) {
    order.enter();
    body(i);
    order.leave();
  };
  impl_->arena.execute([&] { tbb::parallel_for(0, count, ordered, tbb::simple_partitioner()); });
  order.end();
}

void parallel_for(const RunControl& run, int count, const std::function<void(int)>& body) {
  if (run.workers == nullptr) {
    for (int i = 0; i < count; ++i) {
      throw_if_stopped(run);
      body(i);
    }
    throw_if_stopped(run);
    return;
  }
  run.workers->for_each(count, [&](int i) {
    if (!run.stop.stop_requested()) body(i);
  });
  throw_if_stopped(run);
}

void throw_if_stopped(const RunControl& run) {
  if (run.stop.stop_requested()) throw Error(ErrorCode::cancelled, "stopped before it was done");
}

}  // namespace fstop
