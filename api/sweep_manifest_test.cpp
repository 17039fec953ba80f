#include "api/sweep_manifest.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/contract_schema.h"
#include "api/problem.h"
#include "api/report_json.h"
#include "core/encode/image_codec.h"

namespace fstop::api {
namespace {

using nlohmann::json;

SweepRequest two_apertures_of_two_scenes() {
  return parse_sweep_request(R"({"base": {"camera": {"lens": {}}}, "axes": [
      {"member": "/scene", "values": ["a", "b"]},
      {"member": "/camera/lens/f_number", "values": [2, 4]}]})",
                             {}, SceneNames::stored_only);
}

ManifestCell cell_of(std::uint32_t index) {
  RenderReport report;
  report.method = "pinhole";
  report.optics.focal_px = 1.0;
  if (index == 3)
    return {.problem = to_json(problem(Error(ErrorCode::no_valid_method, "none models it")))};
  const std::string hash(64, index < 2 ? 'a' : 'b');
  return {.render_id = std::string(64, '0'),
          .files = {{.name = "image.png", .sha256 = std::string(64, 'c'), .bytes = 7},
                    {.name = "layers.exr", .sha256 = std::string(64, 'd'), .bytes = 9}},
          .report = lasting_report_json(report, hash)};
}

TEST(SweepManifest, RefersToCamerasScenesAndStacks) {
  const SweepRequest sweep = two_apertures_of_two_scenes();
  const std::string text = sweep_manifest(sweep, std::string(64, 'e'), cell_of);
  EXPECT_EQ(text.back(), '\n');
  const json manifest = json::parse(text);
  EXPECT_EQ(ContractSchema("SweepManifest").objection(manifest), "") << text;
  EXPECT_EQ(manifest.at("cells"), 4);
  EXPECT_EQ(manifest.at("cameras").size(), 1U) << "the aperture is the images'";
  EXPECT_FALSE(manifest.at("cameras")[0].at("camera").at("lens").contains("f_number"));
  EXPECT_EQ(manifest.at("scenes").size(), 2U);
  EXPECT_EQ(manifest.at("scenes")[1].at("scene"), "b");
  ASSERT_EQ(manifest.at("stacks").size(), 2U);
  EXPECT_EQ(manifest.at("stacks")[0].at("images"), json::parse("[0, 1]"));
  ASSERT_EQ(manifest.at("images").size(), 3U);
  const json& third = manifest.at("images")[2];
  EXPECT_EQ(third.at("id"), 2);
  EXPECT_EQ(third.at("place"), json::parse("[1, 0]"));
  EXPECT_EQ(third.at("f_number"), 2.0);
  EXPECT_EQ(third.at("focus_distance_m"), 2.0);
  EXPECT_EQ(third.at("stack"), 1);
  EXPECT_EQ(third.at("request").at("camera").at("lens").at("f_number"), 2.0);
  EXPECT_EQ(third.at("file"), "cells/000002/image.png");
  ASSERT_EQ(manifest.at("files").size(), 6U);
  EXPECT_EQ(manifest.at("files")[5].at("path"), "cells/000002/layers.exr");
  EXPECT_EQ(manifest.at("files")[5].at("media_type"), "image/x-exr");
  EXPECT_EQ(manifest.at("files")[5].at("image"), 2);
  ASSERT_EQ(manifest.at("failures").size(), 1U);
  EXPECT_EQ(manifest.at("failures")[0].at("image"), 3);
  EXPECT_EQ(manifest.at("failures")[0].at("problem").at("status"), 422);
}

TEST(SweepManifest, SchemaRefusesWhatIsNoManifest) {
  const ContractSchema schema("SweepManifest");
  json manifest =
      json::parse(sweep_manifest(two_apertures_of_two_scenes(), std::string(64, 'e'), cell_of));
  for (const char* pointer : {"/format", "/images/0/render", "/files/0/sha256", "/stacks/0/images",
                              "/images/0/report/cost/rays", "/failures/0/problem"}) {
    json broken = manifest;
    broken[json::json_pointer(pointer)] = nullptr;
    EXPECT_NE(schema.objection(broken), "") << pointer;
  }
  manifest["time"] = 1;
  EXPECT_NE(schema.objection(manifest), "");
}

// A straight edge, 5 degrees off the vertical, that fills pixels by the area on its bright side:
// its transfer is the pixel's own, sinc(f) along the normal but for the slant: above 0.95 at 0.1
// cycles/px, and half at 0.6 (sinc 0.6 = 0.505).
TEST(SweepManifest, MeasuresTheEdgeInAPicture) {
  const double slant = 5.0 * std::numbers::pi / 180.0;
  Image image(120, 80, 3);
  constexpr int kFine = 16;
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 120; ++x) {
      int bright = 0;
      for (int v = 0; v < kFine; ++v) {
        for (int u = 0; u < kFine; ++u) {
          const double px = x + (u + 0.5) / kFine - 60.0;
          const double py = y + (v + 0.5) / kFine - 40.0;
          bright += px * std::cos(slant) + py * std::sin(slant) > 0.0;
        }
      }
      const double share = static_cast<double>(bright) / (kFine * kFine);
      for (int c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>(0.1 + 0.8 * share);
    }
  }
  const auto bytes = encode({.layers = {{{"R", "G", "B"}, image}}}, ImageFormat::exr);
  const SlantedEdgeSpec edge{.region = {.x = 20, .y = 10, .width = 80, .height = 60},
                             .channel = 1,
                             .levels = EdgeLevels{.dark = 0.1, .bright = 0.9}};
  const json told = json::parse(edge_measurement(bytes, edge, 10.0_um));
  ASSERT_TRUE(told.contains("mtf50_cycles_per_px")) << told;
  EXPECT_NEAR(told.at("mtf50_cycles_per_px").get<double>(), 0.603, 0.01);
  EXPECT_NEAR(told.at("mtf50_cycles_per_mm").get<double>(),
              100.0 * told.at("mtf50_cycles_per_px").get<double>(), 1e-9);
  EXPECT_EQ(told.at("mtf").size(), 51U);
  const double sinc = std::sin(0.2 * std::numbers::pi) / (0.2 * std::numbers::pi);
  EXPECT_NEAR(told.at("mtf")[20].get<double>(), sinc, 0.01);
  const Image flat(120, 80, 3);
  const auto nothing = encode({.layers = {{{"R", "G", "B"}, flat}}}, ImageFormat::exr);
  EXPECT_TRUE(json::parse(edge_measurement(nothing, edge, 10.0_um)).contains("not_measured"));
}

}  // namespace
}  // namespace fstop::api
