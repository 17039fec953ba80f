#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/http_message.h"

namespace fstop::server {

/// Who may ask for what: the checks that need only the head of a request.
class AccessRules {
 public:
  struct Settings {
    /// Where the server listens. A wildcard address is known by any name, for then the token
    /// guards; otherwise Host must be a loopback name, `address` or one of `hosts`.
    std::string address = {};
    std::string token = {};                 // empty: none is asked for
    std::string url_key = {};               // signs URLs that need no token; empty: none do
    std::vector<std::string> hosts = {};    // further names, lower case
    std::vector<std::string> origins = {};  // whose pages may use the server, "https://a.example"
  };
  explicit AccessRules(Settings settings);

  /// Throws: Refusal 421 for a foreign Host; 401 for a call of the API without the token;
  ///         403 for a change asked for by another origin's page.
  void check(const Request& request) const;
  /// Tells the browser that a page of an allowed origin may see `reply` (the CORS protocol).
  void open_to_origin(const Request& request, Reply& reply) const;

 private:
  bool allows_origin(const Request& request) const;
  bool is_preflight(const Request& request) const;
  bool is_signed(const Request& request) const;
  bool knows_host(std::string_view host) const;
  bool bears_token(const Request& request) const;

  Settings settings_;
  bool any_host_ = false;
};

/// Whether both are equal, in a time that does not tell how much of them is.
bool equal_in_constant_time(std::string_view a, std::string_view b) noexcept;

/// `target` with the parameters that let it be fetched without a token until `expires`, seconds
/// since 1970: `expires` and `signature`, the HMAC-SHA256 of the target and the first.
std::string signed_target(std::string_view target, std::int64_t expires, std::string_view key);

/// Takes `expires` and `signature` off the query, where both end it.
void remove_signature(Request& request);

/// Checks what a POST or PUT says of its body: JSON, or a kind of file; not compressed, no unknown
/// expectation.
/// Throws: Refusal 415 or 417.
void check_content(const Request& request);

}  // namespace fstop::server
