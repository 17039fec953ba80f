#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "api/limits.h"

namespace fstop::server {

struct StoredRender;

/// A finished render as the bytes of one file: a line with format and SHA-256 of what follows,
/// then texts with their lengths and the images' floats as this machine has them.
std::string result_bytes(const StoredRender& render);

/// The render that `bytes` hold; null where they are not whole, of another format or of another
/// id, or where `limits` forbid such a request now.
std::shared_ptr<StoredRender> result_of(std::string_view bytes, std::string_view id,
                                        const api::Limits& limits);

}  // namespace fstop::server
