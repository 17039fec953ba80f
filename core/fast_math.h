#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "core/simd.h"

namespace fstop {

/// log2(x) for normal x > 0, to 2e-7 of the larger of |log2 x| and 1: the series of
/// 2 artanh((m - 1)/(m + 1)) for the mantissa m in [sqrt(1/2), sqrt 2). No branches and no calls,
/// so that loops over lanes vectorise and every C library gives the same bits.
FSTOP_KERNEL float fast_log2(float x) noexcept {
  const auto bits = std::bit_cast<std::int32_t>(x);
  // The exponent that leaves a mantissa in [0.7071, 1.4142).
  const std::int32_t exponent = (bits - 0x3f3504f3) >> 23;
  const auto m = std::bit_cast<float>(bits - (exponent << 23));
  const float t = (m - 1.0F) / (m + 1.0F);
  const float q = t * t;
  // 2/ln 2 times 1, 1/3, 1/5, 1/7, 1/9; the first term left out is below 2e-9.
  const float series =
      t * (2.88539008F +
           q * (0.961796694F + q * (0.577078016F + q * (0.412198583F + q * 0.320598898F))));
  return static_cast<float>(exponent) + series;
}

/// 2^x for x in [-126, 126], relative error below 3e-7; clamped beyond.
FSTOP_KERNEL float fast_exp2(float x) noexcept {
  x = x < -126.0F ? -126.0F : (x > 126.0F ? 126.0F : x);
  const float whole = std::floor(x + 0.5F);
  const float y = (x - whole) * 0.693147181F;  // |y| <= 0.3466: y^8/8! < 6e-9
  const float series =
      1.0F +
      y * (1.0F +
           y * (0.5F + y * (1.0F / 6 +
                            y * (1.0F / 24 + y * (1.0F / 120 + y * (1.0F / 720 + y / 5040.0F))))));
  return series * std::bit_cast<float>((static_cast<std::int32_t>(whole) + 127) << 23);
}

/// x^n for x in [0, 1] and n >= 0, as shading needs it: error below 3e-6 for n up to 10, and as
/// much as one rounding of x makes beyond. 0^0 = 1.
FSTOP_KERNEL float fast_power(float x, float n) noexcept {
  const float safe = x > 1e-37F ? x : 1e-37F;
  const float result = fast_exp2(n * fast_log2(safe));
  return x > 0.0F || n == 0.0F ? result : 0.0F;
}

/// atan2(y, x) for finite arguments, to 3e-7 radians; 0 at the origin, pi for y = 0 and x < 0
/// whatever the sign of y. Source: Moshier's Cephes library, atanf.
FSTOP_KERNEL float fast_atan2(float y, float x) noexcept {
  const float across = std::abs(x);
  const float up = std::abs(y);
  const float larger = across > up ? across : up;
  const float smaller = across > up ? up : across;
  const float t = smaller / (larger > 0.0F ? larger : 1.0F);
  // Beyond tan(pi/8): atan t = pi/4 + atan((t - 1)/(t + 1)).
  const bool far = t > 0.41421356F;
  const float w = far ? (t - 1.0F) / (t + 1.0F) : t;
  const float q = w * w;
  const float series =
      w + w * q *
              (-3.33329491539e-1F +
               q * (1.99777106478e-1F + q * (-1.38776856032e-1F + q * 8.05374449538e-2F)));
  const float octant = far ? 0.78539816F + series : series;
  const float quadrant = up > across ? 1.57079633F - octant : octant;
  const float half = x < 0.0F ? 3.14159265F - quadrant : quadrant;
  return y < 0.0F ? -half : half;
}

}  // namespace fstop
