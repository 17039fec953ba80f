#pragma once

#include <string>
#include <string_view>

#include "server/http_message.h"

namespace fstop::server {

/// The files below one folder, as replies. Only regular files are given out; hidden names, links
/// and whatever else could lead outside are not followed.
class StaticFiles {
 public:
  /// `root` empty: there are none.
  explicit StaticFiles(std::string root) : root_(std::move(root)) {}

  /// `path`: of the request, still percent-encoded; "/" is index.html.
  /// Throws: Refusal 400 for a malformed path, 404 where no file is.
  Reply reply(const Request& request, std::string_view path) const;

 private:
  std::string root_;
};

/// `text` with its %XX turned into bytes, once. Throws: Refusal 400 for half an escape or a NUL.
std::string percent_decoded(std::string_view text);

}  // namespace fstop::server
