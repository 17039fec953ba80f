#include "core/render/block_tracer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "core/simd.h"

namespace fstop {
namespace {

// Textured, lit with highlights and shadows, mirroring, transparent and moving things.
Scene every_kernel() {
  Scene scene;
  TextureSource card{.name = "card", .image = Image(16, 16, 3)};
  for (std::size_t i = 0; i < card.image.pixels().size(); ++i) {
    card.image.pixels()[i] = static_cast<float>(i * 37 % 101) / 101.0F;
  }
  scene.textures = {card};
  const ColorSource texture{.value = {0.8F, 0.9F, 0.7F}, .texture = 0};
  scene.materials = {
      {.emission = texture},
      {.model = ShadingModel::phong,
       .ambient = {.value = {0.1F, 0.1F, 0.1F}},
       .diffuse = texture,
       .specular = {.value = {0.5F, 0.5F, 0.5F}},
       .shininess = 23.0,
       .reflection = 0.3},
      {.model = ShadingModel::blinn_phong, .diffuse = texture, .transmission = 0.8, .ior = 1.5}};
  scene.objects = {
      {.shape = QuadObject{.corner = {-4, -3, -5}, .edge_u = {8, 0, 0}, .edge_v = {0, 6, 0}}},
      {.shape = QuadObject{.corner = {-4, -1, -5}, .edge_u = {8, 0, 0}, .edge_v = {0, 0, 5}},
       .material = 1},
      {.shape = SphereObject{.center = {-0.4, -0.2, -2}, .radius = 0.5},
       .material = 1,
       .velocity = {0.3, 0, 0}},
      {.shape = SphereObject{.center = {0.6, 0.1, -1.5}, .radius = 0.4}, .material = 2}};
  scene.lights = {
      {.kind = PointLight{.position = {1, 3, 0}, .attenuation = {.a2 = 0.2}},
       .intensity = {3, 3, 3}},
      {.kind = AreaLight{.corner = {-2, 3, -1}, .edge_u = {1, 0, 0}, .edge_v = {0, 0, 1}},
       .intensity = {0.5F, 0.6F, 0.7F}}};
  scene.ambient_light = {0.2F, 0.2F, 0.2F};
  return scene;
}

// The bits of a small picture's sums, in hexadecimal.
std::string picture_bits() {
  const RayScene scene(every_kernel());
  CameraSpec spec;
  spec.optics = LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 1.4}};
  spec.shutter_seconds = 0.5;
  const Sensor sensor = sensor_of(spec, 36, 24);
  const Camera camera = camera_of(spec, sensor);
  const SampleSource source{.scene = scene,
                            .camera = camera,
                            .sensor = sensor,
                            .pupil = PupilWarp({}),
                            .sequence = SampleSequence(3),
                            .falloff = true,
                            .exposure = 0.7F,
                            .shutter_seconds = 0.5F,
                            .texture_width_px = 0.25F};
  const BlockGrid grid(sensor.width, sensor.height);
  std::string bits;
  for (std::size_t block = 0; block < grid.count(); ++block) {
    BlockSums sums;
    BlockTracer(source, grid, block).trace(0, 20, sums);
    for (const auto& channel : sums.value) {
      for (const double value : channel) {
        char text[20];
        std::snprintf(text, sizeof text, "%016llx",
                      static_cast<unsigned long long>(std::bit_cast<std::uint64_t>(value)));
        bits += text;
      }
    }
  }
  return bits;
}

constexpr const char* kAsked = "FSTOP_TEST_PRINTS_PICTURE";

// What this program prints as picture_bits() when it runs with AVX2 alone: which instructions are
// used is settled once in a process.
std::string picture_bits_of_avx2() {
  const std::string self = std::filesystem::read_symlink("/proc/self/exe");
  const std::string command = std::string(kAsked) + "=1 FSTOP_SIMD=avx2 '" + self +
                              "' --gtest_filter=BlockTracer.SumsAreEqualForBothInstructionSets";
  FILE* output = popen(command.c_str(), "r");
  if (output == nullptr) return {};
  std::string text;
  std::array<char, 4096> part = {};
  for (std::size_t got = 0; (got = std::fread(part.data(), 1, part.size(), output)) > 0;) {
    text.append(part.data(), got);
  }
  pclose(output);
  const std::size_t begin = text.find("bits:");
  if (begin == std::string::npos) return {};
  return text.substr(begin + 5, text.find('\n', begin) - begin - 5);
}

TEST(BlockTracer, SumsAreEqualForBothInstructionSets) {
  if (std::getenv(kAsked) != nullptr) {
    ASSERT_FALSE(has_avx512());
    std::printf("\nbits:%s\n", picture_bits().c_str());
    return;
  }
  if (!has_avx512()) GTEST_SKIP() << "this processor has no AVX-512";
  const std::string narrow = picture_bits_of_avx2();
  const std::string wide = picture_bits();
  // 54 blocks, 3 channels, 16 lanes, 16 digits.
  ASSERT_EQ(wide.size(), 54U * 3 * 16 * 16);
  // EXPECT_EQ would print both.
  EXPECT_TRUE(narrow == wide)
      << "first difference at digit "
      << std::mismatch(narrow.begin(), narrow.end(), wide.begin(), wide.end()).first -
             narrow.begin();
}

// Samples [0, 8) and [8, 24) together are samples [0, 24): what is traced never depends on how it
// was cut, beyond the roundings of single-precision sums of at most 16 values.
TEST(BlockTracer, PartsAddUpToTheWhole) {
  const RayScene scene(every_kernel());
  CameraSpec spec;
  spec.optics = LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 2.0}};
  const Sensor sensor = sensor_of(spec, 36, 24);
  const Camera camera = camera_of(spec, sensor);
  const SampleSource source{.scene = scene,
                            .camera = camera,
                            .sensor = sensor,
                            .pupil = PupilWarp({}),
                            .sequence = SampleSequence(5)};
  const BlockGrid grid(sensor.width, sensor.height);
  for (const std::size_t block : {0U, 20U, 40U, 53U}) {
    BlockSums parts;
    BlockTracer first(source, grid, block);
    std::uint64_t rays = first.trace(0, 8, parts);
    rays += BlockTracer(source, grid, block).trace(8, 16, parts);
    BlockSums whole;
    EXPECT_EQ(BlockTracer(source, grid, block).trace(0, 24, whole), rays);
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t k = 0; k < kBlockPixels; ++k) {
        EXPECT_NEAR(parts.value[c][k], whole.value[c][k], 32 * 0x1p-24 * whole.value[c][k]);
      }
    }
  }
}

}  // namespace
}  // namespace fstop
