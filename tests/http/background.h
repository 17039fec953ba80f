#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <sys/types.h>
#include <utility>
#include <vector>

namespace fstop::test {

/// Another process: `fstop arguments...`, or a program of the system that is found by its name.
class BackgroundProcess {
 public:
  /// `errors`: the file for its standard output and error.
  static BackgroundProcess fstop(const std::vector<std::string>& arguments,
                                 const std::filesystem::path& errors);
  static BackgroundProcess system(const std::vector<std::string>& command,
                                  const std::filesystem::path& errors);
  /// Kills it if it still runs.
  ~BackgroundProcess();
  BackgroundProcess(BackgroundProcess&& other) noexcept;
  BackgroundProcess& operator=(BackgroundProcess&&) = delete;

  pid_t id() const noexcept { return process_; }
  void signal(int number) const;
  /// The exit code, as in Outcome.
  int wait();
  std::string error_text() const;

 private:
  BackgroundProcess(pid_t process, std::filesystem::path errors)
      : process_(process), errors_(std::move(errors)) {}
  pid_t process_ = -1;
  std::filesystem::path errors_;
};

/// A port of the loopback that nobody listens on.
std::uint16_t free_port();

/// A NATS server with JetStream on the loopback, its store in a folder.
class NatsServer {
 public:
  /// Returns once it takes connections.
  explicit NatsServer(const std::filesystem::path& folder);
  std::string url() const;
  /// Ends it as a loss of power does.
  void kill();
  /// Starts it again on the same port, with what it had.
  void start();
  /// Throws its store away, too.
  void start_empty();

 private:
  std::filesystem::path folder_;
  std::uint16_t port_;
  std::unique_ptr<BackgroundProcess> process_ = {};
};

}  // namespace fstop::test
