#include "server/http_client.h"

#include <algorithm>
#include <optional>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/url/parse.hpp>
#include <boost/url/url_view.hpp>

#include "core/error.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using tcp = asio::ip::tcp;

constexpr std::uint64_t kLargestReply = std::uint64_t{1} << 30U;

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower;
}

struct Place {
  std::string host = {};
  std::string port = {};
  std::string path = {};  // of a proxy, without the last slash
};

Place place_of(const std::string& url) {
  const auto parsed = boost::urls::parse_uri(url);
  if (!parsed || parsed->scheme() != "http" || parsed->host_address().empty()) {
    throw Error(ErrorCode::invalid_request,
                "--server: must be a URL such as http://127.0.0.1:8080, got " + url);
  }
  Place place{.host = std::string(parsed->host_address()),
              .port = parsed->has_port() ? std::string(parsed->port()) : "80",
              .path = std::string(parsed->encoded_path())};
  while (place.path.ends_with('/')) place.path.pop_back();
  return place;
}

ClientReply reply_of(http::response<http::string_body> response) {
  ClientReply reply{.status = static_cast<int>(response.result_int())};
  for (const auto& field : response) {
    const auto name = field.name_string();
    const auto value = field.value();
    reply.headers[lower_case({name.data(), name.size()})] = std::string(value.data(), value.size());
  }
  reply.body = std::move(response.body());
  return reply;
}

}  // namespace

struct HttpClient::Impl {
  std::string url = {};
  Place place = {};
  std::string token = {};
  asio::io_context context = asio::io_context(1);
  std::optional<beast::tcp_stream> stream = {};
  beast::flat_buffer buffer = {};

  asio::awaitable<void> connect() {
    tcp::resolver resolver(context);
    const auto addresses =
        co_await resolver.async_resolve(place.host, place.port, asio::use_awaitable);
    buffer.clear();
    stream.emplace(context);
    stream->expires_after(std::chrono::seconds(10));
    co_await stream->async_connect(addresses, asio::use_awaitable);
    stream->socket().set_option(tcp::no_delay(true));
  }

  asio::awaitable<ClientReply> exchange(const http::request<http::string_body>& request,
                                        std::chrono::milliseconds patience) {
    if (!stream) co_await connect();
    stream->expires_after(patience);
    co_await http::async_write(*stream, request, asio::use_awaitable);
    http::response_parser<http::string_body> parser;
    parser.body_limit(kLargestReply);
    co_await http::async_read(*stream, buffer, parser, asio::use_awaitable);
    if (!parser.get().keep_alive()) stream.reset();
    co_return reply_of(parser.release());
  }

  // Runs one exchange to its end; its exception, if it has one, is thrown here.
  ClientReply run(const http::request<http::string_body>& request,
                  std::chrono::milliseconds patience) {
    std::optional<ClientReply> reply;
    std::exception_ptr failure;
    context.restart();
    asio::co_spawn(context, exchange(request, patience),
                   [&](std::exception_ptr error, ClientReply answer) {
                     failure = std::move(error);
                     reply = std::move(answer);
                   });
    context.run();
    if (failure) {
      stream.reset();
      std::rethrow_exception(failure);
    }
    return *std::move(reply);
  }
};

HttpClient::HttpClient(const std::string& url, std::string token)
    : impl_(std::make_unique<Impl>()) {
  impl_->url = url;
  impl_->place = place_of(url);
  impl_->token = std::move(token);
}

HttpClient::~HttpClient() = default;

const std::string& HttpClient::url() const noexcept { return impl_->url; }

ClientReply HttpClient::ask(std::string_view method, std::string_view target,
                            const std::map<std::string, std::string>& headers,
                            std::string_view body, std::chrono::milliseconds patience) {
  http::request<http::string_body> request;
  request.version(11);
  request.method_string({method.data(), method.size()});
  request.target(impl_->place.path + std::string(target));
  const std::string& host = impl_->place.host;
  const std::string shown = host.find(':') == std::string::npos ? host : "[" + host + "]";
  request.set(http::field::host, shown + ":" + impl_->place.port);
  request.set(http::field::user_agent, "fstop");
  if (!impl_->token.empty()) request.set(http::field::authorization, "Bearer " + impl_->token);
  for (const auto& [name, value] : headers) request.set(name, value);
  if (!body.empty()) request.set(http::field::content_type, "application/json");
  request.body() = std::string(body);
  request.prepare_payload();
  const bool was_kept = impl_->stream.has_value();
  try {
    return impl_->run(request, patience);
  } catch (const boost::system::system_error& error) {
    // What a server has closed since the last reply shows only when it is used.
    if (was_kept && error.code() != beast::error::timeout) {
      try {
        return impl_->run(request, patience);
      } catch (const boost::system::system_error& again) {
        throw Error(ErrorCode::io_failure,
                    "the server " + impl_->url + " cannot be reached: " + again.code().message());
      }
    }
    throw Error(ErrorCode::io_failure,
                "the server " + impl_->url + " cannot be reached: " + error.code().message());
  }
}

}  // namespace fstop::server
