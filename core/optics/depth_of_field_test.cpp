#include "core/optics/depth_of_field.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

const Length kNan = Length::si(std::numeric_limits<double>::quiet_NaN());
const ThinLens kPortrait{.focal_length = 85.0_mm, .f_number = 1.8};
constexpr Length kLimit = 0.03_mm;

struct Shot {
  ThinLens lens = {};
  Length focus = {};
  Length coc_limit = {};
};

Shot shot_of(const nlohmann::json& row) {
  return {.lens = {.focal_length = oracle::millimetres(row.at("f")), .f_number = row.at("N")},
          .focus = oracle::millimetres(row.at("focus_distance")),
          .coc_limit = oracle::millimetres(row.at("coc_limit"))};
}

double millimetres(Length length) { return length.si() * 1e3; }

// The fixture's own statement: 1e-12 relative.
TEST(DepthOfField, AgreesWithEveryRowOfTheFixture) {
  const nlohmann::json table = oracle::fixture("thinlens");
  for (const nlohmann::json& row : table.at("rows")) {
    const Shot shot = shot_of(row);
    const auto [near, far] = depth_of_field(shot.lens, shot.focus, shot.coc_limit);
    const Length hyperfocal = hyperfocal_distance(shot.lens, shot.coc_limit);
    const auto difference = [&](Length actual, const char* column) {
      return oracle::relative_difference(millimetres(actual), oracle::number(row.at(column)));
    };
    EXPECT_LE(difference(near, "near"), 1e-12) << row.dump();
    EXPECT_LE(difference(far, "far"), 1e-12) << row.dump();
    EXPECT_LE(difference(hyperfocal, "hyperfocal"), 1e-12) << row.dump();
  }
}

// What other calculators answer, H0 s/(H0 +- s) with H0 = f^2/(N c) and H s/(H +- (s - f)) with
// H = H0 + f, and how wrong they are: the near limits' relative errors follow from the exact one,
// H0 s/(H0 + s - f), as -f/(H0 + s) and f (s - f)/(H0 (H0 + s)); the far limits err the other way.
TEST(DepthOfField, LiesBetweenTheUsualApproximations) {
  const nlohmann::json table = oracle::fixture("thinlens");
  for (const nlohmann::json& row : table.at("rows")) {
    if (row.at("approximations").is_null()) continue;  // focused at infinity all agree
    const Shot shot = shot_of(row);
    const auto [near, far] = depth_of_field(shot.lens, shot.focus, shot.coc_limit);
    const auto& without_f = row.at("approximations").at("H0");
    const auto& with_f = row.at("approximations").at("H1f");
    const Length f = shot.lens.focal_length;
    const Length beyond = hyperfocal_distance(shot.lens, shot.coc_limit) - f;  // H0
    const double near_without = oracle::number(without_f.at(0)) / millimetres(near) - 1.0;
    const double near_with = oracle::number(with_f.at(0)) / millimetres(near) - 1.0;
    EXPECT_NEAR(near_without, -(f / (beyond + shot.focus)), 1e-12) << row.dump();
    EXPECT_NEAR(near_with, f / beyond * ((shot.focus - f) / (beyond + shot.focus)), 1e-12)
        << row.dump();
    const double far_without = oracle::number(without_f.at(1));
    const double far_with = oracle::number(with_f.at(1));
    EXPECT_GE(far_without, millimetres(far)) << row.dump();
    const bool all_infinite = std::isinf(far_with) && std::isinf(far.si());
    EXPECT_TRUE(all_infinite || far_with < millimetres(far)) << row.dump();
  }
}

