#include "server/config.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>
#include <system_error>
#include <unistd.h>

#include <boost/asio/ip/address.hpp>
#include <boost/system/error_code.hpp>

#include "core/error.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kShortestToken = 16;
constexpr std::size_t kLongestToken = 4096;

Error refused(const std::string& message) { return {ErrorCode::invalid_request, message}; }

bool is_loopback(const std::string& address) {
  boost::system::error_code ec;
  const auto ip = boost::asio::ip::make_address(address, ec);
  return !ec && ip.is_loopback();
}

void require(bool holds, const char* message) {
  if (!holds) throw refused(message);
}

// A name or address with an optional port is no name.
std::string host_of(std::string name) {
  for (char& c : name) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  const auto legal = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '.';
  };
  require(!name.empty() && name.size() <= 253 && std::all_of(name.begin(), name.end(), legal),
          "--allow-host: must be names of letters, digits, dots and dashes, without port");
  return name;
}

// As browsers write an origin: scheme and host, a port where it is not the usual one, no path.
std::string origin_of(const std::string& origin) {
  const auto legal = [](char c) { return c > 0x20 && c < 0x7F && c != '*' && c != '/'; };
  for (const std::string_view scheme : {"https://", "http://"}) {
    const std::string_view host =
        std::string_view(origin).substr(std::min(origin.size(), scheme.size()));
    if (origin.starts_with(scheme) && !host.empty() && std::all_of(host.begin(), host.end(), legal))
      return origin;
  }
  throw refused("--cors-origin: must be origins such as https://app.example, without a path");
}

// Made if it is not there, and written to: what cannot be kept should be known at the start. A full
// disk is no reason not to serve what lies on it; what it has no room for is answered 507.
void require_writable(const fs::path& folder) {
  std::error_code ec;
  fs::create_directories(folder, ec);
  const fs::path trial = folder / ".fstop-trial";
  errno = 0;
  const bool is_written = static_cast<bool>(std::ofstream(trial).put('x').flush());
  const int cause = errno;
  fs::remove(trial, ec);
  if (is_written || cause == ENOSPC || cause == EDQUOT) return;
  throw refused("--data-dir: cannot write to " + folder.string() +
                (cause != 0 ? std::string(": ") + std::strerror(cause) : std::string()));
}

// What this process may have: the machine's memory, cut by a cgroup v2 limit.
std::size_t available_bytes() {
  std::size_t bytes = static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) *
                      static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  std::ifstream file("/sys/fs/cgroup/memory.max");
  std::size_t limit = 0;
  if (file >> limit && limit > 0) bytes = std::min(bytes, limit);  // else "max"
  return bytes;
}

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * seconds));
}

// `installed` below the program's ../share/fstop, else `built` in the source tree.
fs::path shipped_folder(const char* installed, const char* built) {
  std::error_code ec;
  const fs::path program = fs::read_symlink("/proc/self/exe", ec).parent_path();
  const fs::path beside = (program / "../share/fstop" / installed).lexically_normal();
  if (fs::is_directory(beside, ec)) return beside;
  if (program == fs::path(FSTOP_BUILD_TREE)) return fs::path(FSTOP_SOURCE_TREE) / built;
  return {};
}

std::string worker_beside() {
  std::error_code ec;
  return (fs::read_symlink("/proc/self/exe", ec).parent_path() / "fstop-worker").string();
}

void refuse_file(const char* option, const std::string& folder) {
  std::error_code ec;
  if (!folder.empty() && fs::exists(folder, ec) && !fs::is_directory(folder, ec))
    throw refused(std::string(option) + ": not a directory: " + folder);
}

}  // namespace

std::string secret_of(const std::string& file, const std::string& option) {
  std::ifstream stream(file);
  std::string secret;
  if (!stream || !std::getline(stream, secret))
    throw Error(ErrorCode::io_failure, option + ": cannot read a line of " + file);
  const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!secret.empty() && is_space(secret.back())) secret.pop_back();
  secret.erase(secret.begin(), std::find_if_not(secret.begin(), secret.end(), is_space));
  if (secret.size() < kShortestToken || secret.size() > kLongestToken) {
    throw refused(option + ": the secret must have " + std::to_string(kShortestToken) + " to " +
                  std::to_string(kLongestToken) + " characters");
  }
  if (!std::all_of(secret.begin(), secret.end(), [](char c) { return c > 0x20 && c < 0x7F; }))
    throw refused(option + ": the secret must be visible ASCII characters");
  return secret;
}

