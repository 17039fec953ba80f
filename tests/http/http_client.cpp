#include "tests/http/http_client.h"

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <cctype>
#include <cerrno>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdexcept>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <gtest/gtest.h>

#include "tests/http/contract.h"

namespace fstop::test {
namespace {

namespace http = boost::beast::http;
using Clock = std::chrono::steady_clock;

std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

bool is_readable(int socket, Clock::time_point deadline) {
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) return false;
    pollfd waiting = {.fd = socket, .events = POLLIN, .revents = 0};
    const int ready = ::poll(&waiting, 1, static_cast<int>(left.count()));
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
  }
}

Answer answer_of(const http::response<http::string_body>& response) {
  Answer answer;
  answer.status = static_cast<int>(response.result_int());
  for (const auto& field : response) {
    answer.headers[lower_case({field.name_string().data(), field.name_string().size()})] =
        std::string(field.value().data(), field.value().size());
  }
  answer.body = response.body();
  return answer;
}

}  // namespace

std::string request_text(std::string_view method, std::string_view target, const Headers& headers,
                         std::string_view body) {
  std::string text = std::string(method) + " " + std::string(target) + " HTTP/1.1\r\n";
  const auto has = [&](std::string_view name) {
    return std::any_of(headers.begin(), headers.end(),
                       [&](const auto& header) { return lower_case(header.first) == name; });
  };
  if (!has("host")) text += "Host: localhost\r\n";
  if (!body.empty() && !has("content-type")) text += "Content-Type: application/json\r\n";
  if (!body.empty() && !has("content-length"))
    text += "Content-Length: " + std::to_string(body.size()) + "\r\n";
  for (const auto& [name, value] : headers) text += name + ": " + value + "\r\n";
  return text + "\r\n" + std::string(body);
}

Client::Client(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int on = 1;
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    close();
    throw std::runtime_error("nothing listens on port " + std::to_string(port));
  }
}

Client::~Client() { close(); }

void Client::close() {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
}

void Client::reset() {
  const linger at_once = {.l_onoff = 1, .l_linger = 0};
  ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  close();
}

bool Client::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

bool Client::receive(Clock::time_point deadline) {
  if (!is_readable(socket_, deadline)) return false;
  std::array<char, 65536> bytes = {};
  const ssize_t count = ::recv(socket_, bytes.data(), bytes.size(), 0);
  if (count <= 0) return false;
  unread_.append(bytes.data(), static_cast<std::size_t>(count));
  return true;
}

std::optional<Answer> Client::read(bool to_head, std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  http::response_parser<http::string_body> parser;
  parser.eager(true);
  parser.skip(to_head);
  parser.body_limit(std::uint64_t{1} << 30U);
  while (!parser.is_done()) {
    if (unread_.empty() && !receive(deadline)) return std::nullopt;
    boost::beast::error_code ec;
    const auto used = parser.put(boost::asio::buffer(unread_), ec);
    unread_.erase(0, used);
    if (ec == http::error::need_more) {
      if (!receive(deadline)) return std::nullopt;
    } else if (ec) {
      throw std::runtime_error("the reply is not HTTP: " + ec.message());
    }
  }
  return answer_of(parser.get());
}

std::optional<Answer> Client::read_to_end(std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  while (receive(deadline)) continue;
  http::response_parser<http::string_body> parser;
  parser.eager(true);
  boost::beast::error_code ec;
  parser.put(boost::asio::buffer(unread_), ec);
  if (!ec) parser.put_eof(ec);
  if (ec) return std::nullopt;
  return answer_of(parser.get());
}

bool Client::is_closed_by_server(std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  if (!unread_.empty() || !is_readable(socket_, deadline)) return false;
  char byte = 0;
  return ::recv(socket_, &byte, 1, 0) <= 0;
}

Answer Client::ask(std::string_view method, std::string_view target, const Headers& headers,
                   std::string_view body) {
  send(request_text(method, target, headers, body));
  auto answer = read(method == "HEAD");
  if (!answer) throw std::runtime_error("no reply to " + std::string(target));
  EXPECT_EQ(contract_objection(method, target, *answer), "");
  return *std::move(answer);
}

Answer ask(std::uint16_t port, std::string_view method, std::string_view target,
           const Headers& headers, std::string_view body) {
  return Client(port).ask(method, target, headers, body);
}

}  // namespace fstop::test
