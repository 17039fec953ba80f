#include "core/optics/quadrature.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

// A rule of n nodes integrates t^k over [-1, 1] exactly up to k = 2n - 1; rounding of the sum.
TEST(GaussLegendre, IntegratesPolynomialsExactly) {
  for (const int count : {1, 2, 3, 7, 16, 33, 100, 316, 2000}) {
    const QuadratureRule rule = gauss_legendre(count);
    for (const int power : {0, 1, 2, 5, 14, 2 * count - 2, 2 * count - 1}) {
      if (power < 0 || power >= 2 * count) continue;
      double sum = 0.0;
      for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
        sum += rule.weights[i] * std::pow(rule.nodes[i], power);
      }
      EXPECT_NEAR(sum, power % 2 == 0 ? 2.0 / (power + 1) : 0.0, 2e-14) << count << " " << power;
    }
    EXPECT_TRUE(std::is_sorted(rule.nodes.begin(), rule.nodes.end()));
  }
}

TEST(GaussLegendre, RefusesImpossibleCounts) {
  EXPECT_THROW(gauss_legendre(0), Error);
  EXPECT_THROW(gauss_legendre(-3), Error);
  EXPECT_THROW(gauss_legendre(100001), Error);
}

TEST(Gauss16, HasTheNodesOfTheRule) {
  const QuadratureRule rule = gauss_legendre(16);
  for (std::size_t i = 0; i < kGauss16Nodes.size(); ++i) {
    EXPECT_NEAR(kGauss16Nodes[i], rule.nodes[8 + i], 1e-15);
    EXPECT_NEAR(kGauss16Weights[i], rule.weights[8 + i], 1e-15);
  }
}

TEST(Gauss16, MeetsItsStatedErrorForOscillations) {
  const auto wave = [](double t) { return std::complex<double>(std::cos(t), std::sin(t)); };
  const auto exact = [&](double end) { return (wave(end) - 1.0) / std::complex<double>(0.0, 1.0); };
  EXPECT_LT(std::abs(gauss16(0.0, 6.283, wave) - exact(6.283)), 1e-15);
  EXPECT_LT(std::abs(gauss16(0.0, 10.0, wave) - exact(10.0)), 1e-13);
}

}  // namespace
}  // namespace fstop