// Calculators and books. Their rows carry our exact value beside the printed one; it has 16 digits
// and the far limit loses up to s/(H - s) of them, below 500 in these rows: 500 * 1e-15.
TEST(DepthOfField, AgreesWithPublishedRows) {
  const nlohmann::json table = oracle::fixture("published");
  int rows = 0;
  for (const nlohmann::json& row : table.at("rows")) {
    if (row.at("kind") != "dof") continue;
    ++rows;
    const ThinLens lens{.focal_length = oracle::millimetres(row.at("f_mm")),
                        .f_number = row.at("N")};
    const Length limit = oracle::millimetres(row.at("coc_mm"));
    const auto [near, far] = depth_of_field(lens, oracle::millimetres(row.at("subject_mm")), limit);
    const nlohmann::json& expected = row.at("oracle");
    const auto difference = [&](Length actual, const char* column) {
      return oracle::relative_difference(millimetres(actual), oracle::number(expected.at(column)));
    };
    EXPECT_LE(difference(near, "near"), 5e-13) << row.dump();
    EXPECT_LE(difference(far, "far"), 5e-13) << row.dump();
    if (expected.contains("hyperfocal")) {
      EXPECT_LE(difference(hyperfocal_distance(lens, limit), "hyperfocal"), 5e-13) << row.dump();
    }
    // The printed numbers: rounded to 1 mm at best, the Navy's slide rule to 0.4 %.
    EXPECT_TRUE(row.at("agrees").get<bool>());
    const nlohmann::json& printed = row.at("published");
    EXPECT_LE(oracle::relative_difference(millimetres(near), oracle::number(printed.at("near"))),
              4e-3);
    EXPECT_LE(oracle::relative_difference(millimetres(far), oracle::number(printed.at("far"))),
              4e-3);
  }
  EXPECT_EQ(rows, 16);
}

TEST(DepthOfField, FocusedAtTheHyperfocalDistanceReachesFromItsHalfToInfinity) {
  for (const double N : {1.4, 2.8, 5.6, 11.0, 22.0}) {
    for (const Length f : {4.2_mm, 24.0_mm, 50.0_mm, 200.0_mm}) {
      const ThinLens lens{.focal_length = f, .f_number = N};
      const Length hyperfocal = hyperfocal_distance(lens, kLimit);
      const auto [near, far] = depth_of_field(lens, hyperfocal, kLimit);
      EXPECT_EQ(far, kInfinitelyFar);
      EXPECT_NEAR(near / hyperfocal, 0.5, 1e-15);
    }
  }
}

TEST(DepthOfField, FarLeavesInfinityJustBelowTheHyperfocalDistance) {
  const Length hyperfocal = hyperfocal_distance(kPortrait, kLimit);
  const Length below = Length::si(std::nextafter(hyperfocal.si(), 0.0));
  const Length above = Length::si(std::nextafter(hyperfocal.si(), 1e9));
  EXPECT_EQ(depth_of_field(kPortrait, above, kLimit).far, kInfinitelyFar);
  const Length far = depth_of_field(kPortrait, below, kLimit).far;
  EXPECT_TRUE(is_finite(far));
  EXPECT_GT(far, hyperfocal * 1e14);
  EXPECT_NEAR(depth_of_field(kPortrait, above, kLimit).near / hyperfocal, 0.5, 1e-15);
}

TEST(DepthOfField, FocusedAtInfinityIsSharpFromTheHyperfocalDistance) {
  const auto [near, far] = depth_of_field(kPortrait, kInfinitelyFar, kLimit);
  const Length f = kPortrait.focal_length;
  EXPECT_NEAR(near / (hyperfocal_distance(kPortrait, kLimit) - f), 1.0, 1e-15);
  EXPECT_EQ(far, kInfinitelyFar);
}

// Sharpness shrinks to the focused plane, without a NaN even where f/c overflows.
TEST(DepthOfField, ShrinksToTheFocusedPlaneAsTheLimitVanishes) {
  for (const double limit : {1e-12, 1e-100, 1e-300, 1e-308, 5e-324}) {
    const auto [near, far] = depth_of_field(kPortrait, 2.0_m, Length::si(limit));
    // c/(A v) = 2e-10 dioptres at the first, nothing in double precision at the others.
    EXPECT_NEAR(near.si(), 2.0, limit < 1e-50 ? 0.0 : 1e-8) << limit;
    EXPECT_NEAR(far.si(), 2.0, limit < 1e-50 ? 0.0 : 1e-8) << limit;
  }
}

TEST(DepthOfField, GrowsToEverythingWithTheLimit) {
  const auto [near, far] = depth_of_field(kPortrait, 2.0_m, 1000.0_m);
  EXPECT_LT(near, 1.0_um * 200.0);
  EXPECT_EQ(far, kInfinitelyFar);
}

