#include "core/sampling/stream.h"

#include "core/sampling/scramble.h"
#include "core/simd.h"

namespace fstop {
namespace {

// Higher bits decide over lower ones, as digits of a fraction do in an Owen scramble.
constexpr std::uint32_t in_own_order(std::uint32_t index, std::uint32_t key) noexcept {
  return reversed(scrambled(reversed(index), key));
}

FSTOP_KERNEL void fill_keys(const SampleKeys& keys, std::uint32_t stream, SampleKeys& own) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    own.pixel[k] = hashed(keys.pixel[k], stream);
    own.index[k] = in_own_order(keys.index[k], hashed(own.pixel[k], stream));
  }
}
FSTOP_AVX512 void fill_keys_wide(const SampleKeys& keys, std::uint32_t stream, SampleKeys& own) {
  fill_keys(keys, stream, own);
}

}  // namespace

std::uint32_t shuffled(std::uint32_t index, std::uint32_t key) noexcept {
  return in_own_order(index, key);
}

SampleKeys stream_keys(const SampleKeys& keys, std::uint32_t stream) noexcept {
  SampleKeys own;
  if (has_avx512()) {
    fill_keys_wide(keys, stream, own);
  } else {
    fill_keys(keys, stream, own);
  }
  return own;
}

}  // namespace fstop
