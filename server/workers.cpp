#include "server/workers.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace fstop::server {

void make_this_thread_nice(int niceness) {
  // Linux keeps a niceness per thread. Where it cannot be set the work is done all the same.
  const auto thread = static_cast<id_t>(syscall(SYS_gettid));
  setpriority(PRIO_PROCESS, thread, getpriority(PRIO_PROCESS, thread) + niceness);
}

Workers::Workers(int threads, int niceness) : guard_(context_.get_executor()) {
  for (int i = 0; i < threads; ++i) {
    threads_.emplace_back([this, niceness] {
      make_this_thread_nice(niceness);
      context_.run();
    });
  }
}

Workers::~Workers() { context_.stop(); }

}  // namespace fstop::server