TEST(DepthOfField, RefusesWhatLiesOutsideItsDomain) {
  const auto refused = [](const ThinLens& lens, Length s, Length c) {
    try {
      depth_of_field(lens, s, c);
    } catch (const Error& error) {
      return error.code() == ErrorCode::outside_domain;
    }
    return false;
  };
  const double nan = kNan.si();
  for (const Length s : {Length{}, 85.0_mm, 10.0_mm, -(1.0_m), kNan}) {
    EXPECT_TRUE(refused(kPortrait, s, kLimit)) << s.si();
  }
  for (const Length c : {Length{}, -(0.03_mm), kNan}) {
    EXPECT_TRUE(refused(kPortrait, 2.0_m, c)) << c.si();
    EXPECT_THROW(hyperfocal_distance(kPortrait, c), Error);
  }
  for (const ThinLens lens : {ThinLens{}, ThinLens{0.0_mm, 2.0}, ThinLens{kNan, 2.0},
                              ThinLens{85.0_mm, 0.0}, ThinLens{85.0_mm, nan}}) {
    EXPECT_TRUE(refused(lens, 2.0_m, kLimit));
    EXPECT_THROW(hyperfocal_distance(lens, kLimit), Error);
  }
}

class RandomShots {
 public:
  Shot next() {
    const Length f = Length::si(log_uniform(1e-3, 2.0));
    return {.lens = {.focal_length = f, .f_number = log_uniform(0.5, 256.0)},
            .focus = uniform() < 0.1 ? kInfinitelyFar : f * (1.0 + log_uniform(1e-6, 1e6)),
            .coc_limit = Length::si(log_uniform(1e-7, 1e-3))};
  }

 private:
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  double log_uniform(double low, double high) { return low * std::pow(high / low, uniform()); }

  std::mt19937_64 random_{20240602};
};

TEST(DepthOfField, EnclosesTheFocusAndIsNeverNotANumber) {
  RandomShots shots;
  for (int i = 0; i < 100'000; ++i) {
    const auto [lens, s, c] = shots.next();
    const auto [near, far] = depth_of_field(lens, s, c);
    ASSERT_GT(near, Length{}) << "f " << lens.focal_length.si() << " N " << lens.f_number << " s "
                              << s.si() << " c " << c.si();
    ASSERT_LE(near, s);
    ASSERT_GE(far, s);
  }
}

// The disc at either limit has the diameter asked for: the defining property, by the other formula.
// Roundings of 2^-53 grow where close numbers are subtracted: the limit's own depth by
// s/(s - near) or far/(far - s), H0 = H - f by H/(H - f), the margin H - s by far/s.
TEST(DepthOfField, DiscAtEitherLimitHasTheLimitingDiameter) {
  RandomShots shots;
  for (int i = 0; i < 10'000; ++i) {
    const auto [lens, s, c] = shots.next();
    const auto [near, far] = depth_of_field(lens, s, c);
    const Length hyperfocal = hyperfocal_distance(lens, c);
    const double lost_reach = hyperfocal / (hyperfocal - lens.focal_length);
    const double lost_near = lost_reach + (is_finite(s) ? s / (s - near) : 1.0);
    ASSERT_NEAR(circle_of_confusion(lens, s, near) / c, 1.0, 2e-15 * (1.0 + lost_near));
    if (!is_finite(far)) continue;
    const double lost_far = lost_reach + far / (far - s) + far / s;
    ASSERT_NEAR(circle_of_confusion(lens, s, far) / c, 1.0, 2e-15 * (1.0 + lost_far));
  }
}

TEST(DepthOfField, GrowsWithTheFNumber) {
  for (const Length s : {0.2_m, 2.0_m, 50.0_m, kInfinitelyFar}) {
    DepthOfField last{.near = s, .far = s};
    for (double N = 0.5; N <= 256.0; N *= 1.1) {
      const DepthOfField range =
          depth_of_field({.focal_length = 85.0_mm, .f_number = N}, s, kLimit);
      EXPECT_LT(range.near, last.near) << "s " << s.si() << ", N " << N;
      EXPECT_TRUE(range.far > last.far || range.far == kInfinitelyFar) << "s " << s.si();
      last = range;
    }
  }
}

TEST(DepthOfField, ScalesWithAllItsLengths) {
  RandomShots shots;
  for (int i = 0; i < 10'000; ++i) {
    const auto [lens, s, c] = shots.next();
    const DepthOfField range = depth_of_field(lens, s, c);
    const double scale = 0x1p-9;  // rounds nothing
    const ThinLens small{.focal_length = lens.focal_length * scale, .f_number = lens.f_number};
    const DepthOfField scaled = depth_of_field(small, s * scale, c * scale);
    ASSERT_EQ(scaled.near, range.near * scale);
    ASSERT_EQ(scaled.far, range.far * scale);
  }
}

}  // namespace
}  // namespace fstop
