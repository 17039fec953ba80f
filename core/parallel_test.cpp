#include "core/parallel.h"

#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <stdexcept>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

class WorkerPoolOf : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Threads, WorkerPoolOf, testing::Values(1, 2, 4));

TEST_P(WorkerPoolOf, HasTheThreadsAskedFor) {
  EXPECT_EQ(WorkerPool(GetParam()).threads(), GetParam());
}

TEST_P(WorkerPoolOf, CoversEachIndexOnce) {
  WorkerPool pool(GetParam());
  for (const int count : {0, 1, 2, 3, 1000}) {
    std::vector<std::atomic<int>> calls(static_cast<std::size_t>(count));
    pool.for_each(count, [&](int i) { ++calls.at(static_cast<std::size_t>(i)); });
    for (const auto& c : calls) EXPECT_EQ(c.load(), 1) << count << " indices";
  }
}

TEST_P(WorkerPoolOf, NeverUsesMoreThreadsThanItHas) {
  WorkerPool pool(GetParam());
  std::mutex mutex;
  std::set<std::thread::id> ids;
  pool.for_each(64, [&](int) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::lock_guard lock(mutex);
    ids.insert(std::this_thread::get_id());
  });
  EXPECT_GE(ids.size(), 1U);
  EXPECT_LE(ids.size(), static_cast<std::size_t>(GetParam()));
}

TEST_P(WorkerPoolOf, PassesAnExceptionOnAndStaysUsable) {
  WorkerPool pool(GetParam());
  std::atomic<int> running = 0;
  const auto throwing = [&](int i) {
    ++running;
    if (i == 17) {
      --running;
      throw Error(ErrorCode::over_budget, "seventeen");
    }
    --running;
  };
  try {
    pool.for_each(1000, throwing);
    FAIL() << "the exception was lost";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::over_budget);
    EXPECT_STREQ(error.what(), "seventeen");
    EXPECT_EQ(running.load(), 0) << "thrown before the other bodies had ended";
  }
  std::atomic<int> calls = 0;
  pool.for_each(100, [&](int) { ++calls; });
  EXPECT_EQ(calls.load(), 100);
}

TEST_P(WorkerPoolOf, ParallelForCoversEachIndexOnce) {
  WorkerPool pool(GetParam());
  std::vector<std::atomic<int>> calls(500);
  parallel_for({.workers = &pool}, 500, [&](int i) { ++calls.at(static_cast<std::size_t>(i)); });
  for (const auto& c : calls) EXPECT_EQ(c.load(), 1);
}

TEST_P(WorkerPoolOf, StopBeforehandCallsNothing) {
  WorkerPool pool(GetParam());
  std::stop_source stop;
  stop.request_stop();
  std::atomic<int> calls = 0;
  try {
    parallel_for({.stop = stop.get_token(), .workers = &pool}, 100, [&](int) { ++calls; });
    FAIL() << "went on although stopped";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
  EXPECT_EQ(calls.load(), 0);
}

// After the stop at most the bodies under way finish: fewer than one for each other thread.
TEST_P(WorkerPoolOf, StopUnderWayEndsTheLoop) {
  WorkerPool pool(GetParam());
  std::stop_source stop;
  std::atomic<int> after_stop = 0;
  const RunControl run{.stop = stop.get_token(), .workers = &pool};
  try {
    parallel_for(run, 100000, [&](int) {
      if (stop.stop_requested()) ++after_stop;
      stop.request_stop();
    });
    FAIL() << "went on although stopped";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
  EXPECT_LT(after_stop.load(), GetParam());
}

// A stop that comes with the last body still counts: the caller must not take the result.
TEST_P(WorkerPoolOf, StopInTheLastBodyIsCancelled) {
  WorkerPool pool(GetParam());
  std::stop_source stop;
  const RunControl run{.stop = stop.get_token(), .workers = &pool};
  EXPECT_THROW(parallel_for(run, 1, [&](int) { stop.request_stop(); }), Error);
}

TEST_P(WorkerPoolOf, LoopsFromSeveralThreadsDoNotMix) {
  WorkerPool pool(GetParam());
  std::vector<std::atomic<int>> totals(3);
  std::vector<std::jthread> callers;
  callers.reserve(totals.size());
  for (auto& total : totals) {
    callers.emplace_back([&pool, &total] { pool.for_each(200, [&total](int i) { total += i; }); });
  }
  callers.clear();  // joins
  for (const auto& total : totals) EXPECT_EQ(total.load(), 199 * 200 / 2);
}

TEST_P(WorkerPoolOf, WorkersHaveTheNicenessAskedFor) {
  // A thread of its own, which takes part and cannot become less nice again.
  std::atomic<int> wrong = 0;
  std::jthread([&wrong, threads = GetParam()] {
    WorkerPool pool(threads, 3);
    pool.for_each(100, [&wrong](int) {
      const auto thread = static_cast<id_t>(syscall(SYS_gettid));
      if (getpriority(PRIO_PROCESS, thread) < 3) ++wrong;
    });
  }).join();
  EXPECT_EQ(wrong.load(), 0);
}

TEST(WorkerPool, ZeroThreadsMeansWhatTheMachineGives) {
  const WorkerPool pool(0);
  EXPECT_GE(pool.threads(), 1);
  EXPECT_LE(pool.threads(), static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
}

TEST(WorkerPool, PoolsOfDifferentSizesLiveSideBySide) {
  WorkerPool small(1);
  WorkerPool large(4);
  EXPECT_EQ(small.threads(), 1);
  EXPECT_EQ(large.threads(), 4);
  std::atomic<int> calls = 0;
  large.for_each(10, [&](int) { small.for_each(10, [&](int) { ++calls; }); });
  EXPECT_EQ(calls.load(), 100);
}

TEST(ParallelFor, WithoutWorkersRunsInOrderOnTheCallingThread) {
  std::vector<int> order;
  const auto caller = std::this_thread::get_id();
  parallel_for({}, 5, [&](int i) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    order.push_back(i);
  });
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(ParallelFor, WithoutWorkersStopsBeforeTheNextIndex) {
  std::stop_source stop;
  int calls = 0;
  const auto stopping = [&](int i) {
    ++calls;
    if (i == 2) stop.request_stop();
  };
  try {
    parallel_for({.stop = stop.get_token()}, 100, stopping);
    FAIL() << "went on although stopped";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
  EXPECT_EQ(calls, 3);
}

// The same promise as with workers: whoever asked for a stop gets no result.
TEST(ParallelFor, WithoutWorkersStopInTheLastBodyIsCancelled) {
  std::stop_source stop;
  const RunControl run{.stop = stop.get_token()};
  EXPECT_THROW(parallel_for(run, 1, [&](int) { stop.request_stop(); }), Error);
}

TEST(ThrowIfStopped, ThrowsOnlyOnceAsked) {
  std::stop_source stop;
  const RunControl run{.stop = stop.get_token()};
  EXPECT_NO_THROW(throw_if_stopped(run));
  EXPECT_NO_THROW(throw_if_stopped(RunControl{}));
  stop.request_stop();
  EXPECT_THROW(throw_if_stopped(run), Error);
}

}  // namespace
}  // namespace fstop
