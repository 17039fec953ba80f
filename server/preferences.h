#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "api/limits.h"
#include "server/http_message.h"

namespace fstop::server {

/// How a client wants to be answered (RFC 7240 and two headers of its kind).
struct Preferences {
  bool respond_async = false;           // Prefer: respond-async
  std::chrono::milliseconds wait = {};  // Prefer: wait=N, else the server's own patience
  std::string applied = {};             // for Preference-Applied; empty: nothing was asked for
  /// Fstop-Deadline-Ms: nobody needs the answer after this time.
  std::optional<std::chrono::milliseconds> deadline = {};
  std::string idempotency_key = {};  // Idempotency-Key; empty: none
};

/// What the request's headers say. Preferences that are unknown or malformed are passed over, as
/// RFC 7240 has it; `wait` is cut at limits.longest_wait.
/// Throws: Refusal 400 for a Fstop-Deadline-Ms or Idempotency-Key that is none.
Preferences preferences_of(const Request& request, const api::Limits& limits);

}  // namespace fstop::server
