#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace fstop::test {

using Headers = std::vector<std::pair<std::string, std::string>>;

/// A reply as it came over the wire.
struct Answer {
  int status = 0;
  std::map<std::string, std::string> headers = {};  // names in lower case
  std::string body = {};

  std::string header(const std::string& name) const {
    const auto found = headers.find(name);
    return found == headers.end() ? std::string() : found->second;
  }
};

/// A request as text, with Host, and Content-Type and Content-Length where there is a body.
std::string request_text(std::string_view method, std::string_view target,
                         const Headers& headers = {}, std::string_view body = {});

/// A connection to a server on the loopback that sends any bytes, right or wrong, and reads
/// replies. No call waits longer than its patience.
class Client {
 public:
  explicit Client(std::uint16_t port);
  ~Client();
  Client(Client&& other) noexcept : socket_(std::exchange(other.socket_, -1)) {}
  Client& operator=(Client&&) = delete;
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// False if the server has closed the connection.
  bool send(std::string_view bytes);
  /// The next reply; none if the connection ends or nothing comes. `to_head`: it has no body.
  std::optional<Answer> read(bool to_head = false,
                             std::chrono::milliseconds patience = std::chrono::seconds(60));
  /// The next reply where its body ends with the connection.
  std::optional<Answer> read_to_end(std::chrono::milliseconds patience = std::chrono::seconds(60));
  /// Whether the server ends the connection, having sent nothing more.
  bool is_closed_by_server(std::chrono::milliseconds patience = std::chrono::seconds(10));
  /// send() and read() of one request.
  Answer ask(std::string_view method, std::string_view target, const Headers& headers = {},
             std::string_view body = {});
  void close();
  /// Ends the connection as a process that was killed: with a reset.
  void reset();

 private:
  /// False at the end of the stream or when nothing comes.
  bool receive(std::chrono::steady_clock::time_point deadline);

  int socket_ = -1;
  std::string unread_ = {};
};

/// One request on a connection of its own. Its reply is held against the served contract: what
/// that does not tell of is a failure of the test.
Answer ask(std::uint16_t port, std::string_view method, std::string_view target,
           const Headers& headers = {}, std::string_view body = {});

}  // namespace fstop::test
