#include "server/trace.h"

#include <cstdint>
#include <random>

namespace fstop::server {
namespace {

// Names of spans must differ, not be secret: once for every request, so it has to be cheap.
std::string fresh_hex(int words) {
  thread_local std::mt19937_64 generator = [] {
    std::random_device device;
    std::seed_seq seed = {device(), device(), device(), device()};
    return std::mt19937_64(seed);
  }();
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (int i = 0; i < words; ++i) {
    std::uint64_t word = generator() | 1U;  // all zeros are no name
    for (int digit = 0; digit < 16; ++digit, word >>= 4U) text += kDigits[word & 15U];
  }
  return text;
}

bool is_hex(std::string_view text) {
  return text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

bool is_zero(std::string_view text) {
  return text.find_first_not_of('0') == std::string_view::npos;
}

}  // namespace

std::string TraceContext::traceparent() const {
  return "00-" + trace_id + "-" + span_id + "-" + flags;
}

TraceContext trace_of(std::string_view traceparent) {
  TraceContext trace{.span_id = fresh_hex(1)};
  // version "-" trace-id "-" parent-id "-" flags; later versions may go on after another "-".
  constexpr std::size_t kLength = 55;
  const bool has_form = traceparent.size() >= kLength && traceparent[2] == '-' &&
                        traceparent[35] == '-' && traceparent[52] == '-';
  const std::string_view version = traceparent.substr(0, has_form ? 2 : 0);
  const bool ends_well =
      traceparent.size() == kLength || (has_form && version != "00" && traceparent[kLength] == '-');
  if (has_form && ends_well && version != "ff" && is_hex(version)) {
    const std::string_view id = traceparent.substr(3, 32);
    const std::string_view parent = traceparent.substr(36, 16);
    const std::string_view flags = traceparent.substr(53, 2);
    if (is_hex(id) && is_hex(parent) && is_hex(flags) && !is_zero(id) && !is_zero(parent)) {
      trace.trace_id = std::string(id);
      trace.parent_id = std::string(parent);
      trace.flags = std::string(flags);
      return trace;
    }
  }
  trace.trace_id = fresh_hex(2);
  return trace;
}

}  // namespace fstop::server
