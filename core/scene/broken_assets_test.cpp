#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fcntl.h>
#include <ostream>
#include <random>
#include <string>
#include <string_view>
#include <sys/resource.h>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/scene/handmade_files.h"
#include "core/scene/scene_file.h"

// Whatever happens to a file, its loader answers with an fstop::Error or with values that keep
// their promises. Meant to be run under AddressSanitizer and UndefinedBehaviorSanitizer too.
namespace fstop {
namespace {

using handmade::Bytes;
using handmade::Writer;

constexpr AssetLimits kLimits{.max_file_bytes = std::size_t{64} << 20U,
                              .max_triangles = 2'000'000,
                              .max_texture_pixels = 1'000'000,
                              .max_coordinate = 1e7};

// libpng reports errors to stderr by itself; thousands are expected here.
class QuietStderr {
 public:
  QuietStderr() : saved_(dup(2)) {
    const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
    dup2(null, 2);
    close(null);
  }
  ~QuietStderr() {
    dup2(saved_, 2);
    close(saved_);
  }
  QuietStderr(const QuietStderr&) = delete;
  QuietStderr& operator=(const QuietStderr&) = delete;

 private:
  int saved_;
};

std::string obj_text() {
  return "# a square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 -0.25\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
         "vn 0 0 1\nvn 0.6 0 0.8\nusemtl a\nf 1/1/1 2/2/1 3/3/2 4/4/2\nf -4//1 -3//2 -2//1\n";
}

std::string ply_header(const std::string& format) {
  return "ply\nformat " + format +
         " 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
         "property float nx\nproperty float ny\nproperty float nz\nproperty float s\n"
         "property float t\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n";
}

Bytes ply_ascii() {
  return handmade::bytes_of(ply_header("ascii") +
                            "0 0 0 0 0 1 0 0\n1 0 0 0 0 1 1 0\n1 1 0 0 0 1 1 1\n0 1 0 0 0 1 0 1\n"
                            "3 0 1 2\n4 0 1 2 3\n");
}

Bytes ply_binary(bool big_endian) {
  Writer file(big_endian);
  file.text(ply_header(big_endian ? "binary_big_endian" : "binary_little_endian"));
  for (const float i : {0.0F, 1.0F, 2.0F, 3.0F}) {
    file.put_all<float>({i, i * i, 1, 0, 0, 1, i / 3, 0.5F});
  }
  file.put(std::uint8_t{3}).put_all<std::int32_t>({0, 1, 2});
  file.put(std::uint8_t{4}).put_all<std::int32_t>({0, 1, 2, 3});
  return file.bytes();
}

std::string gltf_json(const std::string& buffer_members) {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes":
      [{"children": [1], "rotation": [0, 0, 1, 0]}, {"mesh": 0, "scale": [1, 2, 3]}], "meshes":
      [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 0, "TEXCOORD_0": 1}, "indices": 2,
      "extras": {"a": [1, {"b": "c"}]}}]}], "materials": [{"pbrMetallicRoughness": {}}], "images":
      [{"bufferView": 1, "mimeType": "image/png"}], "bufferViews": [{"buffer": 0, "byteLength": 36},
      {"buffer": 0, "byteOffset": 36, "byteLength": 12, "byteStride": 4}, {"buffer": 0,
      "byteOffset": 48, "byteLength": 6}], "accessors": [{"bufferView": 0, "componentType": 5126,
      "count": 3, "type": "VEC3"}, {"bufferView": 1, "componentType": 5121, "normalized": true,
      "count": 3, "type": "VEC2"}, {"bufferView": 2, "componentType": 5123, "count": 3, "type":
      "SCALAR"}], "buffers": [{"byteLength": 54)" +
         buffer_members + "}]}";
}

Bytes gltf_data() {
  Writer data;
  data.put_all<float>({1, 0, 1, 1, 1, 0, 0, 1, 1});
  data.put_all<std::uint8_t>({0, 0, 0, 0, 255, 51, 0, 0, 0, 255, 0, 0});
  data.put_all<std::uint16_t>({0, 1, 2});
  return data.bytes();
}

