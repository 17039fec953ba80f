#include "core/encode/srgb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace fstop {
namespace {

// The sRGB code of a linear value in [0,1], round(255 encode(x)): codes change at 255 thresholds,
// which lie at least 1/(255 * 12.92) = 3.0e-4 apart, so a bucket of width 1/4096 = 2.4e-4 holds at
// most one. A look-up and a comparison give what the formula gives, at any float.
class SrgbCodes {
 public:
  SrgbCodes() {
    threshold_.fill(std::numeric_limits<float>::infinity());
    for (int code = 1; code <= 255; ++code) {
      const float first = first_value_of(code);
      const auto bucket = static_cast<std::size_t>(first * kBuckets);
      threshold_[bucket] = first;
      for (std::size_t i = bucket + 1; i <= kBuckets; ++i)
        base_[i] = static_cast<std::uint8_t>(code);
    }
  }

  std::uint8_t operator()(float linear) const noexcept {
    // Written so that NaN, which no comparison holds for, becomes 0.
    const float x = linear > 0.0F ? std::min(linear, 1.0F) : 0.0F;
    const auto bucket = static_cast<std::size_t>(x * kBuckets);  // exact: a power of two
    return static_cast<std::uint8_t>(base_[bucket] + (x >= threshold_[bucket] ? 1 : 0));
  }

 private:
  static constexpr int kBuckets = 4096;

  static int rounded_code(float linear) {
    const double x = linear;
    const double encoded = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055;
    return static_cast<int>(std::floor(255.0 * encoded + 0.5));
  }
  // The least float with this code: near the inverse of the formula, then exactly.
  static float first_value_of(int code) {
    const double encoded = (code - 0.5) / 255.0;
    auto x = static_cast<float>(encoded <= 0.04045 ? encoded / 12.92
                                                   : std::pow((encoded + 0.055) / 1.055, 2.4));
    while (rounded_code(x) >= code) x = std::nextafter(x, 0.0F);
    while (rounded_code(x) < code) x = std::nextafter(x, 1.0F);
    return x;
  }

  std::array<float, kBuckets + 1> threshold_ = {};
  std::array<std::uint8_t, kBuckets + 1> base_ = {};
};

std::uint8_t linear_code(float x) {
  const float share = x > 0.0F ? std::min(x, 1.0F) : 0.0F;  // NaN becomes 0
  return static_cast<std::uint8_t>(std::floor(255.0 * double{share} + 0.5));
}

}  // namespace

std::vector<std::uint8_t> srgb_bytes(const Image& image, int channels) {
  static const SrgbCodes kCodes;
  const std::vector<float>& samples = image.pixels();
  std::vector<std::uint8_t> bytes;
  if (channels == image.channels()) {
    bytes.resize(samples.size());
    std::transform(samples.begin(), samples.end(), bytes.begin(),
                   [&](float x) { return kCodes(x); });
    if (channels == 4) {
      for (std::size_t i = 3; i < samples.size(); i += 4) bytes[i] = linear_code(samples[i]);
    }
    return bytes;
  }
  const auto copies = static_cast<std::size_t>(channels);
  bytes.resize(samples.size() * copies);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    std::fill_n(bytes.data() + i * copies, copies, kCodes(samples[i]));
  }
  return bytes;
}

}  // namespace fstop
