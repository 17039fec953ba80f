#include "core/fast_math.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <random>

#include <gtest/gtest.h>

namespace fstop {
namespace {

// Every exponent, mantissas spread over [1, 2) and close to where the series changes sides.
template <typename Visit>
void for_each_float(int least_exponent, int most_exponent, const Visit& visit) {
  std::mt19937 random(1);
  for (int exponent = least_exponent; exponent <= most_exponent; ++exponent) {
    for (int i = 0; i < 400; ++i) {
      const std::uint32_t mantissa = i < 4 ? 0x3504f1U + static_cast<std::uint32_t>(i)
                                           : static_cast<std::uint32_t>(random()) & 0x7fffffU;
      visit(std::bit_cast<float>(static_cast<std::uint32_t>(exponent + 127) << 23 | mantissa));
    }
    visit(std::ldexp(1.0F, exponent));
  }
}

TEST(FastLog2, IsAsCloseAsStatedForAllNormalNumbers) {
  for_each_float(-126, 127, [](float x) {
    const double exact = std::log2(static_cast<double>(x));
    ASSERT_NEAR(fast_log2(x), exact, 2e-7 * std::max(1.0, std::abs(exact))) << x;
  });
}

TEST(FastLog2, PowersOfTwoAreExact) {
  for (int exponent = -126; exponent <= 127; ++exponent) {
    EXPECT_EQ(fast_log2(std::ldexp(1.0F, exponent)), static_cast<float>(exponent));
  }
}

TEST(FastExp2, IsAsCloseAsStated) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> anywhere(-126.0F, 126.0F);
  for (int i = 0; i < 200000; ++i) {
    const float x = anywhere(random);
    const double exact = std::exp2(static_cast<double>(x));
    ASSERT_NEAR(fast_exp2(x) / exact, 1.0, 3e-7) << x;
  }
}

TEST(FastExp2, WholeNumbersAreExactAndTheRestIsClamped) {
  for (int n = -126; n <= 126; ++n) {
    EXPECT_EQ(fast_exp2(static_cast<float>(n)), std::ldexp(1.0F, n));
  }
  EXPECT_EQ(fast_exp2(-1e9F), std::ldexp(1.0F, -126));
  EXPECT_EQ(fast_exp2(1e9F), std::ldexp(1.0F, 126));
}

// One rounding of x changes x^n by n 2^-24 x^n: 6e-8 n, 1.5e-5 at the largest exponent here.
TEST(FastPower, IsAsCloseAsStated) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> base(0.0F, 1.0F);
  for (const float n : {0.5F, 1.0F, 2.0F, 8.0F, 10.0F, 90.0F, 256.0F}) {
    const double bound = n <= 10.0F ? 3e-6 : 1.2e-7 * static_cast<double>(n);
    for (int i = 0; i < 20000; ++i) {
      const float x = base(random);
      ASSERT_NEAR(fast_power(x, n), std::pow(static_cast<double>(x), static_cast<double>(n)), bound)
          << x << "^" << n;
    }
  }
}

TEST(FastPower, HasTheLimitsOfShading) {
  EXPECT_EQ(fast_power(0.0F, 0.0F), 1.0F);
  EXPECT_EQ(fast_power(0.5F, 0.0F), 1.0F);
  for (const float n : {1e-3F, 1.0F, 90.0F}) {
    EXPECT_EQ(fast_power(0.0F, n), 0.0F);
    EXPECT_EQ(fast_power(1.0F, n), 1.0F);
  }
}

TEST(FastAtan2, IsAsCloseAsStatedAllAround) {
  double worst = 0.0;
  for (int i = 0; i < 200000; ++i) {
    const double turn = (i + 0.5) / 200000 * 6.283185307179586;
    for (const double size : {1e-20, 1.0, 3e7}) {
      const auto y = static_cast<float>(size * std::sin(turn));
      const auto x = static_cast<float>(size * std::cos(turn));
      const double exact = std::atan2(double{y}, double{x});
      worst = std::max(worst, std::abs(double{fast_atan2(y, x)} - exact));
    }
  }
  EXPECT_LT(worst, 3e-7);
}

TEST(FastAtan2, HasItsAxesAndItsOrigin) {
  EXPECT_EQ(fast_atan2(0.0F, 0.0F), 0.0F);
  EXPECT_EQ(fast_atan2(0.0F, 1.0F), 0.0F);
  EXPECT_EQ(fast_atan2(1.0F, 0.0F), 1.57079633F);
  EXPECT_EQ(fast_atan2(-1.0F, 0.0F), -1.57079633F);
  EXPECT_EQ(fast_atan2(0.0F, -1.0F), 3.14159265F);
  EXPECT_EQ(fast_atan2(-0.0F, -1.0F), 3.14159265F);
}

// The same loops for both instruction sets, as kernels are built.
constexpr std::size_t kWide = 16;
using Floats = std::array<float, kWide>;

FSTOP_KERNEL void all_three(const Floats& x, float n, Floats& logs, Floats& powers) {
  for (std::size_t k = 0; k < kWide; ++k) {
    logs[k] = fast_log2(x[k]);
    powers[k] = fast_power(x[k], n) + fast_exp2(logs[k]);
  }
}
[[gnu::noinline]] void narrow(const Floats& x, float n, Floats& logs, Floats& powers) {
  all_three(x, n, logs, powers);
}
FSTOP_AVX512 [[gnu::noinline]] void wide(const Floats& x, float n, Floats& logs, Floats& powers) {
  all_three(x, n, logs, powers);
}

TEST(FastMath, HasTheSameBitsForBothInstructionSets) {
  if (!has_avx512()) GTEST_SKIP() << "this processor has no AVX-512";
  std::mt19937 random(4);
  std::uniform_real_distribution<float> base(1e-6F, 1.0F);
  for (int i = 0; i < 20000; ++i) {
    Floats x = {};
    for (float& value : x) value = base(random);
    const float n = static_cast<float>(i % 100) * 0.7F;
    Floats logs = {}, powers = {}, wide_logs = {}, wide_powers = {};
    narrow(x, n, logs, powers);
    wide(x, n, wide_logs, wide_powers);
    using Words = std::array<std::uint32_t, kWide>;
    ASSERT_EQ(std::bit_cast<Words>(logs), std::bit_cast<Words>(wide_logs));
    ASSERT_EQ(std::bit_cast<Words>(powers), std::bit_cast<Words>(wide_powers));
  }
}

}  // namespace
}  // namespace fstop
