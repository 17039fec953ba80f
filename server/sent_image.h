#pragma once

#include <string>

#include "api/limits.h"
#include "api/measurement_request.h"
#include "server/log.h"

namespace fstop::server {

/// Reads pictures that clients send, by a process of its own that is locked in.
class SentImageReader {
 public:
  /// `program`: fstop itself. All outlive the reader.
  SentImageReader(std::string program, Log& log, const api::Limits& limits)
      : program_(std::move(program)), log_(log), limits_(limits) {}

  /// Linear RGB of the file `bytes`; `with_alpha`: and, where it has one, its alpha as a fourth
  /// channel, colours as they are stored. Takes up to 20 s. Throws: InvalidRequest{bad_image} with
  /// `pointer`.
  Image read(const std::string& bytes, ColorSpace color_space, bool with_alpha,
             const std::string& pointer);

 private:
  std::string program_;
  Log& log_;
  const api::Limits& limits_;
};

}  // namespace fstop::server