Bytes png_bytes(handmade::PngColor color, std::uint8_t depth) {
  std::vector<Bytes> rows;
  for (int y = 0; y < 5; ++y) {
    Writer row;
    const int size = 7 * depth / 8 * (color == handmade::PngColor::rgb ? 3 : 4);
    for (int i = 0; i < size; ++i) row.put(static_cast<std::uint8_t>(37 * i + 11 * y));
    rows.push_back(row.bytes());
  }
  return handmade::png(7, depth, color, rows, {{"tEXt", handmade::bytes_of("Comment")}});
}

Bytes exr_bytes() {
  std::vector<handmade::ExrChannel> channels = {{"B", {}}, {"G", {}}, {"R", {}}, {"Z", {}}};
  float next = 0.0F;
  for (handmade::ExrChannel& channel : channels) {
    for (int i = 0; i < 20; ++i) channel.samples.push_back(next += 0.25F);
  }
  return handmade::exr(5, 4, channels);
}

void check_mesh(const std::string& name, const Bytes& bytes) {
  const Mesh mesh = decode_mesh(name, bytes, kLimits);
  ASSERT_FALSE(mesh.triangles.empty());
  ASSERT_TRUE(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size());
  ASSERT_TRUE(mesh.uvs.empty() || mesh.uvs.size() == mesh.positions.size());
  for (const auto& position : mesh.positions) {
    for (const float x : position) ASSERT_TRUE(std::abs(x) <= 1e7F);
  }
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t index : triangle) ASSERT_LT(index, mesh.positions.size());
  }
}

void check_texture(const std::string& name, const Bytes& bytes) {
  const Image image = decode_texture(name, bytes, ColorSpace::srgb, kLimits);
  ASSERT_EQ(image.channels(), 3);
  ASSERT_GT(image.pixels().size(), 0U);
  ASSERT_LE(image.pixels().size(), 3 * kLimits.max_texture_pixels);
  for (const float sample : image.pixels()) ASSERT_TRUE(std::isfinite(sample));
}

// Loads the file; true if it was refused. Nothing but Error may be thrown.
bool is_refused(const std::string& name, const Bytes& bytes) {
  try {
    const bool mesh = name.ends_with(".obj") || name.ends_with(".ply") || name.ends_with(".glb") ||
                      name.ends_with(".gltf");
    mesh ? check_mesh(name, bytes) : check_texture(name, bytes);
    return false;
  } catch (const Error& error) {
    EXPECT_TRUE(error.code() == ErrorCode::bad_geometry || error.code() == ErrorCode::bad_image)
        << error.what();
    EXPECT_TRUE(std::string(error.what()).starts_with(name + ": ")) << error.what();
    return true;
  }
}

// Makes the checksums of a damaged PNG right again, so that the damage reaches the decoder.
void mend_png(Bytes& bytes) {
  const auto big_endian = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
      value = value << 8U | std::to_integer<std::uint32_t>(bytes[at + i]);
    return value;
  };
  for (std::size_t at = 8; bytes.size() - at >= 12;) {
    const std::size_t length = big_endian(at);
    if (length > bytes.size() - at - 12) return;
    const std::uint32_t crc = handmade::crc32(std::span(bytes).subspan(at + 4, length + 4));
    for (std::size_t i = 0; i < 4; ++i) bytes[at + 8 + length + i] = std::byte(crc >> (24 - 8 * i));
    at += length + 12;
  }
}

struct BrokenAsset {
  const char* name = "";
  Bytes bytes = {};
  bool mended = false;       // PNG checksums
  double least_refused = 0;  // share of the damaged files that must be refused
};

void PrintTo(const BrokenAsset& asset, std::ostream* stream) { *stream << asset.name; }

// Peak resident memory of the process so far. (Sanitizers have a memory of their own.)
void expect_memory_below_one_gigabyte() {
#ifndef __SANITIZE_ADDRESS__
  rusage usage = {};
  ASSERT_EQ(getrusage(RUSAGE_SELF, &usage), 0);
  EXPECT_LT(usage.ru_maxrss, 1L << 20) << "KiB";
#endif
}

class BrokenAssets : public testing::TestWithParam<BrokenAsset> {
 protected:
  static void TearDownTestSuite() { expect_memory_below_one_gigabyte(); }
};

