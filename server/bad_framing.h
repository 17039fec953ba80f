#pragma once

#include <string>
#include <utility>

#include "server/http_message.h"

namespace fstop::server {

/// A request that two HTTP implementations may read differently: 400, and the connection ends.
inline Refusal bad_framing(std::string detail) {
  Refusal refusal(http::status::bad_request, "bad-framing", std::move(detail));
  refusal.closing();
  return refusal;
}

}  // namespace fstop::server
