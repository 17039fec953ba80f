#include "server/config.h"

#include <algorithm>
#include <fstream>
#include <string_view>
#include <system_error>

#include <boost/asio/ip/address.hpp>
#include <boost/system/error_code.hpp>

#include "core/error.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kShortestToken = 16;
constexpr std::size_t kLongestToken = 4096;

Error refused(const std::string& message) { return {ErrorCode::invalid_request, message}; }

// The first line of the file, without white space around it.
std::string token_of(const std::string& file) {
  std::ifstream stream(file);
  std::string token;
  if (!stream || !std::getline(stream, token))
    throw Error(ErrorCode::io_failure, "--token-file: cannot read a line of " + file);
  const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!token.empty() && is_space(token.back())) token.pop_back();
  token.erase(token.begin(), std::find_if_not(token.begin(), token.end(), is_space));
  if (token.size() < kShortestToken || token.size() > kLongestToken) {
    throw refused("--token-file: the token must have " + std::to_string(kShortestToken) + " to " +
                  std::to_string(kLongestToken) + " characters");
  }
  if (!std::all_of(token.begin(), token.end(), [](char c) { return c > 0x20 && c < 0x7F; }))
    throw refused("--token-file: the token must be visible ASCII characters");
  return token;
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

void refuse_file(const char* option, const std::string& folder) {
  std::error_code ec;
  if (!folder.empty() && fs::exists(folder, ec) && !fs::is_directory(folder, ec))
    throw refused(std::string(option) + ": not a directory: " + folder);
}

}  // namespace

std::filesystem::path bundled_scenes() { return shipped_folder("scenes", "core/scenes"); }
std::filesystem::path bundled_web_page() { return shipped_folder("web", "web/dist"); }

ServerConfig checked(const ServeOptions& options) {
  ServerConfig config;
  config.address = options.address == "localhost" ? "127.0.0.1" : options.address;
  boost::system::error_code ec;
  const auto address = boost::asio::ip::make_address(config.address, ec);
  if (ec) throw refused("--address: not an IP address: " + options.address);
  if (!options.token_file.empty()) config.token = token_of(options.token_file);
  if (!address.is_loopback() && config.token.empty()) {
    throw refused("--address " + options.address +
                  " can be reached by others: it needs --token-file with a secret of " +
                  std::to_string(kShortestToken) + " or more characters");
  }
  if (options.threads < 0) throw refused("--threads: must be 0 or more");
  refuse_file("--data-dir", options.data_dir);
  refuse_file("--scenes-dir", options.scenes_dir);
  refuse_file("--web-root", options.web_root);
  config.port = options.port;
  config.threads = options.threads;
  config.web_root = options.web_root.empty() ? bundled_web_page().string() : options.web_root;
  if (!options.data_dir.empty())
    config.scene_folders.push_back(fs::path(options.data_dir) / "scenes");
  config.scene_folders.push_back(options.scenes_dir.empty() ? bundled_scenes()
                                                            : fs::path(options.scenes_dir));
  return config;
}

}  // namespace fstop::server
