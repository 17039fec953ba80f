#include "server/routes.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace fstop::server {
namespace {

// The first segment of `path`, which then begins behind it; `path` without data at its end.
std::string_view next_segment(std::string_view& path) {
  const std::size_t slash = path.find('/');
  const std::string_view segment = path.substr(0, slash);
  path = slash == std::string_view::npos ? std::string_view() : path.substr(slash + 1);
  return segment;
}

bool is_parameter(std::string_view segment) {
  return segment.size() >= 2 && segment.front() == '{' && segment.back() == '}';
}

// What stands for the braces of `pattern` in `path`; empty optional where they differ.
std::optional<std::vector<std::string>> captures(std::string_view pattern, std::string_view path) {
  std::vector<std::string> values;
  while (pattern.data() != nullptr && path.data() != nullptr) {
    const std::string_view expected = next_segment(pattern);
    const std::string_view given = next_segment(path);
    if (is_parameter(expected) && !given.empty()) {
      values.emplace_back(given);
    } else if (expected != given) {
      return std::nullopt;
    }
  }
  if (pattern.data() != nullptr || path.data() != nullptr) return std::nullopt;
  return values;
}

Refusal nothing_there() {
  return Refusal(http::status::not_found, "not-found", "nothing is at this path");
}

}  // namespace

void Routes::add(http::verb verb, std::string pattern, Handler handler) {
  routes_.push_back({verb, std::move(pattern), std::move(handler)});
}

void Routes::set_files(Handler handler) {
  files_ = {http::verb::get, "/{file}", std::move(handler)};
}

Routes::Match Routes::match(http::verb verb, std::string_view path) const {
  const http::verb wanted = verb == http::verb::head ? http::verb::get : verb;
  for (const Route& route : routes_) {
    if (route.verb != wanted) continue;
    if (auto values = captures(route.pattern, path)) return {&route, std::move(*values)};
  }
  const std::string allow = allowed(path);
  if (!allow.empty()) {
    throw Refusal(http::status::method_not_allowed, "method-not-allowed",
                  "this path answers " + allow)
        .with("Allow", allow);
  }
  const bool may_be_file = wanted == http::verb::get && !is_api_path(path) && files_.handler;
  if (!may_be_file) throw nothing_there();
  return {&files_, {std::string(path)}};
}

std::string Routes::allowed(std::string_view path) const {
  constexpr std::array<std::pair<http::verb, const char*>, 4> kVerbs = {
      {{http::verb::get, "GET, HEAD, "},
       {http::verb::post, "POST, "},
       {http::verb::put, "PUT, "},
       {http::verb::delete_, "DELETE, "}}};
  std::string allow;
  for (const auto& [verb, names] : kVerbs) {
    const auto fits = [&, wanted = verb](const Route& route) {
      return route.verb == wanted && captures(route.pattern, path);
    };
    if (std::any_of(routes_.begin(), routes_.end(), fits)) allow += names;
  }
  return allow.empty() ? allow : allow + "OPTIONS";
}

bool is_api_path(std::string_view path) { return path == "/v1" || path.substr(0, 4) == "/v1/"; }

bool is_content_path(std::string_view path) { return path.starts_with("/v1/files/"); }

bool is_guarded_path(std::string_view path) { return is_api_path(path) || path == "/metrics"; }

}  // namespace fstop::server
