#pragma once

#include <optional>

#include "api/json_reader.h"
#include "api/limits.h"
#include "core/post/halftone.h"

namespace fstop::api {

/// The member "halftone" of an image of `width` x `height` pixels; absent: nothing, and it has no
/// part in the normal form. Faults go to the readers' list.
std::optional<HalftoneSpec> read_halftone(ObjectReader& image, int width, int height,
                                          const Limits& limits);

}  // namespace fstop::api
