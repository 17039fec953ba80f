#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "api/limits.h"

namespace fstop::server {

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
};

/// The same, checked and filled.
struct ServerConfig {
  std::string address = "127.0.0.1";
  std::uint16_t port = 0;
  int threads = 0;
  std::string token = {};
  std::string web_root = {};
  std::vector<std::filesystem::path> scene_folders = {};  // the earlier goes first
  api::Limits limits = {};
};

/// Throws: Error{invalid_request} for what cannot be served so: an address that is none, one that
///         others can reach without a token file, a token under 16 characters, a data directory
///         that is a file; Error{io_failure} for a token file that cannot be read.
ServerConfig checked(const ServeOptions& options);

/// Where the bundled scenes and the web page lie: beside an installed program (../share/fstop), or
/// in the source tree of one that lies where it was built.
std::filesystem::path bundled_scenes();
std::filesystem::path bundled_web_page();

}  // namespace fstop::server
