#include "core/study/image_baseline.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/study/student_t.h"

namespace fstop {
namespace {

constexpr int kWidth = 40;  // not a multiple of a block: those at the rim are smaller
constexpr int kHeight = 32;
constexpr int kBlocks = 3 * 2;

// Independent normal noise of a standard deviation that varies over the picture.
Image noisy_picture(std::mt19937& random, double factor = 1.0, bool grey = false) {
  std::normal_distribution<double> normal(0.0, 1.0);
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double size = 0.005 * (1.0 + x / 10.0);
      for (int c = 0; c < 3; ++c) {
        image.at(x, y)[c] = grey && c > 0
                                ? image.at(x, y)[0]
                                : static_cast<float>(factor * 0.5 + size * normal(random));
      }
    }
  }
  return image;
}

ImageBaseline noisy_baseline(std::mt19937& random, int replicates, bool grey = false) {
  BaselineBuilder builder;
  for (int i = 0; i < replicates; ++i) builder.add(noisy_picture(random, 1.0, grey));
  return builder.finish();
}

// Abramowitz & Stegun 1964, table 26.10; one degree of freedom is Cauchy's distribution.
TEST(StudentT, HasTheTablesValues) {
  EXPECT_NEAR(student_t_threshold(0.05, 15), 2.131, 5e-4);
  EXPECT_NEAR(student_t_threshold(0.01, 15), 2.947, 5e-4);
  EXPECT_NEAR(student_t_threshold(0.001, 15), 4.073, 5e-4);
  EXPECT_NEAR(student_t_threshold(0.05, 3), 3.182, 5e-4);
  for (const double t : {0.1, 1.0, 30.0}) {
    EXPECT_NEAR(student_t_tail(t, 1.0), 1.0 - 2.0 / std::acos(-1.0) * std::atan(t), 1e-12);
  }
  EXPECT_NEAR(student_t_tail(student_t_threshold(1e-9, 15), 15) / 1e-9, 1.0, 1e-8);
  EXPECT_THROW(student_t_threshold(0.0, 15), Error);
}

// Each trial has a baseline of its own, so that trials are independent. Of n trials a rate p shows
// within 3.3 sqrt(p (1 - p) n): 1 in 1000 beyond. Four replicates alone: then a normal threshold in
// Student's place, or s without the root of 1 + 1/n, shows at once. Pixels' variances are no less
// than their neighbours': they alarm falsely less often.
TEST(ImageBaseline, AlarmsFalselyAsOftenAsItSays) {
  constexpr int kTrials = 3000;
  constexpr double kRate = 0.15;
  const double each = 1.0 - std::cbrt(1.0 - kRate);
  std::mt19937 random(1);
  int blocks = 0, whole = 0, pixels = 0, all = 0;
  for (int i = 0; i < kTrials; ++i) {
    const ImageBaseline baseline = noisy_baseline(random, 4);
    const BaselineVerdict verdict = compared(noisy_picture(random), baseline, kRate);
    pixels += verdict.levels[0].alarms > 0 ? 1 : 0;
    blocks += verdict.levels[1].alarms > 0 ? 1 : 0;
    whole += verdict.levels[2].alarms > 0 ? 1 : 0;
    all += verdict.differs() ? 1 : 0;
    ASSERT_EQ(verdict.levels[0].tests, 3 * kWidth * kHeight);
    ASSERT_EQ(verdict.levels[1].tests, 3 * kBlocks);
    ASSERT_EQ(verdict.levels[2].tests, 3);
  }
  const double scatter = 3.3 * std::sqrt(each * (1.0 - each) * kTrials);
  std::printf("false alarms of %d: pixel %d, block %d, picture %d, any %d; said %.0f, any %.0f\n",
              kTrials, pixels, blocks, whole, all, each * kTrials, kRate * kTrials);
  EXPECT_NEAR(blocks, each * kTrials, scatter);
  EXPECT_NEAR(whole, each * kTrials, scatter);
  EXPECT_LT(pixels, each * kTrials + scatter);
  EXPECT_LT(all, kRate * kTrials + 3.3 * std::sqrt(kRate * (1.0 - kRate) * kTrials));
}

