#pragma once

#include <string>
#include <string_view>

namespace fstop::server {

/// Where a request stands in a distributed trace (W3C Trace Context, level 1).
struct TraceContext {
  std::string trace_id = {};   // 32 hexadecimal digits
  std::string parent_id = {};  // 16, of the caller's span; empty: the trace begins here
  std::string span_id = {};    // 16, of this request
  std::string flags = "00";

  /// For the reply and the calls that come of it.
  std::string traceparent() const;
};

/// The trace that `traceparent` continues; a new one where it is absent or malformed.
TraceContext trace_of(std::string_view traceparent);

}  // namespace fstop::server
