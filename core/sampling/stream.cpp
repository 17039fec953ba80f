#include "core/sampling/stream.h"

#include "core/sampling/scramble.h"

namespace fstop {

std::uint32_t shuffled(std::uint32_t index, std::uint32_t key) noexcept {
  // Higher bits decide over lower ones, as digits of a fraction do in an Owen scramble.
  return reversed(scrambled(reversed(index), key));
}

void fill(const SampleSequence& sequence, const SampleKeys& keys, std::uint32_t stream,
          StreamValues& values) noexcept {
  SampleKeys own;
  for (std::size_t k = 0; k < kLanes; ++k) {
    own.pixel[k] = hash_of(keys.pixel[k], stream);
    own.index[k] = shuffled(keys.index[k], hash_of(own.pixel[k], stream));
    values.chance[k] = sequence.decision(own.pixel[k], own.index[k]);
  }
  sequence.fill(own, Dimension::light_u, values.u);
  sequence.fill(own, Dimension::light_v, values.v);
}

}  // namespace fstop
