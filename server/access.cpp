#include "server/access.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <boost/asio/ip/address.hpp>
#include <boost/beast/core/string.hpp>
#include <boost/system/error_code.hpp>

#include "server/routes.h"

namespace fstop::server {
namespace {

// "host" of "host:port", brackets of IPv6 kept.
std::string_view without_port(std::string_view host) {
  if (!host.empty() && host.front() == '[') return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.find(':'));
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

bool equal_ignoring_case(std::string_view a, std::string_view b) {
  return boost::beast::iequals({a.data(), a.size()}, {b.data(), b.size()});
}

bool is_safe(http::verb verb) {
  return verb == http::verb::get || verb == http::verb::head || verb == http::verb::options;
}

}  // namespace

bool equal_in_constant_time(std::string_view a, std::string_view b) noexcept {
  // Every byte of `b`, what the client sent, is looked at whatever the ones before it were.
  volatile unsigned char difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < b.size(); ++i) {
    const char expected = a.empty() ? '\0' : a[i % a.size()];
    difference = static_cast<unsigned char>(difference | (expected ^ b[i]));
  }
  return difference == 0;
}

AccessRules::AccessRules(std::string_view address, std::string token)
    : hosts_{"localhost", "127.0.0.1", "[::1]"}, token_(std::move(token)) {
  boost::system::error_code ec;
  const auto ip = boost::asio::ip::make_address(std::string(address), ec);
  any_host_ = !ec && ip.is_unspecified();
  hosts_.push_back(!ec && ip.is_v6() ? "[" + std::string(address) + "]" : std::string(address));
}

bool AccessRules::knows_host(std::string_view host) const {
  if (any_host_) return true;
  const std::string_view name = without_port(host);
  return std::find(hosts_.begin(), hosts_.end(), name) != hosts_.end();
}

bool AccessRules::bears_token(const Request& request) const {
  constexpr std::string_view kScheme = "Bearer ";
  const std::string_view value = request.header("Authorization");
  if (!equal_ignoring_case(value.substr(0, kScheme.size()), kScheme)) return false;
  return equal_in_constant_time(token_, trimmed(value.substr(kScheme.size())));
}

void AccessRules::check(const Request& request) const {
  // Only HTTP/1.0 may come without a Host; no browser sends that.
  if (!request.host.empty() && !knows_host(request.host)) {
    throw Refusal(http::status::misdirected_request, "unknown-host",
                  "this server does not go by the name of the request's Host");
  }
  if (!token_.empty() && is_api_path(request.path) && !bears_token(request)) {
    throw Refusal(http::status::unauthorized, "unauthorized",
                  "this server asks for its token: Authorization: Bearer ...")
        .with("WWW-Authenticate", "Bearer realm=\"fstop\"");
  }
  if (is_safe(request.verb) || !request.has_header("Origin")) return;
  const std::string_view origin = request.header("Origin");
  const std::size_t scheme_end = origin.find("://");
  const bool same = scheme_end != std::string_view::npos &&
                    equal_ignoring_case(origin.substr(scheme_end + 3), request.host);
  if (!same) {
    throw Refusal(http::status::forbidden, "origin-denied",
                  "pages of another origin may not ask this server for work");
  }
}

void check_content(const Request& request) {
  const std::string_view type = request.header("Content-Type");
  const std::string_view essence = trimmed(type.substr(0, type.find(';')));
  if (!equal_ignoring_case(essence, "application/json")) {
    throw Refusal(http::status::unsupported_media_type, "unsupported-media-type",
                  "the body must be sent as Content-Type: application/json")
        .with("Accept", "application/json");
  }
  const std::string_view coding = trimmed(request.header("Content-Encoding"));
  if (!coding.empty() && !equal_ignoring_case(coding, "identity")) {
    throw Refusal(http::status::unsupported_media_type, "unsupported-media-type",
                  "the body must not be compressed");
  }
  const std::string_view expectation = request.header("Expect");
  if (!expectation.empty() && !equal_ignoring_case(expectation, "100-continue")) {
    throw Refusal(http::status::expectation_failed, "expectation-failed",
                  "Expect may only be 100-continue");
  }
}

}  // namespace fstop::server
