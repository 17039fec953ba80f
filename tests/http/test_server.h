#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/config.h"
#include "server/log.h"
#include "server/render_calls.h"
#include "server/server.h"

namespace fstop::test {

/// A folder that goes away with it.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const noexcept { return path_; }
  /// Writes a file below it, its folders too.
  void write(const std::string& name, std::string_view content) const;
  /// How many files are below it.
  int files() const;

 private:
  std::filesystem::path path_;
};

std::string text_of_file(const std::filesystem::path& file);

/// Writes the scene "tiny" (a sphere before a wall, no files) into scenes/ of `folder`, and
/// "broken-mesh", "no-texture" with what their names say.
void write_scenes(const TemporaryFolder& folder);

/// A request for an image of the scene "tiny". `members` goes before the closing brace.
std::string tiny_request(int seed = 0, const std::string& members = {});

/// A server inside this process, on a free port of the loopback.
class TestServer {
 public:
  /// Renders become jobs only where a test wants them to.
  static api::Limits patient() {
    api::Limits limits;
    limits.synchronous_wait = limits.longest_wait;
    return limits;
  }
  struct Options {
    api::Limits limits = patient();
    std::string token = {};
    std::string url_key = {};
    std::vector<std::string> hosts = {};
    std::vector<std::string> origins = {};
    bool takes_scenes = false;
    std::filesystem::path result_folder = {};  // empty: results stay in memory
    std::filesystem::path job_folder = {};     // empty: jobs end with the server
    std::filesystem::path data_folder = {};    // for sweeps; empty: none are taken
    std::string address = "127.0.0.1";
    server::Simulate simulate = {};  // empty: in worker processes
    int threads = 0;
  };
  TestServer() : TestServer(Options{}) {}
  explicit TestServer(Options options);
  ~TestServer();
  TestServer(const TestServer&) = delete;
  TestServer& operator=(const TestServer&) = delete;

  std::uint16_t port() const { return server_->port(); }
  std::uint16_t probe_port() const { return server_->probe_port(); }
  server::Server& server() { return *server_; }
  const TemporaryFolder& folder() const { return folder_; }
  /// The log so far, JSON lines.
  std::string log_text() const { return text_of_file(folder_.path() / "log"); }
  /// Returns once the server has ended by itself after stop(); false if it does not in time.
  bool ends_within(std::chrono::milliseconds patience);

 private:
  TemporaryFolder folder_;
  std::unique_ptr<server::Log> log_;
  std::unique_ptr<server::Server> server_;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

/// In the place of the light path: every render waits until it is let go or stopped, so that tests
/// count renders instead of seconds.
class HeldRenders {
 public:
  server::Simulate simulate();
  void let_go();
  int begun() const noexcept { return begun_; }
  int running() const noexcept { return running_; }
  int stopped() const noexcept { return stopped_; }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_open_ = false;
  std::atomic<int> begun_ = 0;
  std::atomic<int> running_ = 0;
  std::atomic<int> stopped_ = 0;
};

/// Whether `condition` becomes true; looks every millisecond, for at most `patience`.
bool eventually(const std::function<bool()>& condition,
                std::chrono::milliseconds patience = std::chrono::seconds(20));

}  // namespace fstop::test
