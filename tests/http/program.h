#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <sys/types.h>
#include <vector>

namespace fstop::test {

/// What a finished run of the fstop program left.
struct Outcome {
  int exit_code = -1;  // 128 + n if signal n ended it
  std::string output = {};
  std::string errors = {};
};

/// Runs `fstop arguments...` to its end.
Outcome run_fstop(const std::vector<std::string>& arguments, const std::string& input = {});

/// The same, but signal `number` is sent once `text` stands on its standard error.
Outcome run_fstop_until(const std::vector<std::string>& arguments, const std::string& text,
                        int number);

/// `fstop arguments...` while it runs.
class RunningProgram {
 public:
  /// `file_bytes`: no file may grow beyond it, until grant_space().
  explicit RunningProgram(const std::vector<std::string>& arguments,
                          std::optional<std::uint64_t> file_bytes = {});
  /// Kills it if it still runs.
  ~RunningProgram();
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  void signal(int number) const;
  void grant_space() const;
  std::string errors() const;
  Outcome wait();

 private:
  std::filesystem::path folder_;
  pid_t process_ = -1;
};

/// `fstop serve` as a process of its own, on a free port of the loopback.
class ServerProcess {
 public:
  /// Returns once it is ready. `folder`: for its port file and log.
  /// `port` 0: any free one.
  explicit ServerProcess(const std::filesystem::path& folder,
                         const std::vector<std::string>& arguments = {}, std::uint16_t port = 0);
  /// Kills it if it still runs.
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  std::uint16_t port() const noexcept { return port_; }
  pid_t id() const noexcept { return process_; }
  void signal(int number) const;
  /// The exit code, as in Outcome.
  int wait();
  std::string log_text() const;
  int open_descriptors() const;

 private:
  std::filesystem::path folder_;
  pid_t process_ = -1;
  std::uint16_t port_ = 0;
};

}  // namespace fstop::test
