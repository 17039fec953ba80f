#pragma once

#include <thread>
#include <type_traits>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace fstop::server {

/// Threads for what is too slow for the I/O thread and too short for the render queue: reading
/// requests, closed forms, files, encoding.
class Workers {
 public:
  /// `niceness` is added to the process's own, so that the I/O thread goes first.
  Workers(int threads, int niceness);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// What `work` returns or throws, computed by a worker while the caller's thread goes on.
  /// `work` stays the caller's: name it where its captures have destructors, which gcc 12 calls
  /// twice for temporaries handed to a coroutine.
  template <typename Work>
  boost::asio::awaitable<std::invoke_result_t<const Work&>> run(const Work& work) {
    co_return co_await boost::asio::co_spawn(context_, on_worker(work), boost::asio::use_awaitable);
  }

 private:
  template <typename Work>
  static boost::asio::awaitable<std::invoke_result_t<const Work&>> on_worker(const Work& work) {
    co_return work();
  }

  boost::asio::io_context context_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> guard_;
  std::vector<std::jthread> threads_;
};

}  // namespace fstop::server
