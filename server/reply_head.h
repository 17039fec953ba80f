#pragma once

#include <string>

#include "api/problem.h"
#include "server/http_message.h"

namespace fstop::server {

/// Status line and header of `reply` as they go over the wire: with Date, Server, Content-Length
/// and, where `keep_alive` is false, Connection: close. Bodies made piece by piece have no length,
/// and are chunked while the connection goes on.
std::string reply_head(const Reply& reply, bool keep_alive);

/// A reply with a problem document (RFC 9457).
Reply problem_reply(int status, std::string_view slug, const std::string& detail);
Reply problem_reply(const api::Problem& problem);

/// The strong entity tag of content with this hash.
std::string etag_of(std::string_view hash);

/// Whether a reply with `etag` would tell a client nothing new: If-None-Match names it.
bool is_known_to_client(const Request& request, std::string_view etag);

/// 200 with the body and its tag, or 304 without it where the client has that already.
Reply tagged_reply(const Request& request, std::string media_type, const std::string& etag,
                   std::variant<std::string, SharedBytes> body);

}  // namespace fstop::server
