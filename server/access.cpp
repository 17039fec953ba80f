#include "server/access.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <optional>
#include <utility>

#include <boost/asio/ip/address.hpp>
#include <boost/beast/core/string.hpp>
#include <boost/system/error_code.hpp>

#include "api/secret.h"
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

constexpr std::string_view kExpires = "expires=";
constexpr std::string_view kSignature = "signature=";

struct UrlSignature {
  std::string_view rest = {};  // the query without it
  std::int64_t expires = 0;    // seconds since 1970
  std::string_view signature = {};
};

// "...&expires=N&signature=S" at the end of a query.
std::optional<UrlSignature> signature_of(std::string_view query) {
  UrlSignature found;
  const std::size_t at = query.rfind(kSignature);
  if (at == std::string_view::npos || at == 0 || query[at - 1] != '&') return {};
  found.signature = query.substr(at + kSignature.size());
  query = query.substr(0, at - 1);
  const std::size_t begin = query.rfind(kExpires);
  if (begin == std::string_view::npos || (begin > 0 && query[begin - 1] != '&')) return {};
  const std::string_view digits = query.substr(begin + kExpires.size());
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), found.expires);
  if (error != std::errc() || end != digits.data() + digits.size()) return {};
  found.rest = query.substr(0, begin == 0 ? 0 : begin - 1);
  return found;
}

std::string signature(std::string_view path, std::string_view query, std::int64_t expires,
                      std::string_view key) {
  std::string text(path);
  text.append("\n").append(query).append("\n").append(std::to_string(expires));
  return api::hmac_sha256_hex(key, text);
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

AccessRules::AccessRules(Settings settings) : settings_(std::move(settings)) {
  boost::system::error_code ec;
  const auto ip = boost::asio::ip::make_address(settings_.address, ec);
  any_host_ = !ec && ip.is_unspecified();
  std::vector<std::string>& hosts = settings_.hosts;
  for (const char* name : {"localhost", "127.0.0.1", "[::1]"}) hosts.emplace_back(name);
  hosts.push_back(!ec && ip.is_v6() ? "[" + settings_.address + "]" : settings_.address);
}

bool AccessRules::knows_host(std::string_view host) const {
  if (any_host_) return true;
  const std::string_view name = without_port(host);
  return std::find(settings_.hosts.begin(), settings_.hosts.end(), name) != settings_.hosts.end();
}

bool AccessRules::bears_token(const Request& request) const {
  constexpr std::string_view kScheme = "Bearer ";
  const std::string_view value = request.header("Authorization");
  if (!equal_ignoring_case(value.substr(0, kScheme.size()), kScheme)) return false;
  return equal_in_constant_time(settings_.token, trimmed(value.substr(kScheme.size())));
}

// A signature stands for reading alone, and for the one target.
bool AccessRules::is_signed(const Request& request) const {
  const bool reads = request.verb == http::verb::get || request.verb == http::verb::head;
  const auto found = signature_of(request.query);
  if (settings_.url_key.empty() || !reads || !found) return false;
  const std::string expected =
      signature(request.path, found->rest, found->expires, settings_.url_key);
  const bool is_right = equal_in_constant_time(expected, found->signature);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return is_right && std::chrono::duration_cast<std::chrono::seconds>(now).count() < found->expires;
}

bool AccessRules::allows_origin(const Request& request) const {
  const std::string_view origin = request.header("Origin");
  return std::find(settings_.origins.begin(), settings_.origins.end(), origin) !=
         settings_.origins.end();
}

bool AccessRules::is_preflight(const Request& request) const {
  return request.verb == http::verb::options &&
         request.has_header("Access-Control-Request-Method") && allows_origin(request);
}

void AccessRules::check(const Request& request) const {
  // Only HTTP/1.0 may come without a Host; no browser sends that.
  if (!request.host.empty() && !knows_host(request.host)) {
    throw Refusal(http::status::misdirected_request, "unknown-host",
                  "this server does not go by the name of the request's Host");
  }
  const bool needs_token = !settings_.token.empty() && is_guarded_path(request.path);
  // Browsers send no token with the question whether they may send one.
  if (needs_token && !is_preflight(request) && !bears_token(request) && !is_signed(request)) {
    throw Refusal(http::status::unauthorized, "unauthorized",
                  "this server asks for its token: Authorization: Bearer ...")
        .with("WWW-Authenticate", "Bearer realm=\"fstop\"");
  }
  if (is_safe(request.verb) || !request.has_header("Origin")) return;
  const std::string_view origin = request.header("Origin");
  const std::size_t scheme_end = origin.find("://");
  const bool same = scheme_end != std::string_view::npos &&
                    equal_ignoring_case(origin.substr(scheme_end + 3), request.host);
  if (!same && !allows_origin(request)) {
    throw Refusal(http::status::forbidden, "origin-denied",
                  "pages of another origin may not ask this server for work");
  }
}

void AccessRules::open_to_origin(const Request& request, Reply& reply) const {
  if (settings_.origins.empty()) return;
  reply.set("Vary", "Origin");
  if (!request.has_header("Origin") || !allows_origin(request)) return;
  reply.set("Access-Control-Allow-Origin", std::string(request.header("Origin")));
  reply.set("Access-Control-Expose-Headers",
            "Location, Retry-After, Server-Timing, ETag, Preference-Applied, Fstop-Render-Id, "
            "Fstop-Method, Fstop-Error, Fstop-Stretch, Fstop-Request-Id, traceparent");
  if (!is_preflight(request)) return;
  reply.set("Access-Control-Allow-Methods", "GET, HEAD, POST, PUT, DELETE");
  reply.set("Access-Control-Allow-Headers",
            "Authorization, Content-Type, Prefer, Idempotency-Key, Fstop-Deadline-Ms, "
            "Last-Event-ID, If-None-Match, traceparent");
  reply.set("Access-Control-Max-Age", "3600");
}

std::string signed_target(std::string_view target, std::int64_t expires, std::string_view key) {
  const std::size_t question = target.find('?');
  const std::string_view path = target.substr(0, question);
  const std::string_view query =
      question == std::string_view::npos ? std::string_view() : target.substr(question + 1);
  std::string text(path);
  text.append("?").append(query).append(query.empty() ? "" : "&");
  text.append(kExpires).append(std::to_string(expires)).append("&").append(kSignature);
  return text.append(signature(path, query, expires, key));
}

void remove_signature(Request& request) {
  if (const auto found = signature_of(request.query)) request.query = std::string(found->rest);
}

void check_content(const Request& request) {
  const std::string_view type = request.header("Content-Type");
  const std::string_view essence = trimmed(type.substr(0, type.find(';')));
  std::vector<std::string_view> accepted = {"application/json"};
  if (request.verb == http::verb::put) {
    accepted = {"application/zip", "model/gltf-binary"};
    if (is_content_path(request.path)) accepted = {"application/octet-stream"};
  }
  const auto is_essence = [&](std::string_view one) { return equal_ignoring_case(essence, one); };
  if (std::none_of(accepted.begin(), accepted.end(), is_essence)) {
    std::string types;
    for (const std::string_view one : accepted) types.append(types.empty() ? "" : ", ").append(one);
    throw Refusal(http::status::unsupported_media_type, "unsupported-media-type",
                  "the body must be sent as Content-Type: " + types)
        .with("Accept", types);
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
