#include "api/length_unit.h"

#include <random>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop::api {
namespace {

TEST(LengthUnit, IsReadFromTheEndOfAName) {
  EXPECT_EQ(unit_of_suffix("focus_distance_m").symbol, "m");
  EXPECT_EQ(unit_of_suffix("focal_length_mm").symbol, "mm");
  EXPECT_EQ(unit_of_suffix("airy_diameter_um").symbol, "um");
  EXPECT_EQ(unit_of_suffix("wavelength_nm").symbol, "nm");
  EXPECT_THROW(unit_of_suffix("f_number"), Error);
}

TEST(LengthUnit, ConvertsToTheLastBit) {
  EXPECT_EQ(unit_of_suffix("_mm").length(35.0), 0.035_m);
  EXPECT_EQ(unit_of_suffix("_nm").length(550.0), 550.0_nm);
  EXPECT_EQ(unit_of_suffix("_m").length(INFINITY), kInfinitelyFar);
}

// A decimal of 15 digits lies 5e-16 from its neighbours' midpoints, relatively; the quotient and
// the product are off by 1.1e-16 each. So every such number comes back as it went in.
TEST(LengthUnit, GivesBackDecimalsAsTheyWentIn) {
  std::mt19937_64 random(7);
  for (const char* suffix : {"_m", "_mm", "_um", "_nm"}) {
    const LengthUnit& unit = unit_of_suffix(suffix);
    for (int i = 0; i < 20'000; ++i) {
      const double number = static_cast<double>(random() % 1'000'000'000) / 1e4;
      ASSERT_EQ(unit.number(unit.length(number)), number) << suffix;
    }
    EXPECT_EQ(unit.number(kInfinitelyFar), INFINITY);
    EXPECT_EQ(unit.number(-kInfinitelyFar), -INFINITY);
  }
}

TEST(LengthUnit, NamesLimitsWithTheirUnit) {
  EXPECT_EQ(unit_of_suffix("_mm").text(2.0_m), "2000 mm");
  EXPECT_EQ(unit_of_suffix("_m").text(kInfinitelyFar), "infinity");
  EXPECT_EQ(number_text(0.01), "0.01");
  EXPECT_EQ(number_text(-1e7), "-10000000");
}

}  // namespace
}  // namespace fstop::api
