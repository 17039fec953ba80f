#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <boost/asio/awaitable.hpp>

#include "server/connection.h"
#include "server/http_message.h"
#include "server/log.h"

namespace fstop::server {

/// One request on its way through a handler.
struct Call {
  const Request& request;
  std::vector<std::string> parameters;  // what stood for the braces of the pattern
  Connection& client;                   // to notice that it went away
  RequestRecord& record;                // what the log will say
};

using Handler = std::function<boost::asio::awaitable<Reply>(Call&)>;

struct Route {
  http::verb verb = http::verb::get;
  std::string pattern = {};  // "/v1/renders/{id}": braces stand for one non-empty segment
  Handler handler = {};
};

/// All that the server answers, as one table. HEAD is answered wherever GET is, OPTIONS everywhere.
class Routes {
 public:
  struct Match {
    const Route* route = nullptr;
    std::vector<std::string> parameters = {};
  };

  void add(http::verb verb, std::string pattern, Handler handler);
  /// What answers a GET outside /v1 that no pattern fits; its parameter is the path.
  void set_files(Handler handler);

  /// Throws: Refusal 404, or 405 with Allow.
  Match match(http::verb verb, std::string_view path) const;
  /// The value of Allow for `path`, empty where nothing is there.
  std::string allowed(std::string_view path) const;

 private:
  std::vector<Route> routes_ = {};
  Route files_ = {};
};

/// Whether `path` is "/v1" or below it.
bool is_api_path(std::string_view path);
/// Whether a PUT there brings any bytes, which their hash alone says all about.
bool is_content_path(std::string_view path);
/// Whether a token is asked for there: the API and the metrics.
bool is_guarded_path(std::string_view path);

}  // namespace fstop::server
