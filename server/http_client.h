#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace fstop::server {

/// A reply of another server.
struct ClientReply {
  int status = 0;
  std::map<std::string, std::string> headers = {};  // names in lower case
  std::string body = {};

  std::string header(const std::string& name) const {
    const auto found = headers.find(name);
    return found == headers.end() ? std::string() : found->second;
  }
};

/// Asks one fstop server, over one connection that is kept while the server keeps it.
class HttpClient {
 public:
  /// `url`: http://host[:port][/path of a proxy]. `token`: sent as a bearer's unless empty.
  /// Throws: Error{invalid_request} for a URL that is none or of another scheme.
  HttpClient(const std::string& url, std::string token);
  ~HttpClient();
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  const std::string& url() const noexcept;

  /// `target`: a path and query of the server. A body is sent as JSON. `patience`: for the whole
  /// exchange. A connection that the server has closed meanwhile is opened anew, once.
  /// Throws: Error{io_failure} naming the server where it cannot be reached, goes, or does not
  ///         answer in time.
  ClientReply ask(std::string_view method, std::string_view target,
                  const std::map<std::string, std::string>& headers = {},
                  std::string_view body = {},
                  std::chrono::milliseconds patience = std::chrono::seconds(60));

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fstop::server
