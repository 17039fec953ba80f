#include "server/thread_priority.h"

#include <chrono>
#include <cstdint>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace fstop::server {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::nanoseconds kLongSlice = 3ms;     // about the kernel's own
constexpr std::chrono::nanoseconds kShortSlice = 100us;  // the shortest the kernel gives

// As the kernel has it (sched_setattr(2)); glibc 2.36 has no declaration of its own.
constexpr std::uint64_t kKeepPolicy = 0x08;  // SCHED_FLAG_KEEP_POLICY, since Linux 5.3

struct SchedulingAttributes {
  std::uint32_t size = sizeof(SchedulingAttributes);
  std::uint32_t policy = 0;  // kept as it is, with this flag
  std::uint64_t flags = kKeepPolicy;
  std::int32_t niceness = 0;
  std::uint32_t priority = 0;
  std::uint64_t slice_ns = 0;  // "runtime", which means this for ordinary threads since Linux 6.12
  std::uint64_t deadline_ns = 0;
  std::uint64_t period_ns = 0;
};

// Linux keeps both per thread. What cannot be set is left: the work is done all the same.
void set_this_thread(int niceness, std::chrono::nanoseconds slice) {
  const auto thread = static_cast<id_t>(::syscall(SYS_gettid));
  ::setpriority(PRIO_PROCESS, thread, niceness);
  const SchedulingAttributes wanted{.niceness = niceness,
                                    .slice_ns = static_cast<std::uint64_t>(slice.count())};
  ::syscall(SYS_sched_setattr, thread, &wanted, 0U);
}

int niceness_of_this_thread() {
  return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)));
}

}  // namespace

void make_this_thread_nice(int niceness) {
  set_this_thread(niceness_of_this_thread() + niceness, kLongSlice);
}

void make_this_thread_quick() { set_this_thread(niceness_of_this_thread(), kShortSlice); }

}  // namespace fstop::server
