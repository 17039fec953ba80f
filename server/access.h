#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/http_message.h"

namespace fstop::server {

/// Who may ask for what: the checks that need only the head of a request.
class AccessRules {
 public:
  /// `address`: where the server listens. A wildcard address is known by any name, for then the
  /// token guards; otherwise Host must be a loopback name or `address`.
  AccessRules(std::string_view address, std::string token);

  /// Throws: Refusal 421 for a foreign Host; 401 for a call of the API without the token;
  ///         403 for a change asked for by another origin's page.
  void check(const Request& request) const;

 private:
  bool knows_host(std::string_view host) const;
  bool bears_token(const Request& request) const;

  std::vector<std::string> hosts_;
  bool any_host_ = false;
  std::string token_;
};

/// Whether both are equal, in a time that does not tell how much of them is.
bool equal_in_constant_time(std::string_view a, std::string_view b) noexcept;

/// Checks what a POST says of its body: JSON, not compressed, no unknown expectation.
/// Throws: Refusal 415 or 417.
void check_content(const Request& request);

}  // namespace fstop::server
