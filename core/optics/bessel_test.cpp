#include "core/optics/bessel.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace fstop {
namespace {

// Bessel's own integral, J_n(x) = mean over a turn of cos(n t - x sin t); the midpoint rule is
// exact once the nodes outnumber the orders that matter.
long double bessel_integral(int order, long double x) {
  const int count = static_cast<int>(std::abs(x)) + order + 150 +
                    static_cast<int>(25.0L * std::cbrt(std::abs(x)));
  long double sum = 0.0L;
  for (int i = 0; i < count; ++i) {
    const long double t =
        (static_cast<long double>(i) + 0.5L) * 2.0L * std::numbers::pi_v<long double> / count;
    sum += std::cos(static_cast<long double>(order) * t - x * std::sin(t));
  }
  return sum / count;
}

// A unit or two of 2^-52 of the largest value, 1.
constexpr double kTolerance = 5e-16;

TEST(Bessel, Orders0And1FollowBesselsIntegral) {
  for (double x = 1e-9; x < 3000.0; x = 1.01 * x + (x > 1.0 ? 0.01 : 0.0)) {
    const BesselPair pair = bessel_j0_j1(x);
    EXPECT_NEAR(pair.j0, static_cast<double>(bessel_integral(0, x)), kTolerance) << x;
    EXPECT_NEAR(pair.j1, static_cast<double>(bessel_integral(1, x)), kTolerance) << x;
  }
}

TEST(Bessel, OrdersFollowBesselsIntegral) {
  for (const double x : {0.0, 1e-9, 0.3, 2.0, 11.0, 24.9, 25.1, 63.0, 200.0}) {
    for (const std::size_t count :
         {std::size_t{1}, std::size_t{2}, std::size_t{24}, std::size_t{90}, std::size_t{400}}) {
      std::vector<double> orders(count);
      bessel_j(x, orders);
      for (std::size_t n = 0; n < count; n += 1 + count / 12) {
        const auto truth = static_cast<double>(bessel_integral(static_cast<int>(n), x));
        EXPECT_NEAR(orders[n], truth, 1e-15) << "n " << n << ", x " << x << ", of " << count;
      }
      std::vector<double> mirrored(count);
      bessel_j(-x, mirrored);
      for (std::size_t n = 0; n < count; ++n) {
        EXPECT_EQ(mirrored[n], n % 2 == 0 ? orders[n] : -orders[n]);
      }
    }
  }
}

TEST(Bessel, JincIsOneAtZeroAndEven) {
  EXPECT_EQ(jinc(0.0), 1.0);
  for (const double x : {1e-12, 0.99e-8, 1.01e-8, 0.1, 7.0, 300.0}) {
    EXPECT_EQ(jinc(-x), jinc(x));
    const auto truth = static_cast<double>(2.0L * bessel_integral(1, x) / x);
    EXPECT_NEAR(jinc(x), x < 1e-6 ? 1.0 : truth, 1e-15);
  }
}

TEST(Bessel, IsFiniteAtTheEnds) {
  for (const double x : {std::numeric_limits<double>::denorm_min(), 1e-300, 1e20, 1e299, 1e301,
                         std::numeric_limits<double>::max()}) {
    EXPECT_TRUE(std::isfinite(bessel_j0_j1(x).j0) && std::isfinite(bessel_j0_j1(-x).j1)) << x;
  }
}

TEST(Bessel, NegligibleOrderIsNegligible) {
  for (const double x : {1e-4, 0.3, 1.0, 5.0, 20.0, 24.9}) {
    // The first term of the ascending series bounds J_n for n > x^2/4.
    const int n = bessel_negligible_order(x);
    EXPECT_LT(n * std::log(0.5 * x) - std::lgamma(n + 1.0), std::log(1e-17)) << x;
  }
}

}  // namespace
}  // namespace fstop
