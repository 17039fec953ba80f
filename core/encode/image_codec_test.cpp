#include "core/encode/image_codec.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <thread>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr std::array kFormats = {ImageFormat::png, ImageFormat::jpeg, ImageFormat::webp,
                                 ImageFormat::tiff, ImageFormat::exr};

Image image_of(int width, int height, int channels, const std::vector<float>& samples) {
  Image image(width, height, channels);
  image.pixels() = samples;
  return image;
}

Picture grey_picture(const std::vector<float>& samples) {
  return {{{{"Y"}, image_of(static_cast<int>(samples.size()), 1, 1, samples)}}, {}};
}

// A small picture with every layer fstop writes; all samples differ.
Picture full_picture(int width, int height) {
  Picture picture;
  const std::vector<std::vector<std::string>> layers = {{"R", "G", "B"},
                                                        {"Z"},
                                                        {"coc.signed"},
                                                        {"N.X", "N.Y", "N.Z"},
                                                        {"var.R", "var.G", "var.B"},
                                                        {"aif.R", "aif.G", "aif.B"}};
  float next = -3.0F;
  for (const std::vector<std::string>& names : layers) {
    Image image(width, height, static_cast<int>(names.size()));
    for (float& sample : image.pixels()) sample = next += 0.001F;
    picture.layers.push_back({names, image});
  }
  picture.attributes = {{"aperture", 1.4},
                        {"focus", 2.5},
                        {"expTime", 0.008},
                        {"nominalFocalLength", 50.0},
                        {"fstop:seed", 42},
                        {"fstop:exact", 0.1},
                        {"fstop:engine", std::string("fstop 0.1")}};
  return picture;
}

std::map<std::string, std::vector<float>> channels_of(const Picture& picture) {
  std::map<std::string, std::vector<float>> channels;
  for (const ImageLayer& layer : picture.layers) {
    const std::vector<float>& samples = layer.image.pixels();
    for (std::size_t i = 0; i < samples.size(); ++i) {
      channels[layer.channel_names[i % layer.channel_names.size()]].push_back(samples[i]);
    }
  }
  return channels;
}

std::vector<int> codes_of(const std::vector<float>& samples, ImageFormat format) {
  const Picture back = decode(encode(grey_picture(samples), format));
  std::vector<int> codes;
  const std::vector<float>& pixels = back.layers.front().image.pixels();
  const auto step = static_cast<std::size_t>(back.layers.front().image.channels());
  for (std::size_t i = 0; i < pixels.size(); i += step) {
    codes.push_back(static_cast<int>(std::lround(pixels[i] * 255.0F)));
  }
  return codes;
}

bool contains(const std::vector<std::byte>& bytes, const std::string& text) {
  return std::search(bytes.begin(), bytes.end(), text.begin(), text.end(),
                     [](std::byte b, char c) { return b == std::byte(c); }) != bytes.end();
}

void expect_refused(const Picture& picture, ImageFormat format, ErrorCode code) {
  try {
    encode(picture, format);
    ADD_FAILURE() << "no error for " << format_name(format);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
  }
}

// By hand: 255 * 12.92 * 0.001 = 3.29; 255 (1.055 * 0.18^(1/2.4) - 0.055) = 117.65;
// 255 (1.055 * 0.5^(1/2.4) - 0.055) = 187.52; ends and non-finite samples as documented.
TEST(ImageCodec, EncodesSrgbByTheFormula) {
  const std::vector<float> linear = {0.0F, 0.001F, 0.18F,     0.5F,       1.0F,
                                     2.0F, -1.0F,  kInfinity, -kInfinity, kNan};
  const std::vector<int> codes = {0, 3, 118, 188, 255, 255, 0, 255, 0, 0};
  EXPECT_EQ(codes_of(linear, ImageFormat::png), codes);
  EXPECT_EQ(codes_of(linear, ImageFormat::webp), codes);
}

