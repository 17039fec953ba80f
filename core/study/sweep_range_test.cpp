#include "core/study/sweep_range.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A few roundings of the largest value.
constexpr double kRoundings = 8 * std::numeric_limits<double>::epsilon();

void expect_values(const SweepRange& range, const std::vector<double>& expected) {
  ASSERT_EQ(objection(range), "");
  EXPECT_EQ(value_count(range), static_cast<double>(expected.size()));
  const std::vector<double> values = values_of(range);
  ASSERT_EQ(values.size(), expected.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isinf(expected[i])) {
      EXPECT_EQ(values[i], expected[i]) << i;
    } else {
      EXPECT_NEAR(values[i], expected[i], kRoundings * std::abs(expected[i])) << i;
    }
  }
}

TEST(SweepRange, WholeNumbersStayWhole) {
  for (int count = 2; count <= 200; ++count) {
    const auto values = values_of({.from = 1.0, .to = static_cast<double>(count), .count = count});
    for (int i = 0; i < count; ++i)
      EXPECT_EQ(values[static_cast<std::size_t>(i)], i + 1.0) << "of " << count;
  }
}

TEST(SweepRange, LinearByCountAndByStep) {
  expect_values({.from = 1.0, .to = 2.0, .count = 5}, {1.0, 1.25, 1.5, 1.75, 2.0});
  expect_values({.from = 2.0, .to = -2.0, .count = 3}, {2.0, 0.0, -2.0});
  expect_values({.from = 3.0, .to = 9.0, .count = 1}, {3.0});
  expect_values({.from = 1.0, .to = 2.0, .step = 0.3}, {1.0, 1.3, 1.6, 1.9});
  expect_values({.from = 1.0, .to = 0.5, .step = -0.25}, {1.0, 0.75, 0.5});
  // 0.1 is no binary number: three of them end at 0.30000000000000004, which is 0.3.
  expect_values({.from = 0.0, .to = 0.3, .step = 0.1}, {0.0, 0.1, 0.2, 0.3});
}

TEST(SweepRange, EndsAreMetExactlyByCount) {
  for (const Spacing spacing : {Spacing::linear, Spacing::log, Spacing::reciprocal}) {
    const auto values = values_of({.from = 0.3, .to = 7.7, .count = 13, .spacing = spacing});
    EXPECT_EQ(values.front(), 0.3);
    EXPECT_EQ(values.back(), 7.7);
  }
}

TEST(SweepRange, LogHasEqualRatios) {
  expect_values({.from = 1.0, .to = 16.0, .count = 5, .spacing = Spacing::log},
                {1.0, 2.0, 4.0, 8.0, 16.0});
  expect_values({.from = 8.0, .to = 1.0, .step = 0.5, .spacing = Spacing::log},
                {8.0, 4.0, 2.0, 1.0});
}

// Equal steps in dioptres: 1, 0.75, 0.5, 0.25, 0.
TEST(SweepRange, ReciprocalHasEqualDioptresUpToInfinity) {
  expect_values({.from = 1.0, .to = kInfinity, .count = 5, .spacing = Spacing::reciprocal},
                {1.0, 4.0 / 3.0, 2.0, 4.0, kInfinity});
}

// Nominal f-numbers, as lenses are engraved, stand for 2^(n/6) (ISO 517:2008).
TEST(SweepRange, ThirdStopsAreTheTrueFNumbers) {
  std::vector<double> full;
  for (const int n : {3, 4, 5, 6}) full.push_back(std::pow(2.0, n / 6.0));
  expect_values({.from = 1.4, .to = 2.0, .spacing = Spacing::third_stop}, full);
  expect_values({.from = 5.6, .to = 22.0, .step = 6.0, .spacing = Spacing::third_stop},
                {std::sqrt(32.0), std::sqrt(128.0), std::sqrt(512.0)});
  expect_values({.from = 8.0, .to = 5.6, .spacing = Spacing::third_stop},
                {8.0, std::pow(2.0, 17.0 / 6.0), std::pow(2.0, 16.0 / 6.0), std::sqrt(32.0)});
  const double nominal[] = {1.0,  1.1,  1.2,  1.4,  1.6,  1.8,  2.0,  2.2,  2.5, 2.8,  3.2,
                            3.5,  4.0,  4.5,  5.0,  5.6,  6.3,  7.1,  8.0,  9.0, 10.0, 11.0,
                            13.0, 14.0, 16.0, 18.0, 20.0, 22.0, 25.0, 29.0, 32.0};
  const auto all = values_of({.from = 1.0, .to = 32.0, .spacing = Spacing::third_stop});
  ASSERT_EQ(all.size(), std::size(nominal));
  for (std::size_t i = 0; i < all.size(); ++i) {
    const SweepRange one{.from = nominal[i], .to = nominal[i], .spacing = Spacing::third_stop};
    EXPECT_EQ(values_of(one).front(), all[i]) << nominal[i];
  }
}

TEST(SweepRange, RefusesWhatHasNoValues) {
  const Spacing log = Spacing::log;
  const Spacing stops = Spacing::third_stop;
  for (const SweepRange& wrong : std::initializer_list<SweepRange>{
           {.from = 1.0, .to = 2.0},
           {.from = 1.0, .to = 2.0, .count = 2, .step = 1.0},
           {.from = 1.0, .to = 2.0, .count = 0},
           {.from = 1.0, .to = 2.0, .step = 0.0},
           {.from = 1.0, .to = 2.0, .step = -0.1},
           {.from = 1.0, .to = kInfinity, .count = 3},
           {.from = 0.0, .to = 2.0, .count = 3, .spacing = log},
           {.from = 1.0, .to = 2.0, .step = 1.0, .spacing = log},
           {.from = 1.0, .to = 2.0, .step = 0.5, .spacing = log},
           {.from = 1.0, .to = 2.0, .step = -2.0, .spacing = log},
           {.from = -1.0, .to = 2.0, .count = 3, .spacing = Spacing::reciprocal},
           {.from = 1.0, .to = 2.0, .step = 1.0, .spacing = Spacing::reciprocal},
           {.from = 1.0, .to = 2.0, .count = 3, .spacing = stops},
           {.from = 1.0, .to = 2.0, .step = 0.5, .spacing = stops},
           {.from = 0.0, .to = 2.0, .spacing = stops}}) {
    EXPECT_NE(objection(wrong), "");
    EXPECT_THROW(values_of(wrong), Error);
  }
}

TEST(SweepRange, CountsBeforeItAllocates) {
  EXPECT_GT(value_count({.from = 0.0, .to = 1e18, .step = 1e-300}), 1e299);
  EXPECT_NEAR(value_count({.from = 0.0, .to = 1e12, .step = 1.0}), 1e12, 2.0);
}

}  // namespace
}  // namespace fstop
