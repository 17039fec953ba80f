#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "api/limits.h"

namespace fstop::server {

/// Predicted processor time of a cell above which its picture is traced by many workers, unless
/// the operator says another.
inline constexpr double kSplitCpuSeconds = 120.0;

/// What `fstop serve` is told.
struct ServeOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;  // 0: any free one
  std::string data_dir = {};
  int threads = 0;  // 0: as many as the machine gives
  std::string token_file = {};
  std::string log_file = {};
  std::string port_file = {};   // where the bound port is written
  std::string web_root = {};    // empty: the page that was built or installed with fstop
  std::string scenes_dir = {};  // empty: the bundled scenes
  std::string url_key_file = {};
  std::vector<std::string> hosts = {};
  std::vector<std::string> origins = {};
  std::optional<std::uint16_t> probe_port = {};  // none: probes on the one port alone
  std::string probe_port_file = {};
  int concurrent_renders = api::Limits{}.concurrent_renders;
  int queued_renders = api::Limits{}.queued_renders;
  double synchronous_s = 2.0;
  double drain_s = 20.0;
  std::int64_t cache_mib = 4096;
  std::int64_t memory_mib = 512;
  std::string queue = {};  // nats://...: cells of sweeps are made by workers elsewhere
  std::optional<double> ack_wait_s =
      {};  // that a worker may be silent; absent: as the queue has it
  double split_cpu_s = kSplitCpuSeconds;  // 0: every cell is made by one worker
  std::string config_file = {};           // read before the rest
};

/// The same, checked and filled.
struct ServerConfig {
  std::string address = "127.0.0.1";
  std::uint16_t port = 0;
  int threads = 0;
  std::string token = {};
  std::string url_key = {};
  std::vector<std::string> hosts = {};    // lower case
  std::vector<std::string> origins = {};  // "scheme://host[:port]"
  std::optional<std::uint16_t> probe_port = {};
  std::filesystem::path upload_folder = {};  // empty: no scenes are taken
  std::string program = "/proc/self/exe";    // what reads them, locked in
  std::string worker_program = {};           // what renders: beside fstop
  std::filesystem::path result_folder = {};  // empty: results stay in memory
  std::filesystem::path job_folder = {};     // empty: jobs end with the process
  std::filesystem::path sweep_folder = {};   // empty: no sweeps are taken
  std::filesystem::path file_folder = {};    // of their files
  std::string queue = {};                    // nats://...; empty: cells are made here
  std::optional<std::chrono::milliseconds> ack_wait = {};
  double split_cpu_s = kSplitCpuSeconds;
  std::string web_root = {};
  std::vector<std::filesystem::path> scene_folders = {};  // the earlier goes first
  api::Limits limits = {};
};

/// Throws: Error{invalid_request} for what cannot be served so: an address that is none, one that
///         others can reach without a token file, a token under 16 characters, a data directory
///         that is a file or cannot be written to, a number out of range, an origin or a host that
///         is none; Error{io_failure} for a file that cannot be read.
ServerConfig checked(const ServeOptions& options);

/// Throws: Error{invalid_request} unless --split-cpu-s is 0 to 1e9.
void require_split_cpu_s(double split_cpu_s);

/// The secret on the first line of `file`: 16 to 4096 visible ASCII characters. `option`: for the
/// message. Throws: as checked().
std::string secret_of(const std::string& file, const std::string& option);

/// Where the bundled scenes and the web page lie: beside an installed program (../share/fstop), or
/// in the source tree of one that lies where it was built.
std::filesystem::path bundled_scenes();
std::filesystem::path bundled_web_page();

}  // namespace fstop::server