// A million floats across [0,1] and the 33 floats around each of the 255 places where the code
// changes, against the formula in long double. No tolerance: the codes are integers, and no float
// lies within the formula's rounding (1e-17) of a change.
TEST(ImageCodec, EncodesSrgbExactlyEverywhere) {
  const auto encoded = [](float x) {
    const long double v = x;
    return 255.0L * (v <= 0.0031308L ? 12.92L * v : 1.055L * std::pow(v, 1.0L / 2.4L) - 0.055L);
  };
  std::vector<float> samples;
  for (int i = 0; i <= 1'000'000; ++i) samples.push_back(static_cast<float>(i) / 1e6F);
  for (int code = 1; code <= 255; ++code) {
    const long double e = (code - 0.5L) / 255.0L;
    auto x = static_cast<float>(e <= 0.04045L ? e / 12.92L : std::pow((e + 0.055L) / 1.055L, 2.4L));
    for (int i = 0; i < 16; ++i) x = std::nextafter(x, 0.0F);
    for (int i = 0; i < 33; ++i, x = std::nextafter(x, 1.0F)) samples.push_back(x);
  }
  samples.resize((samples.size() + 999) / 1000 * 1000);  // rows of 1000, the rest black
  Picture picture;
  picture.layers.push_back(
      {{"Y"}, image_of(1000, static_cast<int>(samples.size() / 1000), 1, samples)});
  const Picture back = decode(encode(picture, ImageFormat::png));
  const std::vector<float>& codes = back.layers.front().image.pixels();
  ASSERT_EQ(codes.size(), samples.size());
  int wrong = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    wrong += std::lround(codes[i] * 255.0F) == std::lround(encoded(samples[i])) ? 0 : 1;
  }
  EXPECT_EQ(wrong, 0);
}

TEST(ImageCodec, KeepsRowsAndColumns) {
  // 0.0, 0.5 and 1.0 have the codes 0, 188 and 255 (above).
  const Picture picture{
      {{{"R", "G", "B"}, image_of(2, 2, 3, {0, .5F, 1, 1, 0, .5F, .5F, 1, 0, 1, 1, .5F})}}, {}};
  const std::vector<int> codes = {0, 188, 255, 255, 0, 188, 188, 255, 0, 255, 255, 188};
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::webp}) {
    const Picture back = decode(encode(picture, format));
    ASSERT_EQ(back.layers.size(), 1U);
    const Image& image = back.layers.front().image;
    EXPECT_EQ(image.width(), 2);
    EXPECT_EQ(image.height(), 2);
    ASSERT_EQ(image.channels(), 3);
    for (std::size_t i = 0; i < codes.size(); ++i) {
      EXPECT_FLOAT_EQ(image.pixels()[i], static_cast<float>(codes[i]) / 255.0F);
    }
  }
}

// Colours straight and sRGB-encoded beside a linear alpha: neither multiplied on the way out nor
// divided on the way back. 0.25 has the code 255 (1.055 0.25^(1/2.4) - 0.055) = 136.96.
TEST(ImageCodec, KeepsStraightColoursBesideALinearAlpha) {
  const Picture picture{
      {{{"R", "G", "B", "A"}, image_of(2, 1, 4, {1, .5F, .25F, .5F, 1, 1, 1, 0})}}, {}};
  const std::vector<int> codes = {255, 188, 137, 128, 255, 255, 255, 0};
  const Picture png = decode(encode(picture, ImageFormat::png));
  ASSERT_EQ(png.layers.front().image.channels(), 4);
  for (std::size_t i = 0; i < codes.size(); ++i) {
    EXPECT_FLOAT_EQ(png.layers.front().image.pixels()[i], static_cast<float>(codes[i]) / 255.0F);
  }
  // OpenImageIO's reader of WebP multiplies by alpha and rounds again.
  const Picture webp = decode(encode(picture, ImageFormat::webp));
  ASSERT_EQ(webp.layers.front().image.channels(), 4);
  for (std::size_t i = 0; i < 4; ++i) {
    const double multiplied = i == 3 ? 128.0 : codes[i] * 128.0 / 255.0;
    EXPECT_NEAR(255.0F * webp.layers.front().image.pixels()[i], multiplied, 1.0F);
  }
  EXPECT_EQ(decode(encode(picture, ImageFormat::tiff)).layers.front().image,
            picture.layers.front().image);
}

