#pragma once

#include <cstddef>
#include <cstdint>

namespace fstop::test {

/// A seeded generator: the same choices in every run, on every machine.
/// Source: Knuth, MMIX (multiplier and increment).
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}

  std::uint32_t below(std::size_t bound) {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<std::uint32_t>((state_ >> 33U) % bound);
  }
  bool one_in(std::uint32_t count) { return below(count) == 0; }
  double unit() { return below(std::size_t{1} << 31U) / 2147483647.0; }  // both ends belong to it

 private:
  std::uint64_t state_;
};

}  // namespace fstop::test
