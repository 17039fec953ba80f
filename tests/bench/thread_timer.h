#pragma once

#include <algorithm>
#include <cstddef>
#include <ctime>
#include <vector>

namespace fstop {

/// Processor time of the calling thread, in seconds: other programs on the machine do not count.
inline double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

struct Timing {
  double minimum = 0.0;  // seconds
  double median = 0.0;
};

/// Thread time of `work()` over `runs` runs, one after the other.
template <typename Work>
Timing seconds_of(Work&& work, int runs) {
  std::vector<double> times;
  for (int run = 0; run < runs; ++run) {
    const double start = thread_seconds();
    work();
    times.push_back(thread_seconds() - start);
  }
  std::ranges::sort(times);
  return {times.front(), times[times.size() / 2]};
}

}  // namespace fstop