// Of a flat picture JPEG keeps one coefficient for 64 pixels, 8 times their mean, in steps of 3
// (quality 92, next test): off by at most 1.5/8 = 0.19 in Y, Cb and Cr. Back in RGB that is at
// most 0.19 (1 + 1.772) = 0.52 codes, and each of two conversions rounds by 0.5: within 2 codes.
TEST(ImageCodec, JpegKeepsAFlatColour) {
  const std::array<float, 3> color = {0.5F, 0.18F, 1.0F};  // codes 188, 118, 255
  Image image(24, 16, 3);
  for (std::size_t i = 0; i < image.pixels().size(); ++i) image.pixels()[i] = color[i % 3];
  const Picture back = decode(encode({{{{"R", "G", "B"}, image}}, {}}, ImageFormat::jpeg));
  const std::array<float, 3> codes = {188.0F, 118.0F, 255.0F};
  ASSERT_EQ(back.layers.front().image.pixels().size(), image.pixels().size());
  for (std::size_t i = 0; i < image.pixels().size(); ++i) {
    EXPECT_NEAR(back.layers.front().image.pixels()[i] * 255.0F, codes[i % 3], 2.0F);
  }
}

// ITU T.81: a frame header (FF C0) holds length, precision 8, height, width, 3 components of
// (id, sampling, table): 0x11 for all three is 4:4:4. libjpeg scales the standard's tables, first
// entries (zigzag) 16, 11, 12, 14, 12, 10, 16, 14, by q = 200 - 2*92 percent: (16 q + 50)/100 = 3,
// (11 q + 50)/100 = 2, ...; at 91 the fourth would be 3, at 93 the first 2.
TEST(ImageCodec, JpegIsFullColourAtQuality92) {
  const auto bytes = encode({{{{"R", "G", "B"}, Image(8, 8, 3)}}, {}}, ImageFormat::jpeg);
  EXPECT_TRUE(contains(bytes, std::string("\xff\xc0\x00\x11\x08\x00\x08\x00\x08\x03"
                                          "\x01\x11\x00\x02\x11\x01\x03\x11\x01",
                                          19)));
  EXPECT_TRUE(contains(bytes, std::string("\xff\xdb\x00\x43\x00\3\2\2\2\2\2\3\2", 13)));
}

TEST(ImageCodec, ExrKeepsEveryLayerToTheBit) {
  Picture picture = full_picture(17, 70);  // more than one block of rows
  // Stands between N.X and N.Y in the file, whose channels are sorted, but not in their layer.
  picture.layers.push_back({{"N.X.confidence"}, Image(17, 70, 1)});
  picture.layers.back().image.pixels()[9] = 0.5F;
  picture.layers[1].image.pixels()[5] = kInfinity;
  picture.layers[2].image.pixels()[6] = -kInfinity;
  picture.layers[0].image.pixels()[7] = kNan;
  const auto wanted = channels_of(picture);
  const auto found = channels_of(decode(encode(picture, ImageFormat::exr)));
  ASSERT_EQ(found.size(), wanted.size());
  for (const auto& [name, samples] : wanted) {
    ASSERT_TRUE(found.contains(name)) << name;
    ASSERT_EQ(found.at(name).size(), samples.size()) << name;
    EXPECT_EQ(std::memcmp(found.at(name).data(), samples.data(), samples.size() * sizeof(float)), 0)
        << name;
  }
}

