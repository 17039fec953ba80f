#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/trace.h"

namespace spdlog {
class logger;
namespace details {
class thread_pool;
}
}  // namespace spdlog

namespace fstop::server {

/// What the log says of one request; a session writes it once the request has ended.
struct RequestRecord {
  std::string id = {};
  std::string peer = {};
  std::string method = {};
  std::string path = {};
  std::string route = {};  // the pattern that matched
  int status = 0;          // 499: the client went away before the reply
  double duration_ms = 0.0;
  std::size_t reply_bytes = 0;
  std::string render = {};   // id of the render it led to
  std::string problem = {};  // slug of the problem it was answered with
  TraceContext trace = {};
  std::string error = {};  // what an exception said; never sent to a client
};

/// One member of a log line: a text, written escaped, or a number.
class LogField {
 public:
  LogField(std::string_view name, std::string_view text);
  LogField(std::string_view name, const char* text) : LogField(name, std::string_view(text)) {}
  LogField(std::string_view name, double number);
  LogField(std::string_view name, long long number);
  LogField(std::string_view name, int number) : LogField(name, static_cast<long long>(number)) {}
  const std::string& json() const noexcept { return json_; }

 private:
  std::string json_;
};

/// A log of JSON lines. Lines are written by a thread of its own; if that cannot follow, the oldest
/// are lost rather than a caller held up.
class Log {
 public:
  /// Appends to `file`, or writes to standard error if it is empty.
  /// Throws: Error{io_failure} if the file cannot be opened.
  explicit Log(const std::string& file = {});
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  void event(std::string_view name, const std::vector<LogField>& fields = {});
  void warning(std::string_view name, const std::vector<LogField>& fields = {});
  void request(const RequestRecord& record);

 private:
  std::shared_ptr<spdlog::details::thread_pool> threads_;
  std::shared_ptr<spdlog::logger> logger_;
};

/// `text` as a JSON string with its quotes: control characters and bytes outside ASCII escaped,
/// at most `max_bytes` of it.
std::string json_string(std::string_view text, std::size_t max_bytes = 256);

}  // namespace fstop::server
