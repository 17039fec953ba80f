#pragma once

#include <string_view>

#include <boost/beast/core/string.hpp>

namespace fstop::server {

// The parts of header fields that are lists (RFC 9110 5.6).

/// Without blanks and tabs at both ends.
inline std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

/// Cuts off and returns what stands before the next `mark`, trimmed.
inline std::string_view next_part(std::string_view& list, char mark) {
  const std::size_t end = list.find(mark);
  const std::string_view part = list.substr(0, end);
  list = end == std::string_view::npos ? std::string_view() : list.substr(end + 1);
  return trimmed(part);
}

/// Whatever the case of ASCII letters.
inline bool equal(std::string_view a, std::string_view b) {
  return boost::beast::iequals({a.data(), a.size()}, {b.data(), b.size()});
}

}  // namespace fstop::server
