#include "api/picture.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop::api {
namespace {

Image filled(int channels, float value) {
  Image image(4, 3, channels);
  for (float& pixel : image.pixels()) pixel = value;
  return image;
}

Photograph photograph() {
  Photograph photo;
  photo.color = filled(3, 0.5F);
  photo.layers[Output::depth] = filled(1, std::numeric_limits<float>::infinity());
  photo.layers[Output::coc] = filled(1, -7.5F);
  photo.layers[Output::normal] = filled(3, 0.25F);
  photo.layers[Output::variance] = filled(3, 1e-4F);
  photo.layers[Output::all_in_focus] = filled(3, 0.75F);
  photo.layers[Output::distance] = filled(1, 3.0F);
  photo.layers[Output::coc_diameter] = filled(1, 67.5F);
  photo.layers[Output::valid] = filled(1, 1.0F);
  return photo;
}

SimulationSpec spec() {
  SimulationSpec result;
  result.camera.position = {0.1, 2, -3};
  result.camera.sensor_height = 27.0_mm;
  result.camera.optics =
      LensSpec{.lens = {.focal_length = 85.0_mm, .f_number = 2.8}, .focus_distance = 3.0_m};
  result.camera.shutter_seconds = 0.008;
  result.width = 4;
  result.height = 3;
  result.seed = 4294967295U;
  return result;
}

const ImageAttribute* attribute(const Picture& picture, std::string_view name) {
  const auto found = std::ranges::find(picture.attributes, name, &ImageAttribute::name);
  return found == picture.attributes.end() ? nullptr : &*found;
}

double number(const Picture& picture, std::string_view name) {
  const ImageAttribute* found = attribute(picture, name);
  return found == nullptr ? -1.0 : std::get<double>(found->value);
}

std::vector<std::string> channels(const Picture& picture) {
  std::vector<std::string> names;
  for (const ImageLayer& layer : picture.layers) {
    EXPECT_EQ(static_cast<int>(layer.channel_names.size()), layer.image.channels());
    names.insert(names.end(), layer.channel_names.begin(), layer.channel_names.end());
  }
  return names;
}

TEST(Picture, NamesChannelsAsTheContractDoes) {
  const std::vector<std::string> expected = {
      "R",         "G",     "B",     "Z",   "coc.signed", "aif.R", "aif.G",    "aif.B",
      "var.R",     "var.G", "var.B", "N.X", "N.Y",        "N.Z",   "dist.ray", "coc.diameter",
      "mask.valid"};
  EXPECT_EQ(channels(picture_of(photograph(), spec(), "id", ImageFormat::exr)), expected);
}

// EXR: colours multiplied, then A; the others straight colours and A; JPEG has no place for it.
TEST(Picture, HoldsAlphaAsTheFormatDoes) {
  Photograph photo = photograph();
  photo.color = filled(3, 0.25F);
  photo.layers[Output::alpha] = filled(1, 0.5F);
  const Picture exr = picture_of(photo, spec(), "id", ImageFormat::exr);
  const std::vector<std::string> names = channels(exr);
  EXPECT_EQ((std::vector(names.begin(), names.begin() + 4)),
            (std::vector<std::string>{"R", "G", "B", "A"}));
  EXPECT_EQ(names.size(), 18U);  // all of them and A
  EXPECT_EQ(exr.layers.front().image, filled(3, 0.25F));
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::webp, ImageFormat::tiff}) {
    const Image first = picture_of(photo, spec(), "id", format).layers.front().image;
    ASSERT_EQ(first.channels(), 4);
    EXPECT_EQ(first.at(0, 0)[0], 0.5F);
    EXPECT_EQ(first.at(0, 0)[3], 0.5F);
  }
  EXPECT_THROW(picture_of(photo, spec(), "id", ImageFormat::jpeg), Error);
}