TEST_P(BrokenAssets, AreRefusedOrLoadedWhenTruncated) {
  const auto& [name, whole, mended, least] = GetParam();
  ASSERT_FALSE(is_refused(name, whole));
  const QuietStderr quiet;
  int refused = 0;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    refused += is_refused(name, {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
  }
  EXPECT_GE(refused, least * static_cast<double>(whole.size()));
}

TEST_P(BrokenAssets, AreRefusedOrLoadedWhenDamaged) {
  const auto& [name, whole, mended, least] = GetParam();
  const QuietStderr quiet;
  std::mt19937 random(20'240'501);
  int refused = 0;
  constexpr int kRounds = 1000;
  constexpr std::string_view kText = "0123456789-+.e/[]{}\",: \n";
  for (int round = 0; round < kRounds; ++round) {
    Bytes bytes = whole;
    const auto changes = 1 + random() % 4;
    for (unsigned i = 0; i < changes; ++i) {
      std::byte& victim = bytes[random() % bytes.size()];
      // A flipped bit, a value of another kind, or the largest ones, which counts dislike.
      switch (random() % 4) {
        case 0:
          victim ^= std::byte(1U << random() % 8);
          break;
        case 1:
          victim = std::byte(random() % 256);
          break;
        case 2:
          victim = std::byte{0xff};
          break;
        default:
          victim = std::byte(kText[random() % kText.size()]);
          break;
      }
    }
    if (mended) mend_png(bytes);
    refused += is_refused(name, bytes);
  }
  EXPECT_GT(refused, 0);
}

// Headers that promise as many pixels as the server allows, and next to no data.
TEST(BrokenAssetsMemory, StaysBelowOneGigabyteAtTheServersLimit) {
  AssetLimits limits = kLimits;
  limits.max_texture_pixels = 16'000'000;
  const std::vector<std::byte> side = Writer(true).put(std::uint32_t{4000}).bytes();
  const QuietStderr quiet;
  const auto try_to_load = [&](const Bytes& bytes) {
    try {
      EXPECT_EQ(decode_texture("t", bytes, ColorSpace::srgb, limits).width(), 4000);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::bad_image) << error.what();
    }
  };
  for (const unsigned interlaced : {0U, 1U}) {
    Bytes png = png_bytes(handmade::PngColor::rgb_alpha, 16);
    std::copy(side.begin(), side.end(), png.begin() + 16);
    std::copy(side.begin(), side.end(), png.begin() + 20);
    png[28] = std::byte(interlaced);
    mend_png(png);
    try_to_load(png);
  }
  for (const unsigned frame : {0xc0U, 0xc2U}) {  // sequential and progressive
    Bytes jpeg = handmade::jpeg(170, true);
    jpeg[72] = std::byte(frame);  // after SOI and DQT
    std::copy(side.begin() + 2, side.end(), jpeg.begin() + 76);
    std::copy(side.begin() + 2, side.end(), jpeg.begin() + 78);
    try_to_load(jpeg);
  }
  // 24 MB of samples that are there, in rows of one channel.
  try_to_load(handmade::exr(4000, 1500, {{"Y", std::vector<float>(6'000'000)}}));
  expect_memory_below_one_gigabyte();
}

std::vector<BrokenAsset> broken_assets() {
  using handmade::PngColor;
  const std::string uri =
      R"(, "uri": "data:application/octet-stream;base64,)" + handmade::base64(gltf_data()) + '"';
  return {{"square.obj", handmade::bytes_of(obj_text()), false, 0.8},
          {"ascii.ply", ply_ascii(), false, 0.9},
          {"little.ply", ply_binary(false), false, 1.0},
          {"big.ply", ply_binary(true), false, 1.0},
          {"tree.glb", handmade::glb(gltf_json(""), gltf_data()), false, 1.0},
          {"tree.gltf", handmade::bytes_of(gltf_json(uri)), false, 1.0},
          {"rgb.png", png_bytes(PngColor::rgb, 8), false, 1.0},
          {"mended.png", png_bytes(PngColor::rgb, 8), true, 1.0},
          {"alpha.png", png_bytes(PngColor::rgb_alpha, 16), true, 1.0},
          {"grey.jpg", handmade::jpeg(188, false), false, 0.8},
          {"color.jpg", handmade::jpeg(170, true), false, 0.8},
          {"rgbz.exr", exr_bytes(), false, 1.0}};
}

INSTANTIATE_TEST_SUITE_P(Formats, BrokenAssets, testing::ValuesIn(broken_assets()),
                         [](const auto& asset) {
                           std::string name = asset.param.name;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

}  // namespace
}  // namespace fstop
