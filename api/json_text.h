#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "api/limits.h"

namespace fstop::api {

/// The value that `text` holds. Before a tree is built the text is checked from end to end.
/// Throws: InvalidRequest{malformed_json} with the pointer of the place where the text is not
///         JSON (RFC 8259) or not taken: nested deeper than limits.json_depth, a member name twice
///         in one object, a number that no double holds (1e999, 1e-999), bytes that are not UTF-8,
///         NaN, comments.
nlohmann::json parse_json(std::string_view text, const Limits& limits);

/// `key` as the next step of a pointer in a URI fragment: "/" and "~" become "~1" and "~0", then
/// what a fragment cannot hold is percent-encoded (RFC 6901 sections 3 and 6, RFC 3986 3.5).
std::string pointer_step(std::string_view key);

/// Whether `value` is this string: without the temporary that comparing with == makes.
bool is_word(const nlohmann::json& value, std::string_view word);

/// The text of `value`, no spaces; bytes that are not UTF-8 become U+FFFD. Doubles are written
/// with the fewest digits (at most 17) that give the same double.
std::string json_text(const nlohmann::json& value);
std::string json_text(const nlohmann::ordered_json& value);

}  // namespace fstop::api
