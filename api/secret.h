#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace fstop::api {

/// `bytes` random bytes that nobody can guess, two hexadecimal digits each.
/// Throws: Error{internal} if the system has none.
std::string random_hex(std::size_t bytes);

/// HMAC-SHA256 of `text` under `key` (RFC 2104), 64 lower-case hexadecimal digits.
/// Throws: Error{internal} if the library fails.
std::string hmac_sha256_hex(std::string_view key, std::string_view text);

}  // namespace fstop::api