// half has 11 significant bits: a colour is off by at most 2^-11 of itself. Data stay float.
TEST(ImageCodec, HalfPrecisionNarrowsColourAlone) {
  const Picture picture = full_picture(9, 5);
  const auto wanted = channels_of(picture);
  const auto bytes = encode(picture, ImageFormat::exr, Precision::half);
  const auto found = channels_of(decode(bytes));
  ASSERT_EQ(found.size(), wanted.size());
  for (const auto& [name, samples] : wanted) {
    const bool color = name == "R" || name == "G" || name == "B";
    EXPECT_EQ(found.at(name) == samples, !color) << name;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      EXPECT_NEAR(found.at(name)[i], samples[i], std::abs(samples[i]) / 2048.0F) << name;
    }
  }
  // chlist: name, 0, pixel type (1 half, 2 float) in 4 bytes. OpenEXR file layout.
  EXPECT_TRUE(contains(bytes, std::string("R\0\1\0\0\0", 6)));
  EXPECT_TRUE(contains(bytes, std::string("Z\0\2\0\0\0", 6)));
  EXPECT_TRUE(contains(bytes, std::string("coc.signed\0\2\0\0\0", 15)));
}

TEST(ImageCodec, ExrCarriesAttributesAsOpenExrTypesThem) {
  const auto bytes = encode(full_picture(4, 4), ImageFormat::exr);
  // name, 0, type, 0, size in 4 bytes, value: 2.5 is 0x40200000 as float, 42 is 0x2a as int.
  EXPECT_TRUE(contains(bytes, std::string("focus\0float\0\4\0\0\0\0\0\x20\x40", 20)));
  EXPECT_TRUE(contains(bytes, std::string("aperture\0float\0\4\0\0\0", 19)));
  EXPECT_TRUE(contains(bytes, std::string("expTime\0float\0\4\0\0\0", 18)));
  EXPECT_TRUE(contains(bytes, std::string("fstop:seed\0int\0\4\0\0\0\x2a\0\0\0", 23)));
  EXPECT_TRUE(contains(bytes, std::string("fstop:exact\0double\0\x08\0\0\0", 23)));
  EXPECT_TRUE(contains(bytes, std::string("capDate\0string\0\x13\0\0\0"
                                          "1970:01:01 00:00:00",
                                          38)));
  EXPECT_TRUE(contains(bytes, std::string("compression\0compression\0\1\0\0\0\3", 29)));  // ZIP

  std::map<std::string, std::variant<double, int, std::string>> found;
  for (const ImageAttribute& attribute : decode(bytes).attributes) {
    found[attribute.name] = attribute.value;
  }
  EXPECT_EQ(std::get<double>(found.at("focus")), 2.5);
  EXPECT_EQ(std::get<double>(found.at("aperture")), double{1.4F});
  EXPECT_EQ(std::get<double>(found.at("expTime")), double{0.008F});
  EXPECT_EQ(std::get<double>(found.at("fstop:exact")), 0.1);
  EXPECT_EQ(std::get<int>(found.at("fstop:seed")), 42);
  EXPECT_EQ(std::get<std::string>(found.at("fstop:engine")), "fstop 0.1");
}

TEST(ImageCodec, TiffKeepsLinearFloatsAndAttributes) {
  Picture picture = full_picture(5, 70);
  picture.layers[0].image.pixels()[0] = kInfinity;
  const Picture back = decode(encode(picture, ImageFormat::tiff));
  ASSERT_EQ(back.layers.size(), 1U);
  EXPECT_EQ(back.layers.front().channel_names, picture.layers.front().channel_names);
  EXPECT_EQ(back.layers.front().image, picture.layers.front().image);
  ASSERT_EQ(back.attributes.size(), picture.attributes.size());
  for (std::size_t i = 0; i < back.attributes.size(); ++i) {
    EXPECT_EQ(back.attributes[i].name, picture.attributes[i].name);
    if (picture.attributes[i].name != "nominalFocalLength") {  // 50.0 is written as 50
      EXPECT_EQ(back.attributes[i].value, picture.attributes[i].value);
    }
  }
  const auto wide = encode(picture, ImageFormat::tiff);
  const auto narrow = encode(picture, ImageFormat::tiff, Precision::half);
  EXPECT_LT(narrow.size(), wide.size());
  const Image half = decode(narrow).layers.front().image;
  for (std::size_t i = 1; i < half.pixels().size(); ++i) {
    const float sample = picture.layers.front().image.pixels()[i];
    EXPECT_NEAR(half.pixels()[i], sample, std::abs(sample) / 2048.0F);
  }
}

