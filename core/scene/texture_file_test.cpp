#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/scene/handmade_files.h"
#include "core/scene/image_header.h"
#include "core/scene/scene_file.h"

namespace fstop {
namespace {

using handmade::Bytes;
using handmade::bytes_of;
using handmade::PngColor;
using handmade::Writer;

constexpr AssetLimits kLimits{.max_file_bytes = 1 << 20,
                              .max_triangles = 100,
                              .max_texture_pixels = 10'000,
                              .max_coordinate = 1e7};

Bytes row(const std::vector<std::uint8_t>& samples) { return Writer().put_all(samples).bytes(); }

Image texture(const Bytes& bytes, ColorSpace space = ColorSpace::srgb) {
  return decode_texture("t.png", bytes, space, kLimits);
}

void expect_bad(const Bytes& bytes, const std::string& part, const AssetLimits& limits = kLimits) {
  try {
    decode_texture("t.png", bytes, ColorSpace::srgb, limits);
    ADD_FAILURE() << "no error: " << part;
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(error.code(), ErrorCode::bad_image) << message;
    EXPECT_TRUE(message.starts_with("t.png: ")) << message;
    EXPECT_NE(message.find(part), std::string::npos) << message << "\nhas no: " << part;
  }
}

// Linear values of 8-bit sRGB codes, by hand from IEC 61966-2-1 to seven digits:
// 10/255/12.92; ((c/255 + 0.055)/1.055)^2.4. A float has as many digits: relative 1.2e-7.
struct KnownValue {
  std::uint8_t code;
  double linear;
};
constexpr std::array<KnownValue, 6> kKnown = {{{0, 0.0},
                                               {10, 0.003035270},
                                               {11, 0.003346536},
                                               {128, 0.2158605},
                                               {188, 0.5028865},
                                               {255, 1.0}}};

void expect_known(const Image& image, std::size_t repeats) {
  ASSERT_EQ(image.pixels().size(), kKnown.size() * repeats);
  for (std::size_t i = 0; i < image.pixels().size(); ++i) {
    const KnownValue& known = kKnown[i / repeats];
    EXPECT_NEAR(double{image.pixels()[i]}, known.linear, 2e-7 * known.linear) << int{known.code};
  }
}

TEST(TextureFile, MakesSrgbLinear) {
  Writer grey;
  Writer rgb;
  Writer grey_alpha;
  Writer rgb_alpha;
  std::uint8_t alpha = 0;  // dropped, never multiplied with, not even 0
  for (const KnownValue& known : kKnown) {
    grey.put(known.code);
    rgb.put(known.code).put(known.code).put(known.code);
    grey_alpha.put(known.code).put(alpha);
    rgb_alpha.put(known.code).put(known.code).put(known.code).put(alpha);
    alpha = static_cast<std::uint8_t>(alpha + 50);
  }
  expect_known(texture(handmade::png(6, 8, PngColor::grey, {grey.bytes()})), 3);
  expect_known(texture(handmade::png(6, 8, PngColor::rgb, {rgb.bytes()})), 3);
  expect_known(texture(handmade::png(6, 8, PngColor::grey_alpha, {grey_alpha.bytes()})), 3);
  expect_known(texture(handmade::png(6, 8, PngColor::rgb_alpha, {rgb_alpha.bytes()})), 3);
}

TEST(TextureFile, KeepsLinearCodesLinear) {
  const Image image =
      texture(handmade::png(3, 8, PngColor::grey, {row({0, 51, 255})}), ColorSpace::linear);
  const std::vector<float> wanted = {0, 0, 0, 0.2F, 0.2F, 0.2F, 1, 1, 1};
  EXPECT_EQ(image.pixels(), wanted);
}

TEST(TextureFile, KeepsRowsColumnsAndChannels) {
  const Image image =
      texture(handmade::png(2, 8, PngColor::rgb,
                            {row({255, 0, 51, 0, 255, 51}), row({51, 0, 255, 0, 0, 0})}),
              ColorSpace::linear);
  EXPECT_EQ(image.width(), 2);
  EXPECT_EQ(image.height(), 2);
  EXPECT_EQ(image.channels(), 3);
  EXPECT_EQ(image.pixels(), (std::vector<float>{1, 0, 0.2F, 0, 1, 0.2F, 0.2F, 0, 1, 0, 0, 0}));
}

// 0x3333 = 65535/5. Palette entries 1 and 0; four grey levels in 2 bits, 01 is a third.
TEST(TextureFile, ReadsOtherDepthsAndPalettes) {
  const Image deep =
      texture(handmade::png(2, 16, PngColor::rgb,
                            {row({0x33, 0x33, 0xff, 0xff, 0, 0, 0, 0, 0, 0, 0x33, 0x33})}),
              ColorSpace::linear);
  EXPECT_EQ(deep.pixels(), (std::vector<float>{0.2F, 1, 0, 0, 0, 0.2F}));
  const Bytes palette = row({255, 0, 0, 0, 51, 255});
  const Image indexed =
      texture(handmade::png(2, 8, PngColor::palette, {row({1, 0})}, {{"PLTE", palette}}),
              ColorSpace::linear);
  EXPECT_EQ(indexed.pixels(), (std::vector<float>{0, 0.2F, 1, 1, 0, 0}));
  const Image two_bits =
      texture(handmade::png(4, 2, PngColor::grey, {row({0b00011011})}), ColorSpace::linear);
  const float third = 1.0F / 3.0F;
  EXPECT_EQ(two_bits.pixels(), (std::vector<float>{0, 0, 0, third, third, third, 2 * third,
                                                   2 * third, 2 * third, 1, 1, 1}));
}

// The only coefficient is exact (handmade_files.h), so every pixel is: code 188.
TEST(TextureFile, ReadsJpeg) {
  for (const bool color : {false, true}) {
    const Image image = texture(handmade::jpeg(188, color));
    EXPECT_EQ(image.width(), 8);
    EXPECT_EQ(image.height(), 8);
    ASSERT_EQ(image.pixels().size(), 192U);
    for (const float sample : image.pixels()) EXPECT_NEAR(double{sample}, 0.5028865, 1e-7);
  }
}

TEST(TextureFile, ReadsExrAsLinear) {
  const Bytes rgb = handmade::exr(
      2, 2,
      {{"B", {3, 6, 9, 12}}, {"G", {2, 5, 8, 11}}, {"R", {1, 4, 7, 10}}, {"Z", {0, 0, 0, 0}}});
  for (const ColorSpace space : {ColorSpace::srgb, ColorSpace::linear}) {
    const Image image = texture(rgb, space);
    EXPECT_EQ(image.width(), 2);
    EXPECT_EQ(image.height(), 2);
    EXPECT_EQ(image.pixels(), (std::vector<float>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
  }
  const std::vector<float> grey = {-0.5F, -0.5F, -0.5F, 1e6F, 1e6F, 1e6F};
  EXPECT_EQ(texture(handmade::exr(2, 1, {{"Y", {-0.5F, 1e6F}}})).pixels(), grey);
  EXPECT_EQ(texture(handmade::exr(2, 1, {{"A", {1, 1}}, {"Y", {-0.5F, 1e6F}}})).pixels(), grey);
  EXPECT_EQ(texture(handmade::exr(2, 1, {{"star", {-0.5F, 1e6F}}})).pixels(), grey);
  expect_bad(handmade::exr(1, 1, {{"G", {1}}, {"R", {1}}}), "neither R, G, B nor Y");
}

TEST(TextureFile, RefusesSamplesThatAreNotFinite) {
  const float infinity = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  expect_bad(handmade::exr(2, 2, {{"Y", {1, 2, 3, nan}}}), "not finite at column 1, row 1");
  expect_bad(handmade::exr(2, 2, {{"Y", {1, 2, -infinity, 1}}}), "not finite at column 0, row 1");
}

// Text that does not inflate, a profile that is none, Exif that is noise: never looked at.
TEST(TextureFile, PassesOverMetadata) {
  const Bytes noise = bytes_of(std::string("icc\0\0not deflated at all, far from it", 37));
  const Bytes png =
      handmade::png(2, 8, PngColor::grey, {row({0, 255})},
                    {{"iCCP", noise}, {"zTXt", noise}, {"tIME", noise}, {"eXIf", noise}});
  EXPECT_EQ(texture(png).pixels(), (std::vector<float>{0, 0, 0, 1, 1, 1}));
  EXPECT_EQ(without_metadata(image_header("t.png", png, 2), png),
            handmade::png(2, 8, PngColor::grey, {row({0, 255})}));
  Writer segments(true);
  segments.put(std::uint16_t{0xffe1})
      .put(std::uint16_t{20})
      .text(std::string("Exif\0\0\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff", 18));
  segments.put(std::uint16_t{0xfffe}).put(std::uint16_t{5}).text("abc");
  segments.text("\xff\xff").put(std::uint16_t{0xffe2}).put(std::uint16_t{2});
  EXPECT_EQ(texture(handmade::jpeg(188, true, segments.bytes())).pixels(),
            texture(handmade::jpeg(188, true)).pixels());
  const Bytes jpeg = handmade::jpeg(188, true, segments.bytes());
  EXPECT_EQ(without_metadata(image_header("t.jpg", jpeg, 64), jpeg), handmade::jpeg(188, true));
}

TEST(TextureFile, RecognisesFilesByTheirBytes) {
  const Bytes png = handmade::png(1, 8, PngColor::grey, {row({255})});
  EXPECT_NO_THROW(decode_texture("t.jpg", png, ColorSpace::srgb, kLimits));
  for (const char* other :
       {"", "BM\x36", "GIF89a", "II*", "#?RADIANCE\n", "P6 1 1 255 ", "RIFF1234WEBP"}) {
    expect_bad(bytes_of(other), "is no PNG, JPEG or EXR file");
  }
}

TEST(TextureFile, ChecksSizesBeforeDecoding) {
  AssetLimits limits = kLimits;
  const Bytes png = handmade::png(3, 8, PngColor::grey, {row({1, 2, 3}), row({4, 5, 6})});
  limits.max_texture_pixels = 6;
  EXPECT_NO_THROW(decode_texture("t.png", png, ColorSpace::srgb, limits));
  limits.max_texture_pixels = 5;
  expect_bad(png, "measures 3 x 2; the limits are 5 pixels", limits);
  limits = kLimits;
  limits.max_file_bytes = png.size() - 1;
  expect_bad(png, "bytes", limits);

  // Headers that promise 10^10 pixels and more, followed by nothing like it.
  limits = kLimits;
  limits.max_texture_pixels = std::size_t{1} << 40U;
  expect_bad(handmade::png(100'000, 8, PngColor::grey, {row({1})}), "measures 100000 x 1", limits);
  expect_bad(handmade::png(0, 8, PngColor::grey, {row({1})}), "measures 0 x 1", limits);
  Bytes jpeg = handmade::jpeg(188, false);
  const std::size_t frame = 2 + 69 + 5;  // after SOI, DQT, SOF's marker, length and precision
  for (std::size_t i = frame; i < frame + 4; ++i) jpeg[i] = std::byte{0xff};
  expect_bad(jpeg, "measures 65535 x 65535");
  jpeg[frame] = jpeg[frame + 1] = std::byte{0};
  expect_bad(jpeg, "measures 65535 x 0");
}

// The window's corners are int32: the widest window has a width of 2^32.
TEST(TextureFile, ChecksExrHeadersBeforeDecoding) {
  const auto with_window = [](const std::vector<std::int32_t>& window) {
    Bytes file = handmade::exr(2, 2, {{"Y", {1, 2, 3, 4}}});
    const std::string name("dataWindow\0box2i\0\x10\0\0\0", 21);
    const auto at = static_cast<std::size_t>(
        std::string_view(reinterpret_cast<const char*>(file.data()), file.size()).find(name));
    const Bytes values = Writer().put_all(window).bytes();
    std::copy(values.begin(), values.end(), file.begin() + static_cast<std::ptrdiff_t>(at + 21));
    return file;
  };
  constexpr std::int32_t kLow = std::numeric_limits<std::int32_t>::min();
  constexpr std::int32_t kHigh = std::numeric_limits<std::int32_t>::max();
  EXPECT_NO_THROW(texture(with_window({0, 0, 1, 1})));
  expect_bad(with_window({kLow, kLow, kHigh, kHigh}), "measures 4294967296 x 4294967296");
  expect_bad(with_window({0, 0, -1, -1}), "measures 0 x 0");
  expect_bad(with_window({0, 0, 0, 9'999}), "is truncated");  // its table of rows is too short
  AssetLimits wide = kLimits;
  wide.max_texture_pixels = 1 << 30U;
  expect_bad(with_window({0, 0, 65'536, 0}), "measures 65537 x 1", wide);

  std::vector<handmade::ExrChannel> channels;
  for (int i = 0; i < 2000; ++i) channels.push_back({std::to_string(10'000 + i), {1}});
  Bytes many = handmade::exr(1, 1, channels);
  EXPECT_EQ(many[4], std::byte{2});
  many[5] = std::byte{0x10};  // multi-part
  expect_bad(many, "deep or multi-part");
  many[5] = std::byte{0x08};  // deep
  expect_bad(many, "deep or multi-part");
  many[5] = std::byte{0x02};  // tiled, with no tiles
  expect_bad(many, "tiles are missing");
}

// OpenEXR takes memory for whole blocks of rows, of DWAB 256, however few rows there are:
// 65,536 columns * 256 rows * 4 bytes * 5 channels is more than 2^28.
TEST(TextureFile, ChecksExrBlocksBeforeDecoding) {
  std::vector<handmade::ExrChannel> channels;
  for (const char* name : {"A", "B", "G", "R", "Z"}) {
    channels.push_back({name, std::vector<float>(65'536)});
  }
  AssetLimits limits = kLimits;
  limits.max_file_bytes = 1U << 24U;
  limits.max_texture_pixels = 65'536;
  Bytes file = handmade::exr(65'536, 1, channels);
  EXPECT_NO_THROW(decode_texture("t.png", file, ColorSpace::linear, limits));
  const std::string name("compression\0compression\0\1\0\0\0", 28);
  const auto at = std::string_view(reinterpret_cast<const char*>(file.data()), 500).find(name);
  file[at + name.size()] = std::byte{9};
  expect_bad(file, "blocks or tiles are too large", limits);
  file[at + name.size()] = std::byte{10};
  expect_bad(file, "compression is unknown", limits);
}

TEST(TextureFile, RefusesTruncatedFiles) {
  const Bytes png = handmade::png(2, 8, PngColor::rgb, {row({1, 2, 3, 4, 5, 6})});
  const Bytes exr = handmade::exr(2, 2, {{"Y", {1, 2, 3, 4}}});
  for (const Bytes& whole : {png, exr}) {
    for (std::size_t size = 0; size < whole.size(); ++size) {
      expect_bad({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}, "");
    }
  }
  Bytes damaged = png;
  damaged[45] ^= std::byte{1};  // in the data, which the checksum covers
  expect_bad(damaged, "a checksum is wrong");
}

}  // namespace
}  // namespace fstop
