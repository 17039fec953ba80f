#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "api/chart_photograph.h"

namespace fstop::server {

/// Where the pictures of a verification come from.
struct PictureSourceOptions {
  std::string server = {};  // URL; empty: this program
  std::string token_file = {};
  std::string scenes_dir = {};  // of this program; empty: the bundled scenes
  int threads = 0;              // of this program
};

/// Makes the finished picture of a render request that asks for EXR; `folder`: what files in it are
/// relative to, where this program renders.
///
/// A server is asked by POST /v1/renders and, where that answers 202, by its job until that is
/// done; it is asked again after Retry-After where it is busy, for ten minutes in all. Throws: as
/// api::picture_here; of a server: Error{unsupported} with what a refusal (4xx) says, or
///         a job that failed; Error{io_failure} where it cannot be reached, does not take the token
///         or stays busy.
using PictureSource = std::function<Image(std::string_view request, const std::string& folder)>;

/// Throws: Error{invalid_request} for a URL or a token file that is none.
PictureSource picture_source(const PictureSourceOptions& options);

/// "this program", or the server's URL.
std::string source_name(const PictureSourceOptions& options);

}  // namespace fstop::server