TEST(ImageCodec, TheClockDoesNotShow) {
  const Picture picture = full_picture(32, 20);
  std::map<ImageFormat, std::vector<std::byte>> before;
  for (const ImageFormat format : kFormats) before[format] = encode(picture, format);
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  for (const ImageFormat format : kFormats) {
    EXPECT_EQ(encode(picture, format), before[format]) << format_name(format);
  }
}

TEST(ImageCodec, WritesEachFormatIntoMemoryAlone) {
  using namespace std::string_literals;
  const std::map<ImageFormat, std::string> magic = {{ImageFormat::png, "\x89PNG"s},
                                                    {ImageFormat::jpeg, "\xff\xd8\xff"s},
                                                    {ImageFormat::webp, "RIFF"s},
                                                    {ImageFormat::tiff, "II*\0"s},
                                                    {ImageFormat::exr, "\x76\x2f\x31\x01"s}};
  for (const ImageFormat format : kFormats) {
    const auto bytes = encode(full_picture(3, 2), format);
    const std::string& start = magic.at(format);
    ASSERT_GT(bytes.size(), start.size());
    EXPECT_EQ(std::memcmp(bytes.data(), start.data(), start.size()), 0) << format_name(format);
    EXPECT_FALSE(std::filesystem::exists("memory." + std::string(format_name(format))));
  }
  EXPECT_EQ(media_type(ImageFormat::jpeg), "image/jpeg");
  EXPECT_EQ(media_type(ImageFormat::exr), "image/x-exr");
}

TEST(ImageCodec, RefusesWhatAFormatCannotHold) {
  const auto strip = [](int width, int channels) {
    std::vector<std::string> names = {"R", "G", "B", "A"};
    names.resize(static_cast<std::size_t>(channels));
    return Picture{{{names, Image(width, 1, channels)}}, {}};
  };
  EXPECT_NO_THROW(encode(strip(65'500, 1), ImageFormat::jpeg));
  expect_refused(strip(65'501, 1), ImageFormat::jpeg, ErrorCode::unsupported);
  EXPECT_NO_THROW(encode(strip(16'383, 3), ImageFormat::webp));
  expect_refused(strip(16'384, 3), ImageFormat::webp, ErrorCode::unsupported);
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::jpeg, ImageFormat::webp}) {
    expect_refused(strip(4, 2), format, ErrorCode::unsupported);
  }
  expect_refused(strip(4, 4), ImageFormat::jpeg, ErrorCode::unsupported);
  for (const ImageFormat format : kFormats) {
    expect_refused({}, format, ErrorCode::internal);
    expect_refused({{{{"Y"}, Image()}}, {}}, format, ErrorCode::internal);
    expect_refused({{{{"Y"}, Image(2, 2, 1)}, {{"Z"}, Image(2, 1, 1)}}, {}}, format,
                   ErrorCode::internal);
    expect_refused({{{{"Y"}, Image(2, 2, 1)}, {{"Y"}, Image(2, 2, 1)}}, {}}, format,
                   ErrorCode::internal);
    expect_refused({{{{"R", "G"}, Image(2, 2, 3)}}, {}}, format, ErrorCode::internal);
  }
}

// Every shorter file: an error, or (JPEG) pixels; never anything else.
TEST(ImageCodec, RefusesBytesThatAreNoImage) {
  EXPECT_THROW(decode({}), Error);
  const std::vector<std::byte> zeros(100);
  EXPECT_THROW(decode(zeros), Error);
  for (const ImageFormat format : kFormats) {
    const auto bytes = encode(full_picture(16, 16), format);
    int refused = 0;
    for (std::size_t size = 0; size < bytes.size(); size += size < 12 ? 1 : 97) {
      try {
        decode(std::span(bytes).first(size));
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::bad_image);
        ++refused;
      }
    }
    EXPECT_GT(refused, 8) << format_name(format);
    EXPECT_NO_THROW(decode(bytes));
  }
}

}  // namespace
}  // namespace fstop
