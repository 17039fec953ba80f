#include "server/preferences.h"

#include <algorithm>
#include <charconv>
#include <cstdint>

#include "server/header_list.h"

namespace fstop::server {
namespace {

constexpr std::size_t kLongestKey = 255;

std::optional<std::uint32_t> number(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

void note(Preferences& preferences, std::string_view applied) {
  preferences.applied += (preferences.applied.empty() ? "" : ", ") + std::string(applied);
}

// One list of RFC 7240. Of a preference that comes twice the first counts.
void read_list(std::string_view list, Preferences& preferences, bool& has_wait,
               const api::Limits& limits) {
  while (!list.empty()) {
    std::string_view parameters = next_part(list, ',');
    std::string_view value = next_part(parameters, ';');
    const std::string_view name = next_part(value, '=');
    if (equal(name, "respond-async") && !preferences.respond_async) {
      preferences.respond_async = true;
      note(preferences, "respond-async");
    } else if (equal(name, "wait") && !has_wait) {
      const auto seconds = number(value);
      if (!seconds) continue;
      has_wait = true;
      preferences.wait =
          std::min(limits.longest_wait, std::chrono::milliseconds(std::int64_t{1000} * *seconds));
      note(preferences, "wait=" + std::to_string(preferences.wait.count() / 1000));
    }
  }
}

Refusal bad_header(const char* detail) { return {http::status::bad_request, "bad-header", detail}; }

}  // namespace

Preferences preferences_of(const Request& request, const api::Limits& limits) {
  Preferences preferences{.wait = limits.synchronous_wait};
  bool has_wait = false;
  const auto [first, last] = request.fields.equal_range(http::field::prefer);
  for (auto field = first; field != last; ++field) {
    read_list({field->value().data(), field->value().size()}, preferences, has_wait, limits);
  }
  if (preferences.respond_async && !has_wait) preferences.wait = {};
  if (request.has_header("Fstop-Deadline-Ms")) {
    const auto ms = number(request.header("Fstop-Deadline-Ms"));
    if (!ms || *ms == 0) throw bad_header("Fstop-Deadline-Ms must be a whole number from 1");
    preferences.deadline = std::chrono::milliseconds(*ms);
  }
  if (request.has_header("Idempotency-Key")) {
    const std::string_view key = request.header("Idempotency-Key");
    const auto visible = [](unsigned char c) { return c > 0x20 && c < 0x7F; };
    if (key.empty() || key.size() > kLongestKey || !std::all_of(key.begin(), key.end(), visible))
      throw bad_header("Idempotency-Key must be 1 to 255 visible ASCII characters");
    preferences.idempotency_key = std::string(key);
  }
  return preferences;
}

}  // namespace fstop::server
