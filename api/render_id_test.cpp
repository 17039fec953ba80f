#include "api/render_id.h"

#include <gtest/gtest.h>

namespace fstop::api {
namespace {

AssetBytes asset(std::string name, std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {.name = std::move(name), .bytes = {bytes.begin(), bytes.end()}};
}

// FIPS 180-2, appendix B.1, and the empty message.
TEST(RenderId, HashesAsTheStandardSays) {
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(RenderId, CoversSceneTextAndAssetsInAnyOrder) {
  const std::vector<AssetBytes> assets = {asset("a.obj", "v 0 0 0"), asset("b.png", "pixels")};
  const std::vector<AssetBytes> turned = {assets[1], assets[0]};
  const std::string hash = scene_hash("{}", assets);
  EXPECT_EQ(scene_hash("{}", turned), hash);
  EXPECT_NE(scene_hash("{ }", assets), hash);
  EXPECT_NE(scene_hash("{}", std::vector{asset("a.obj", "v 0 0 1"), assets[1]}), hash);
  EXPECT_NE(scene_hash("{}", std::vector{assets[0]}), hash);
}

TEST(RenderId, TellsFieldsApart) {
  EXPECT_NE(render_id("ab", "c", "1"), render_id("a", "bc", "1"));
  EXPECT_NE(render_id("a", "b", "fstop/1"), render_id("a", "b", "fstop/2"));
  EXPECT_EQ(render_id("a", "b", "c"), render_id("a", "b", "c"));
  EXPECT_EQ(render_id("a", "b", "c").size(), 64U);
  EXPECT_TRUE(engine_version().starts_with("fstop/"));
}

}  // namespace
}  // namespace fstop::api