TEST(Picture, StatesTheCamera) {
  const Picture picture = picture_of(photograph(), spec(), "0123", ImageFormat::exr);
  EXPECT_EQ(number(picture, "aperture"), 2.8);
  EXPECT_EQ(number(picture, "focus"), 3.0);
  EXPECT_EQ(number(picture, "expTime"), 0.008);
  EXPECT_EQ(number(picture, "nominalFocalLength"), 85.0);
  // 1/v = 1/85 - 1/3000 per mm.
  EXPECT_NEAR(number(picture, "pinholeFocalLength"), 85.0 * 3000.0 / 2915.0, 1e-9);
  EXPECT_EQ(number(picture, "sensorPhotositePitch"), 9000.0);  // 36 mm over 4 pixels, in microns
  EXPECT_EQ(number(picture, "fstop:sensorWidthMm"), 36.0);
  EXPECT_EQ(number(picture, "fstop:wavelengthNm"), 550.0);
  EXPECT_EQ(std::get<int>(attribute(picture, "fstop:breathing")->value), 1);
  EXPECT_EQ(std::get<std::string>(attribute(picture, "fstop:requestHash")->value), "0123");
  EXPECT_EQ(std::get<std::string>(attribute(picture, "fstop:seed")->value), "4294967295");
  EXPECT_EQ(std::get<std::string>(attribute(picture, "fstop:cameraPosition")->value), "0.1 2 -3");
}

TEST(Picture, StatesAPinholesHole) {
  SimulationSpec hole = spec();
  hole.camera.optics = PinholeSpec{.image_distance = 50.0_mm, .diameter = 0.25_mm};
  const Picture picture = picture_of(photograph(), hole, "id", ImageFormat::exr);
  EXPECT_EQ(number(picture, "aperture"), 200.0);
  EXPECT_EQ(number(picture, "fstop:pinholeDiameterMm"), 0.25);
  EXPECT_EQ(number(picture, "pinholeFocalLength"), 50.0);
  EXPECT_EQ(attribute(picture, "focus"), nullptr);
}

TEST(Picture, NeedsDepthAndBlurForExrAlone) {
  EXPECT_EQ(layers_needed(ImageFormat::png, {Output::normal}),
            (std::vector{Output::color, Output::normal}));
  EXPECT_EQ(layers_needed(ImageFormat::exr, {Output::color, Output::coc}),
            (std::vector{Output::color, Output::depth, Output::coc}));
}

TEST(Picture, ShowsOneOutputAlone) {
  const Picture depth = output_picture(photograph(), Output::depth, spec(), "id");
  EXPECT_EQ(channels(depth), std::vector<std::string>{"Z"});
  EXPECT_EQ(channels(output_picture(photograph(), Output::color, spec(), "id")).size(), 3U);
  Photograph bare;
  bare.color = filled(3, 0.0F);
  EXPECT_THROW(output_picture(bare, Output::depth, spec(), "id"), Error);
}

TEST(Picture, SurvivesAnExrFile) {
  const Picture picture = picture_of(photograph(), spec(), "0123", ImageFormat::exr);
  const std::vector<std::byte> bytes = encode(picture, ImageFormat::exr);
  EXPECT_EQ(encode(picture, ImageFormat::exr), bytes);
  const Picture read = decode(bytes);
  std::vector<std::string> names = channels(read);
  std::vector<std::string> expected = channels(picture);
  std::ranges::sort(names);
  std::ranges::sort(expected);
  EXPECT_EQ(names, expected);
  EXPECT_FLOAT_EQ(static_cast<float>(number(read, "aperture")), 2.8F);
  EXPECT_EQ(number(read, "focus"), 3.0);
  EXPECT_FLOAT_EQ(static_cast<float>(number(read, "expTime")), 0.008F);
  EXPECT_EQ(number(read, "nominalFocalLength"), 85.0);
  EXPECT_EQ(number(read, "sensorPhotositePitch"), 9000.0);
  EXPECT_EQ(std::get<std::string>(attribute(read, "fstop:requestHash")->value), "0123");
  EXPECT_EQ(std::get<std::string>(attribute(read, "fstop:seed")->value), "4294967295");
}

}  // namespace
}  // namespace fstop::api