// A change of 1 % of 0.5 is 0.005: the whole picture's mean has a standard deviation of 0.015 /
// sqrt(1280), 0.0004, so its z is 11; a single pixel's is below 1.
TEST(ImageBaseline, FindsOnePercentWhereItStandsOutOfTheNoise) {
  std::mt19937 random(2);
  const ImageBaseline baseline = noisy_baseline(random, 16);
  const BaselineVerdict brighter = compared(noisy_picture(random, 1.01), baseline, 0.01);
  EXPECT_TRUE(brighter.differs());
  EXPECT_GT(brighter.levels[2].alarms, 0);
  EXPECT_NEAR(brighter.brightness[1], 1.01, 0.003);
  EXPECT_FALSE(compared(noisy_picture(random), baseline, 0.01).differs());
}

TEST(ImageBaseline, FindsOneWrongPixelAndOneWrongBlock) {
  std::mt19937 random(3);
  const ImageBaseline baseline = noisy_baseline(random, 16);
  Image pixel = noisy_picture(random);
  pixel.at(7, 5)[2] += 0.3F;
  const BaselineVerdict one = compared(pixel, baseline, 0.01);
  EXPECT_EQ(one.levels[0].alarms, 1);
  EXPECT_EQ(one.levels[0].x, 7);
  EXPECT_EQ(one.levels[0].y, 5);
  EXPECT_EQ(one.levels[0].channel, 2);
  Image block = noisy_picture(random);
  for (int y = 16; y < 32; ++y) {
    for (int x = 16; x < 32; ++x) block.at(x, y)[0] += 0.012F;  // half of a pixel's noise
  }
  const BaselineVerdict other = compared(block, baseline, 0.01);
  EXPECT_EQ(other.levels[0].alarms, 0);
  EXPECT_EQ(other.levels[1].alarms, 1);
  EXPECT_EQ(other.levels[1].x, 16);
  EXPECT_EQ(other.levels[1].y, 16);
}

// One sample in a hundred pictures' pixel is a highlight, 30 times the noise: a pixel's own
// replicates seldom tell, its neighbourhood's do.
TEST(ImageBaseline, RareHighlightsAreNoChange) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto picture = [&] {
    Image image = noisy_picture(random);
    for (float& value : image.pixels()) value += unit(random) < 0.01 ? 0.45F : 0.0F;
    return image;
  };
  int alarms = 0;
  for (int i = 0; i < 50; ++i) {
    BaselineBuilder builder;
    for (int k = 0; k < 16; ++k) builder.add(picture());
    alarms += compared(picture(), builder.finish(), 0.01).levels[0].alarms > 0 ? 1 : 0;
  }
  EXPECT_EQ(alarms, 0);
}

TEST(ImageBaseline, GreyChannelsAreOneTest) {
  std::mt19937 random(4);
  const ImageBaseline baseline = noisy_baseline(random, 8, true);
  const BaselineVerdict grey = compared(noisy_picture(random, 1.0, true), baseline, 0.01);
  EXPECT_EQ(grey.levels[1].tests, kBlocks);
  Image tinted = noisy_picture(random, 1.0, true);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) tinted.at(x, y)[1] *= 1.02F;
  }
  EXPECT_TRUE(compared(tinted, baseline, 0.01).differs());
}

// What has no noise is compared to rounding: one unit of the last place is none.
TEST(ImageBaseline, PicturesWithoutNoiseAreComparedToRounding) {
  Image flat(kWidth, kHeight, 3);
  for (float& value : flat.pixels()) value = 0.7F;
  BaselineBuilder builder;
  for (int i = 0; i < 4; ++i) builder.add(flat);
  const ImageBaseline baseline = builder.finish();
  Image rounded = flat;
  rounded.at(3, 3)[0] = std::nextafter(0.7F, 1.0F);
  EXPECT_FALSE(compared(rounded, baseline, 0.01).differs());
  rounded.at(3, 3)[0] = 0.7001F;
  EXPECT_TRUE(compared(rounded, baseline, 0.01).differs());
}

TEST(ImageBaseline, RefusesWhatCannotBeCompared) {
  std::mt19937 random(5);
  const ImageBaseline baseline = noisy_baseline(random, 4);
  EXPECT_THROW(compared(Image(kWidth, kHeight + 1, 3), baseline, 0.01), Error);
  EXPECT_THROW(compared(noisy_picture(random), baseline, 0.0), Error);
  BaselineBuilder builder;
  EXPECT_THROW(builder.finish(), Error);
  Image broken = noisy_picture(random);
  broken.at(0, 0)[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(builder.add(broken), Error);
  builder.add(noisy_picture(random));
  EXPECT_THROW(builder.finish(), Error);
  EXPECT_THROW(builder.add(Image(kWidth, kHeight, 1)), Error);
}

}  // namespace
}  // namespace fstop
