#pragma once

#include <cstdint>

namespace fstop {

constexpr std::uint32_t reversed(std::uint32_t v) noexcept {
  v = ((v >> 1) & 0x55555555U) | ((v & 0x55555555U) << 1);
  v = ((v >> 2) & 0x33333333U) | ((v & 0x33333333U) << 2);
  v = ((v >> 4) & 0x0f0f0f0fU) | ((v & 0x0f0f0f0fU) << 4);
  v = ((v >> 8) & 0x00ff00ffU) | ((v & 0x00ff00ffU) << 8);
  return (v >> 16) | (v << 16);
}

/// Flips each bit by a hash of the bits below it: an Owen scramble of a bit-reversed fraction.
/// Source: Laine & Karras 2011 as improved by Burley 2020, constants by Vegdahl 2021.
constexpr std::uint32_t scrambled(std::uint32_t v, std::uint32_t key) noexcept {
  v ^= v * 0x3d20adeaU;
  v += key;
  v *= (key >> 16) | 1U;
  v ^= v * 0x05526c56U;
  v ^= v * 0x53a22864U;
  return v;
}

constexpr std::uint32_t mixed(std::uint32_t v) noexcept {
  // Finaliser of MurmurHash3 (Appleby, public domain): every input bit reaches every output bit.
  v ^= v >> 16;
  v *= 0x85ebca6bU;
  v ^= v >> 13;
  v *= 0xc2b2ae35U;
  v ^= v >> 16;
  return v;
}

/// hash_of, for loops over lanes.
constexpr std::uint32_t hashed(std::uint32_t a, std::uint32_t b) noexcept {
  return mixed(mixed(a ^ 0x9e3779b9U) + b * 0x85157af5U);
}

}  // namespace fstop
