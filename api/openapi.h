#pragma once

#include <string_view>

namespace fstop::api {

/// The text of api/openapi.json, part of the program.
std::string_view openapi_json();

}  // namespace fstop::api
