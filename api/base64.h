#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace fstop::api {

/// The bytes of a text in base64, padded, without line breaks (RFC 4648 4); nothing for what is
/// none.
std::optional<std::string> base64_decoded(std::string_view text);

}  // namespace fstop::api
