#pragma once

#include <chrono>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace fstop::server {

/// Bounds on a process that works on foreign bytes.
struct SandboxLimits {
  std::size_t memory_bytes = std::size_t{3} << 30;  // of address space
  int cpu_s = 20;
  std::chrono::milliseconds wall{30'000};
  std::size_t answer_bytes = std::size_t{320} << 20;
};

/// Locks the calling process in, for good: no sockets, no files made or written to, no programs,
/// no signals to others, no privileges, no more memory or processor time than `limits` say. It
/// goes on with the descriptors it has and may read files.
/// Throws: Error{internal} where the system refuses.
void enter_sandbox(const SandboxLimits& limits);

/// How a program of ours answered.
struct SandboxAnswer {
  int exit_code = -1;  // 128 + n if signal n ended it
  std::string output = {};
  bool timed_out = false;
};

/// Runs `program` with `arguments` and `input` as its standard input, which it cannot outgrow;
/// its environment is empty, its other descriptors are closed. Waits for its end, or ends it.
/// Throws: Error{io_failure} if it cannot be started.
SandboxAnswer run_apart(const std::string& program, const std::vector<std::string>& arguments,
                        std::span<const char> input, const SandboxLimits& limits);

}  // namespace fstop::server
