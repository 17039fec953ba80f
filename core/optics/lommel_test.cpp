#include "core/optics/lommel.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/defocus_field.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

double relative_error(double v, double U, LommelSide side) {
  const std::complex<double> exact = defocus_field(v, U);
  return std::abs(lommel_field(v, U, side) - exact) / std::abs(exact);
}

// A third derivation of G, each series on its own side and both at the border.
TEST(Lommel, EachSeriesHoldsOnItsSide) {
  for (const double U : {0.5, 3.0, 12.5, 60.0, 200.0, 1000.0, -31.0}) {
    const double size = std::abs(U);
    const double tolerance = 1e-14 / std::min(1.0, size);
    for (const double share : {0.02, 0.3, 0.7, 0.99, 1.0}) {
      EXPECT_LE(std::abs(lommel_field(share * size, U, LommelSide::v_series) -
                         defocus_field(share * size, U)),
                tolerance)
          << U << " " << share;
      EXPECT_LE(std::abs(lommel_field(size / share, U, LommelSide::u_series) -
                         defocus_field(size / share, U)),
                tolerance)
          << U << " " << share;
    }
  }
}

// The map of where the U series fails. How much it loses depends on the digits of its J_n; that it
// loses, and that the V series does not, is the method's own.
TEST(Lommel, FailsOnTheWrongSideAsTheMapSays) {
  const nlohmann::json table = oracle::fixture("maps/numerics");
  ASSERT_FALSE(table.at("lommel_wrong_side").empty());
  for (const nlohmann::json& row : table.at("lommel_wrong_side")) {
    const double U = row.at("U");
    const double v = row.at("v");
    const double right = relative_error(v, U, LommelSide::v_series);
    EXPECT_LT(right, 1e-13) << row.dump();
    if (oracle::number(row.at("relerr_U_series")) > 1e-8) {
      EXPECT_GT(relative_error(v, U, LommelSide::u_series), 1e6 * right) << row.dump();
    }
    if (U >= 200.0) {
      EXPECT_GT(relative_error(v, U, LommelSide::u_series), 1e10) << row.dump();
    }
  }
}

TEST(Lommel, RefusesWhereASeriesHasNoMeaning) {
  for (const auto side : {LommelSide::u_series, LommelSide::v_series}) {
    EXPECT_THROW(lommel_field(0.0, 1.0, side), Error);
    EXPECT_THROW(lommel_field(1.0, 0.0, side), Error);
    EXPECT_THROW(lommel_field(std::nan(""), 1.0, side), Error);
    EXPECT_THROW(lommel_field(1.0, 2e4, side), Error);
  }
}

}  // namespace
}  // namespace fstop
