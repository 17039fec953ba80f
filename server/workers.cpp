#include "server/workers.h"

#include "server/thread_priority.h"

namespace fstop::server {

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
