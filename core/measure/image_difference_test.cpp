#include "core/measure/image_difference.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

// 2 x 1 pixels of two channels; differences 0.5, 0, -1 and 2, the last from 0.5 to 2.5.
Image reference() {
  Image image(2, 1, 2);
  image.pixels() = {0.25F, 0.5F, 1.0F, 0.5F};
  return image;
}
Image picture() {
  Image image(2, 1, 2);
  image.pixels() = {0.75F, 0.5F, 0.0F, 2.5F};
  return image;
}

ImageDifference difference(const Image& image, const Image& wanted) {
  return image_difference(image.view(), wanted.view());
}

// By hand: sums 0.25 + 1 + 4 = 5.25 and, with 2.5 clipped to 1, 0.25 + 1 + 0.25 = 1.5; values are
// exact in float, so rounding is all there is.
TEST(ImageDifference, FiguresAreTheirDefinitions) {
  const ImageDifference d = difference(picture(), reference());
  EXPECT_NEAR(d.rmse, std::sqrt(5.25 / 4.0), 1e-15);
  EXPECT_NEAR(d.rmse_clipped, std::sqrt(1.5 / 4.0), 1e-15);
  EXPECT_NEAR(d.rel_mse, (0.25 / 0.0725 + 1.0 / 1.01 + 4.0 / 0.26) / 4.0, 1e-14);
  EXPECT_EQ(d.largest, 2.0);
  EXPECT_EQ(d.largest_x, 1);
  EXPECT_EQ(d.largest_y, 0);
  EXPECT_NEAR(d.psnr, 10.0 * std::log10(4.0 / 1.5), 1e-13);
}

TEST(ImageDifference, EqualPicturesHaveNone) {
  const ImageDifference d = difference(picture(), picture());
  EXPECT_EQ(d.rmse, 0.0);
  EXPECT_EQ(d.largest, 0.0);
  EXPECT_EQ(d.psnr, std::numeric_limits<double>::infinity());
}

// Views may lie inside larger pictures.
TEST(ImageDifference, RowStrideIsHonoured) {
  Image a(4, 3, 1), b(4, 3, 1);
  *a.at(3, 1) = 9.0F;  // outside the views below
  const ImageView<const float> left{a.pixels().data(), 2, 3, 1, 4};
  const ImageView<const float> right{b.pixels().data(), 2, 3, 1, 4};
  EXPECT_EQ(image_difference(left, right).rmse, 0.0);
  *a.at(1, 2) = 0.5F;
  EXPECT_NEAR(image_difference(left, right).rmse, 0.5 / std::sqrt(6.0), 1e-15);
}

TEST(ImageDifference, RefusesWhatCannotBeCompared) {
  EXPECT_THROW(difference(Image(2, 1, 1), reference()), Error);
  EXPECT_THROW(difference(Image(1, 2, 2), reference()), Error);
  EXPECT_THROW(difference(Image(), Image()), Error);
  Image broken = picture();
  broken.pixels()[2] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(difference(broken, reference()), Error);
  EXPECT_THROW(difference(reference(), broken), Error);
}

}  // namespace
}  // namespace fstop
