#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "core/sampling/sequence.h"

namespace fstop {
namespace {

// Both are the same word, once with 32 and once with its upper 24 bits: cut, never rounded.
TEST(LaneSequence, IsTheUpper24BitsOfTheSequence) {
  std::mt19937 random(17);
  for (const std::uint32_t seed : {0U, 1U, 0xdeadbeefU}) {
    const SampleSequence sequence(seed);
    for (int dimension = 0; dimension < kDimensions; ++dimension) {
      const auto d = static_cast<Dimension>(dimension);
      SampleKeys keys;
      for (auto& pixel : keys.pixel) pixel = static_cast<std::uint32_t>(random());
      const LaneSequence lanes(sequence, d, keys.pixel);
      for (int i = 0; i < 300; ++i) {
        const auto index =
            i < 200 ? static_cast<std::uint32_t>(i) : static_cast<std::uint32_t>(random());
        keys.index.fill(index);
        LaneValues values = {};
        LaneFloats floats = {};
        sequence.fill(keys, d, values);
        lanes.fill(index, floats);
        for (std::size_t k = 0; k < kLanes; ++k) {
          ASSERT_EQ(static_cast<double>(floats[k]), std::floor(values[k] * 0x1p24) * 0x1p-24)
              << "dimension " << dimension << ", index " << index << ", lane " << k;
        }
      }
    }
  }
}

}  // namespace
}  // namespace fstop
