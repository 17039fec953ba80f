#pragma once

#include <cstdint>
#include <vector>

#include "core/film/image.h"

namespace fstop {

/// The samples of `image`, clipped to [0,1] and sRGB-encoded in 8 bits, round(255 encode(x)):
///
///     encode(x) = 12.92 x for x <= 0.0031308, else 1.055 x^(1/2.4) - 0.055
///
/// NaN becomes 0. Exact at every float: no sample differs from the formula's. `channels` is the
/// image's (of four the last, alpha, is only rounded: round(255 x)), or for a single channel any
/// number of copies of it. Source: IEC 61966-2-1:1999.
std::vector<std::uint8_t> srgb_bytes(const Image& image, int channels);

}  // namespace fstop
