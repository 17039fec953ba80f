#pragma once

#include "core/sampling/sequence.h"

namespace fstop {

/// Three coordinates of every lane, for one turn of its path.
struct StreamValues {
  LaneValues u = {};
  LaneValues v = {};
  LaneFloats chance = {};
};

/// Coordinates of the samples `keys` beside those of the sequence, from one of any number of
/// streams: a path takes another at each of its turns. A stream's points are nets like the
/// sequence's - any 2^k consecutive aligned indices of a pixel are one - but taken in an order of
/// the stream's own. Without that, two streams' coordinates would be scrambles of the same
/// numbers: each a function of the other, and no number of samples would show all pairs.
/// Source: nets padded by shuffles, Burley 2020, section 3.
void fill(const SampleSequence& sequence, const SampleKeys& keys, std::uint32_t stream,
          StreamValues& values) noexcept;

/// A permutation of all indices that takes aligned blocks of 2^k to aligned blocks of 2^k.
std::uint32_t shuffled(std::uint32_t index, std::uint32_t key) noexcept;

}  // namespace fstop
