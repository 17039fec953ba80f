// What the error report promises over random scenes, cameras and targets: a small share of what
// `./dev bench calibration` measures.
#include "tests/methods/calibration.h"

#include <iostream>

#include <gtest/gtest.h>

namespace fstop {
namespace {

constexpr int kCases = 24;

const std::vector<CalibrationCase>& cases() {
  static const std::vector<CalibrationCase> all =
      calibrated(1, kCases, 1, {.all_methods = true, .noise_share = 0.2, .most_samples = 2048});
  return all;
}

TEST(Calibration, BoundsHoldAndTargetsAreMetWithoutWaste) {
  print_calibration(std::cout, cases());
  const CalibrationSummary s = summary_of(cases());
  ASSERT_GE(s.cases, 20) << "too few references are sharp enough to tell anything";
  for (const CalibrationCase& c : cases()) EXPECT_TRUE(c.chosen.finite) << "seed " << c.seed;
  // At least 95 % hold, at most 5 % pass the target. Of 24 cases at such a rate 4 or more fail with
  // a probability of 0.03, 5 or more with 0.006 (binomial): 4 are allowed.
  EXPECT_LE((1.0 - s.held) * s.cases, 4.1);
  EXPECT_LE(s.over_target * s.cases, 4.1);
  EXPECT_GE(s.median_ratio, 0.8);
  EXPECT_LE(s.median_ratio, 1.5);
  EXPECT_GE(s.mean_used, 0.5);
}

TEST(Calibration, PlannerTakesNearlyTheCheapestThatMeetsTheTarget) {
  print_choices(std::cout, cases());
  const ChoiceSummary s = choices_of(cases());
  ASSERT_GE(s.cases, 18);
  // 90 % are promised; of 24 at that rate 6 or more fail with a probability of 0.03, 7 with 0.008.
  EXPECT_LE((1.0 - s.good_by_rays) * s.cases, 6.1);
}

}  // namespace
}  // namespace fstop
