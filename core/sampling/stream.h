#pragma once

#include "core/sampling/sequence.h"

namespace fstop {

/// Keys of the same samples in one of any number of streams beside the sequence's own: a path takes
/// another at each of its turns, and from it Dimension::light_u, light_v and
/// SampleSequence::decision. A stream's points are nets like the sequence's - any 2^k consecutive
/// aligned indices of a pixel are one - but taken in an order of the stream's own. Without that,
/// two streams' coordinates would be scrambles of the same numbers: each a function of the other,
/// and no number of samples would show all pairs.
/// Source: nets padded by shuffles, Burley 2020, section 3.
SampleKeys stream_keys(const SampleKeys& keys, std::uint32_t stream) noexcept;

/// A permutation of all indices that takes aligned blocks of 2^k to aligned blocks of 2^k.
std::uint32_t shuffled(std::uint32_t index, std::uint32_t key) noexcept;

}  // namespace fstop
