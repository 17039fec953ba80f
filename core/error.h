#pragma once

#include <stdexcept>
#include <string>

namespace fstop {

/// Why something was refused or failed: a closed set, mapped to statuses in api/problem.cpp.
enum class ErrorCode {
  outside_domain,   ///< a value lies where the model does not hold
  invalid_request,  ///< the request's form is wrong (api::InvalidRequest has the list)
  malformed_json,   ///< the bytes are not JSON
  not_found,        ///< a named scene, render or file does not exist
  bad_geometry,     ///< a mesh is truncated, has bad indices or non-finite vertices
  bad_image,        ///< a texture cannot be decoded or is too large
  bad_path,         ///< an asset name leaves its folder
  over_budget,      ///< more work or memory than is allowed
  no_valid_method,  ///< no render method covers the shot
  cancelled,        ///< stopped by the client or by shutdown
  unsupported,      ///< a legal request for something this build does not do
  io_failure,       ///< reading or writing failed
  internal          ///< a broken invariant
};

/// A refusal or failure. The message names the quantity, its limits and its unit.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ErrorCode code() const noexcept { return code_; }

 private:
  ErrorCode code_;
};

}  // namespace fstop