std::filesystem::path bundled_scenes() { return shipped_folder("scenes", "core/scenes"); }
std::filesystem::path bundled_web_page() { return shipped_folder("web", "web/dist"); }

void require_split_cpu_s(double split_cpu_s) {
  require(split_cpu_s >= 0.0 && split_cpu_s <= 1e9, "--split-cpu-s: must be 0 to 1e9 s");
}

ServerConfig checked(const ServeOptions& options) {
  ServerConfig config;
  config.address = options.address == "localhost" ? "127.0.0.1" : options.address;
  boost::system::error_code ec;
  boost::asio::ip::make_address(config.address, ec);
  if (ec) throw refused("--address: not an IP address: " + options.address);
  if (!options.token_file.empty()) config.token = secret_of(options.token_file, "--token-file");
  if (!is_loopback(config.address) && config.token.empty()) {
    throw refused("--address " + options.address +
                  " can be reached by others: it needs --token-file with a secret of " +
                  std::to_string(kShortestToken) + " or more characters");
  }
  if (!options.url_key_file.empty())
    config.url_key = secret_of(options.url_key_file, "--url-key-file");
  for (const std::string& host : options.hosts) config.hosts.push_back(host_of(host));
  for (const std::string& origin : options.origins) config.origins.push_back(origin_of(origin));
  require(options.threads >= 0 && options.threads <= 1024, "--threads: must be 0 to 1024");
  require(options.concurrent_renders >= 1 && options.concurrent_renders <= 64,
          "--concurrent-renders: must be 1 to 64");
  require(options.queued_renders >= 1 && options.queued_renders <= 100'000,
          "--queued-renders: must be 1 to 100000");
  require(options.synchronous_s >= 0.0 && options.synchronous_s <= 600.0,
          "--synchronous-s: must be 0 to 600");
  require(options.drain_s >= 0.0 && options.drain_s <= 3600.0, "--drain-s: must be 0 to 3600");
  require(options.cache_mib >= 1 && options.cache_mib <= 1 << 24,
          "--cache-mib: must be 1 to 16777216");
  require(options.memory_mib >= 1 && options.memory_mib <= 1 << 24,
          "--memory-mib: must be 1 to 16777216");
  require(options.queue.empty() || !options.data_dir.empty(),
          "--queue: needs --data-dir, where the workers' files go");
  require(!options.ack_wait_s || (*options.ack_wait_s >= 0.5 && *options.ack_wait_s <= 3600.0),
          "--ack-wait-s: must be 0.5 to 3600");
  require_split_cpu_s(options.split_cpu_s);
  refuse_file("--data-dir", options.data_dir);
  refuse_file("--scenes-dir", options.scenes_dir);
  refuse_file("--web-root", options.web_root);
  config.port = options.port;
  config.threads = options.threads;
  config.web_root = options.web_root.empty() ? bundled_web_page().string() : options.web_root;
  if (!options.data_dir.empty()) {
    require_writable(options.data_dir);
    config.scene_folders.push_back(fs::path(options.data_dir) / "scenes");
    config.upload_folder = fs::path(options.data_dir) / "scenes";
    config.result_folder = fs::path(options.data_dir) / "results";
    config.job_folder = fs::path(options.data_dir) / "jobs";
    config.sweep_folder = fs::path(options.data_dir) / "sweeps";
    config.file_folder = fs::path(options.data_dir) / "files";
  }
  config.scene_folders.push_back(options.scenes_dir.empty() ? bundled_scenes()
                                                            : fs::path(options.scenes_dir));
  config.queue = options.queue;
  if (options.ack_wait_s) config.ack_wait = milliseconds(*options.ack_wait_s);
  config.split_cpu_s = options.split_cpu_s;
  config.worker_program = worker_beside();
  config.probe_port = options.probe_port;
  config.limits.concurrent_renders = options.concurrent_renders;
  config.limits.queued_renders = options.queued_renders;
  config.limits.synchronous_wait = milliseconds(options.synchronous_s);
  // The rest is for scenes, results and encoding.
  config.limits.render_bytes = std::min(config.limits.render_bytes, available_bytes() / 10 * 6);
  config.limits.drain_deadline = milliseconds(options.drain_s);
  config.limits.kept_file_bytes = static_cast<std::size_t>(options.cache_mib) << 20U;
  config.limits.kept_result_bytes = static_cast<std::size_t>(options.memory_mib) << 20U;
  return config;
}

}  // namespace fstop::server
