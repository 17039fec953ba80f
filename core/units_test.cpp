#include "core/units.h"

#include <cmath>
#include <limits>
#include <type_traits>

#include <gtest/gtest.h>

namespace fstop {
namespace {

template <typename A, typename B>
concept Addable = requires(A a, B b) {
  a + b;
};
template <typename A, typename B>
concept Comparable = requires(A a, B b) {
  a < b;
};

// What must not compile: a sum or comparison of different dimensions, a bare number as a length.
static_assert(Addable<Length, Length>);
static_assert(!Addable<Length, Area>);
static_assert(!Addable<Length, Vergence>);
static_assert(!Addable<Length, double>);
static_assert(!Comparable<Length, double>);
static_assert(!Comparable<Length, Area>);
static_assert(!std::is_convertible_v<double, Length>);
static_assert(!std::is_convertible_v<Length, double>);

static_assert(std::is_same_v<decltype(Length{} * Length{}), Area>);
static_assert(std::is_same_v<decltype(Area{} / Length{}), Length>);
static_assert(std::is_same_v<decltype(Length{} / Length{}), double>);
static_assert(std::is_same_v<decltype(1.0 / Length{}), Vergence>);
static_assert(std::is_same_v<decltype(Vergence{} * Length{}), double>);
static_assert(std::is_same_v<decltype(1.0 / Vergence{}), Length>);
static_assert(std::is_same_v<decltype(sqrt(Area{})), Length>);

// As cheap as a bare double.
static_assert(sizeof(Length) == sizeof(double));
static_assert(std::is_trivially_copyable_v<Length>);

// A whole number divided by 1000 is the double nearest to the quotient; times 0.001 it need not be.
TEST(Units, LiteralsEqualTheirMetresToTheLastBit) {
  EXPECT_EQ(35.0_mm, 0.035_m);
  EXPECT_EQ(9.0_mm, 0.009_m);
  EXPECT_EQ(18.0_mm, 0.018_m);
  EXPECT_EQ(5.0_um, 5e-6_m);
  EXPECT_EQ(15.0_um, 15e-6_m);
  EXPECT_EQ(550.0_nm, 550e-9_m);
  EXPECT_EQ(7.0_nm, 7e-9_m);
}

TEST(Units, ArithmeticIsThatOfTheNumbers) {
  EXPECT_EQ((2.0_m + 0.5_m).si(), 2.5);
  EXPECT_EQ((2.0_m - 0.5_m).si(), 1.5);
  EXPECT_EQ((-(2.0_m)).si(), -2.0);
  EXPECT_EQ((3.0 * 2.0_m).si(), 6.0);
  EXPECT_EQ((2.0_m * 3.0).si(), 6.0);
  EXPECT_EQ((2.0_m / 4.0).si(), 0.5);
  EXPECT_EQ((2.0_m * 3.0_m).si(), 6.0);
  EXPECT_EQ(3.0_m / 2.0_m, 1.5);
  EXPECT_EQ((1.0 / 4.0_m).si(), 0.25);
  EXPECT_EQ(sqrt(2.25_m * 1.0_m), 1.5_m);
  EXPECT_EQ(abs(-(2.0_m)), 2.0_m);
}

TEST(Units, CompoundAssignmentChangesInPlace) {
  Length length = 2.0_m;
  length += 1.0_m;
  EXPECT_EQ(length, 3.0_m);
  length -= 2.0_m;
  EXPECT_EQ(length, 1.0_m);
  length *= 6.0;
  EXPECT_EQ(length, 6.0_m);
  length /= 4.0;
  EXPECT_EQ(length, 1.5_m);
}

TEST(Units, InfinityIsALengthAndItsVergenceIsZero) {
  EXPECT_GT(kInfinitelyFar, 1e300_m);
  EXPECT_EQ((1.0 / kInfinitelyFar).si(), 0.0);
  EXPECT_EQ(1.0 / Vergence{}, kInfinitelyFar);
  EXPECT_FALSE(is_finite(kInfinitelyFar));
  EXPECT_TRUE(is_finite(1.0_mm));
}

TEST(Units, NotANumberComparesFalseEveryWay) {
  const Length nan = Length::si(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(nan > Length{});
  EXPECT_FALSE(nan < Length{});
  EXPECT_FALSE(nan >= Length{});
  EXPECT_FALSE(nan == nan);
  EXPECT_FALSE(is_finite(nan));
}

TEST(Units, LengthsStartAtZero) { EXPECT_EQ(Length{}.si(), 0.0); }

}  // namespace
}  // namespace fstop
