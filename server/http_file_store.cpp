#include "server/http_file_store.h"

#include <algorithm>
#include <array>
#include <thread>
#include <utility>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/span_body.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/url/parse.hpp>

#include "api/limits.h"
#include "api/render_id.h"
#include "core/error.h"
#include "server/http_message.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;

constexpr auto kConnectTime = std::chrono::seconds(5);
constexpr auto kAnswerTime = std::chrono::seconds(30);  // beside the time that the bytes need
constexpr double kSlowest = 1024.0 * 1024.0;            // bytes per second
constexpr std::array<std::chrono::milliseconds, 3> kPauses = {
    std::chrono::milliseconds(50), std::chrono::milliseconds(200), std::chrono::milliseconds(800)};

Error unreachable(const std::string& address, const std::string& why) {
  return {ErrorCode::io_failure, "the results store at " + address + ": " + why};
}

std::chrono::steady_clock::duration time_for(std::size_t bytes) {
  return kAnswerTime + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                           std::chrono::duration<double>(static_cast<double>(bytes) / kSlowest));
}

}  // namespace

// A connection and the loop that serves its one exchange.
struct HttpFileStore::Link {
  asio::io_context context = {};
  beast::tcp_stream stream{context};
  beast::flat_buffer buffer = {};

  // Runs what was begun to its end; every step has a deadline.
  void run() {
    context.restart();
    context.run();
  }
};

struct HttpFileStore::Response {
  unsigned status = 0;
  std::string body = {};
  std::uint64_t length = 0;  // as Content-Length says, of a HEAD too
};

HttpFileStore::HttpFileStore(const std::string& url, std::string token)
    : address_(url), token_(std::move(token)) {
  const auto parts = boost::urls::parse_uri(url);
  if (!parts || parts->scheme() != "http" || parts->encoded_host().empty() ||
      parts->has_userinfo() || parts->has_query() || parts->has_fragment()) {
    throw Error(ErrorCode::invalid_request, "--results: must be http://host[:port]");
  }
  host_ = parts->host_address();
  if (parts->has_port() && !parts->port().empty()) port_ = parts->port();
  prefix_ = parts->encoded_path();
  while (prefix_.ends_with('/')) prefix_.pop_back();
}

HttpFileStore::~HttpFileStore() = default;

HttpFileStore::Response HttpFileStore::exchange_once(const char* method, std::string_view sha256,
                                                     std::string_view body) {
  std::string failure;
  if (!link_) {
    auto link = std::make_unique<Link>();
    asio::ip::tcp::resolver resolver(link->context);
    boost::system::error_code unresolved;
    const auto endpoints = resolver.resolve(host_, port_, unresolved);
    if (unresolved) throw unreachable(address_, unresolved.message());
    link->stream.expires_after(kConnectTime);
    link->stream.async_connect(endpoints, [&](beast::error_code ec, const auto&) {
      if (ec) failure = ec.message();
    });
    link->run();
    if (!failure.empty()) throw unreachable(address_, failure);
    beast::error_code ignored;
    link->stream.socket().set_option(asio::ip::tcp::no_delay(true), ignored);
    link_ = std::move(link);
  }
  Link& link = *link_;
  const std::string target = prefix_ + "/v1/files/" + std::string(sha256);
  // The body is sent from where it lies.
  http::request<http::span_body<const char>> request(http::string_to_verb(method), target, 11);
  const bool is_v6 = host_.find(':') != std::string::npos;
  request.set(http::field::host, (is_v6 ? "[" + host_ + "]" : host_) + ":" + port_);
  if (!token_.empty()) request.set(http::field::authorization, "Bearer " + token_);
  if (request.method() == http::verb::put) {
    request.set(http::field::content_type, "application/octet-stream");
    request.body() = beast::span<const char>(body.data(), body.size());
    request.prepare_payload();
  }
  http::response_parser<http::string_body> parser;
  parser.body_limit(api::Limits{}.content_bytes);
  if (request.method() == http::verb::head) parser.skip(true);
  link.stream.expires_after(time_for(std::max(body.size(), api::Limits{}.content_bytes / 8)));
  http::async_write(link.stream, request, [&](beast::error_code unsent, std::size_t) {
    // A server that refuses early answers before all is sent: what it says is read in any case.
    http::async_read(link.stream, link.buffer, parser, [&](beast::error_code ec, std::size_t) {
      if (ec) failure = unsent ? unsent.message() : ec.message();
    });
  });
  link.run();
  if (!failure.empty() || !parser.is_done()) {
    link_.reset();
    throw unreachable(address_, failure.empty() ? "no whole answer" : failure);
  }
  Response response{.status = parser.get().result_int(), .body = std::move(parser.get().body())};
  const auto length = parser.content_length();
  response.length = length ? *length : 0;
  if (!parser.keep_alive()) link_.reset();
  return response;
}

// An answer that will not be another at once, after a few tries.
HttpFileStore::Response HttpFileStore::exchange(const char* method, std::string_view sha256,
                                                std::string_view body) {
  const std::lock_guard lock(mutex_);
  for (std::size_t tries = 0;; ++tries) {
    try {
      Response response = exchange_once(method, sha256, body);
      const bool is_passing = response.status == 408 || response.status == 429 ||
                              response.status == 500 || response.status == 502 ||
                              response.status == 503 || response.status == 504;
      if (!is_passing || tries == kPauses.size()) return response;
    } catch (const Error&) {
      // One of the tries may have met a connection that the server had closed meanwhile.
      if (tries == kPauses.size()) throw;
    }
    std::this_thread::sleep_for(kPauses[tries]);
  }
}

void HttpFileStore::refuse(const Response& response) const {
  if (response.status == 507) {
    throw Refusal(http::status::insufficient_storage, "storage-full",
                  "the results store at " + address_ + " has no room");
  }
  if (response.status == 413) {
    throw Error(ErrorCode::over_budget,
                "the results store at " + address_ + " takes no file of this size");
  }
  if (response.status == 401 || response.status == 403)
    throw unreachable(address_, "it does not accept the token");
  throw unreachable(address_, "it answers " + std::to_string(response.status));
}

std::string HttpFileStore::put(std::string_view bytes) {
  std::string hash = api::sha256_hex(bytes);
  const Response response = exchange("PUT", hash, bytes);
  if (response.status / 100 != 2) refuse(response);
  return hash;
}

std::optional<std::string> HttpFileStore::get(std::string_view sha256) {
  Response response = exchange("GET", sha256, {});
  if (response.status == 404) return std::nullopt;
  if (response.status != 200) refuse(response);
  if (api::sha256_hex(response.body) != sha256)
    throw unreachable(address_, "it sends other bytes than were asked for");
  return std::move(response.body);
}

bool HttpFileStore::has(const CellFile& file) {
  const Response response = exchange("HEAD", file.sha256, {});
  if (response.status == 404) return false;
  if (response.status != 200) refuse(response);
  return response.length == file.bytes;
}

}  // namespace fstop::server
