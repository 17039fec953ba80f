
#include <chrono>
#include <filesystem>
#include <iostream>
#include <malloc.h>
#include <span>
#include <string>
#include <system_error>

#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>

#include "api/scene_upload.h"
#include "core/error.h"
#include "server/access.h"
#include "server/commands.h"
#include "server/log.h"
#include "server/sandbox.h"
#include "server/server.h"

namespace fstop::server {
namespace {

constexpr int kLargestInHeap = 1 << 20;
constexpr auto kProbeTime = std::chrono::seconds(3);

// Exists while the server listens.
class PortFile {
 public:
  PortFile(std::string file, std::uint16_t port) : file_(std::move(file)) {
    if (!file_.empty()) write_file(file_, std::to_string(port) + "\n");
  }
  ~PortFile() {
    std::error_code ignored;
    if (!file_.empty()) std::filesystem::remove(file_, ignored);
  }
  PortFile(const PortFile&) = delete;
  PortFile& operator=(const PortFile&) = delete;

 private:
  std::string file_;
};

}  // namespace

int serve(const ServeOptions& options) {
  // Left to itself, glibc raises this to 32 MiB by what is freed, and from then on keeps large
  // buffers (bodies, pictures) in heaps whose holes never go back to the system.
  ::mallopt(M_MMAP_THRESHOLD, kLargestInHeap);
  const ServerConfig config = checked(options);
  Log log(options.log_file);
  Server server(config, log);
  server.stop_on_signals();
  const PortFile port_file(options.port_file, server.port());
  const PortFile probe_port_file(options.probe_port_file, server.probe_port());
  server.run();
  return 0;
}

int read_scene(const std::string& name) {
  enter_sandbox({});
  const std::string bytes = text_of("-", api::ArchiveLimits{}.packed_bytes);
  const api::UploadedScene scene =
      api::read_upload(name, std::as_bytes(std::span(bytes)), api::Limits{});
  std::cout << api::packed_upload(scene) << std::flush;
  return std::cout ? 0 : 1;
}

int sign(const SignOptions& options) {
  if (!options.target.starts_with('/'))
    throw Error(ErrorCode::invalid_request, "the target must begin with /");
  const std::string key = secret_of(options.url_key_file, "--url-key-file");
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto expires =
      std::chrono::duration_cast<std::chrono::seconds>(now).count() + options.valid_s;
  std::cout << signed_target(options.target, expires, key) << '\n' << std::flush;
  return 0;
}

int probe(const ProbeOptions& options) {
  namespace asio = boost::asio;
  namespace beast = boost::beast;
  boost::system::error_code ec;
  const auto address = asio::ip::make_address(options.address, ec);
  if (ec) {
    throw Error(ErrorCode::invalid_request, "--address: not an IP address: " + options.address);
  }
  // One asynchronous exchange, so that its deadline holds for every step.
  asio::io_context context;
  beast::tcp_stream stream(context);
  http::request<http::empty_body> request(http::verb::get, "/readyz", 11);
  request.set(http::field::host, address.is_v6() ? "[::1]" : "127.0.0.1");
  request.set(http::field::connection, "close");
  http::response<http::string_body> response;
  beast::flat_buffer buffer;
  bool is_ready = false;
  stream.expires_after(kProbeTime);
  stream.async_connect({address, options.port}, [&](beast::error_code refused) {
    if (refused) return;
    http::async_write(stream, request, [&](beast::error_code failed, std::size_t) {
      if (failed) return;
      http::async_read(stream, buffer, response, [&](beast::error_code broken, std::size_t) {
        is_ready = !broken && response.result() == http::status::ok;
      });
    });
  });
  context.run();
  return is_ready ? 0 : 1;
}

}  // namespace fstop::server
