#include "core/scene/emitters.h"

#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "core/scene/mesh_islands.h"
#include "core/scene/ray_scene.h"

namespace fstop {
namespace {

Material glow(float radiance) {
  return {.name = "glow", .emission = {.value = {radiance, 0.5F * radiance, 0.0F}}};
}

// Adds a cube with a corner at `corner`; `outwards` false turns its faces inside out. Every face
// has corners of its own, as files with normals have.
void add_cube(Mesh& mesh, Vec3 corner, double side, bool outwards) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool high : {false, true}) {
      const auto base = static_cast<std::uint32_t>(mesh.positions.size());
      for (const auto& [s, t] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
        std::array<double, 3> p = {corner.x, corner.y, corner.z};
        const auto a = static_cast<std::size_t>(axis);
        p[a] += high ? side : 0.0;
        p[(a + 1) % 3] += s * side;
        p[(a + 2) % 3] += t * side;
        mesh.positions.push_back(
            {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
      }
      // (s, t) run counter-clockwise seen from the positive end of the axis.
      if (high == outwards) {
        mesh.triangles.push_back({base, base + 1, base + 2});
        mesh.triangles.push_back({base, base + 2, base + 3});
      } else {
        mesh.triangles.push_back({base, base + 2, base + 1});
        mesh.triangles.push_back({base, base + 3, base + 2});
      }
    }
  }
}

Object mesh_object(Mesh mesh) {
  return {.shape = MeshObject{
              .file = "bulbs", .interpolation = Interpolation::flat, .mesh = std::move(mesh)}};
}

TEST(MeshIslands, CubesThatTouchInACornerAreTwoAndKnowTheirOutside) {
  Mesh mesh;
  add_cube(mesh, {0, 0, 0}, 1.0, true);
  add_cube(mesh, {1, 1, 1}, 1.0, false);
  mesh.positions.insert(mesh.positions.end(), {{5, 0, 0}, {6, 0, 0}, {5, 1, 0}});
  mesh.triangles.push_back({48, 49, 50});
  const std::vector<MeshIsland> islands = mesh_islands(mesh);
  ASSERT_EQ(islands.size(), 3U);
  EXPECT_EQ(islands[0].triangles.size(), 12U);
  EXPECT_EQ(islands[0].outwards, 1);
  EXPECT_EQ(islands[1].triangles.size(), 12U);
  EXPECT_EQ(islands[1].outwards, -1);
  EXPECT_EQ(islands[2].triangles, std::vector<std::uint32_t>{24});
  EXPECT_EQ(islands[2].outwards, 0);
}

TEST(Emitters, AreBrightAtRestAndNeitherMirrorsNorGlass) {
  Scene scene;
  scene.materials = {glow(50.0F), glow(0.9F), glow(50.0F), glow(50.0F)};
  scene.materials[2].reflection = 0.1;
  scene.materials[3].transmission = 0.5;
  for (int i = 0; i < 4; ++i) {
    scene.objects.push_back(
        {.shape = SphereObject{.center = {1.0 * i, 0, -5}, .radius = 0.1}, .material = i});
  }
  scene.objects.push_back(scene.objects[0]);
  scene.objects.back().velocity = {0, 1, 0};
  const RayScene ray_scene(scene);
  ASSERT_EQ(ray_scene.emitters().size(), 1U);
  const Emitter& emitter = ray_scene.emitters().front();
  EXPECT_EQ(emitter.object, 0U);
  EXPECT_EQ(emitter.radiance, (Rgb{50.0F, 25.0F, 0.0F}));
  // The radius in single precision: 6e-8 off.
  EXPECT_NEAR(emitter.area, 4.0 * std::numbers::pi * 0.01, 1e-8);
}

TEST(Emitters, WithoutAnyWhiteLightAreTheBrightest) {
  Scene scene;
  scene.materials = {glow(0.32F), glow(0.021F), glow(0.019F)};
  for (int i = 0; i < 3; ++i) {
    scene.objects.push_back({.shape = SphereObject{.center = {1.0 * i, 0, -5}}, .material = i});
  }
  EXPECT_EQ(RayScene(scene).emitters().size(), 2U);  // a 16th of 0.32 is 0.02
}

TEST(Emitters, TexturesCountByTheirMean) {
  Scene scene;
  TextureSource texture{.name = "halves", .filter = TextureFilter::mipmap, .image = Image(2, 1, 3)};
  for (int c = 0; c < 3; ++c) texture.image.at(1, 0)[c] = 4.0F;
  scene.textures = {texture};
  scene.materials = {{.emission = {.value = {1.0F, 1.0F, 1.0F}, .texture = 0}}};
  scene.objects = {{.shape = QuadObject{.corner = {0, 0, -2}}}};
  const RayScene ray_scene(scene);
  ASSERT_EQ(ray_scene.emitters().size(), 1U);
  const Emitter& emitter = ray_scene.emitters().front();
  // Two triangles' middles mirror each other about the texture's: their mean is its mean, 2.
  EXPECT_NEAR(emitter.radiance[0], 2.0F, 1e-5F);
  EXPECT_TRUE(emitter.flat);
  EXPECT_DOUBLE_EQ(emitter.area, 1.0);
}

// Rays that lack a group's bit pass through its emitters and nothing else; hits name the scene's
// objects and their triangles however the emitters were sorted.
TEST(Emitters, MaskedRaysPassThroughAGroupOnly) {
  Mesh mesh;
  add_cube(mesh, {-0.05, -0.05, -2.1}, 0.1, true);  // small: a group of its own
  add_cube(mesh, {-4, -4, -18}, 8.0, true);
  Scene scene;
  scene.materials = {glow(50.0F), glow(0.5F)};
  scene.objects = {mesh_object(mesh),
                   {.shape = SphereObject{.center = {0, 0, -40}, .radius = 9.0}, .material = 1}};
  const RayScene ray_scene(scene);
  ASSERT_EQ(ray_scene.emitters().size(), 2U);
  const Emitter& small = ray_scene.emitters()[0];
  const Emitter& large = ray_scene.emitters()[1];
  EXPECT_NE(small.group, large.group);
  const auto hit_with = [&](std::uint32_t mask) {
    RayPacket packet;
    packet.set(0, {0.01F, 0.02F, 0}, {0, 0, -1}, kFar, 0.0F);
    packet.mask[0] = mask;
    alignas(64) LaneMask valid = {-1};
    RayPacket one = packet;
    ray_scene.intersect(packet, valid, Coherence::coherent);
    ray_scene.intersect_one(one);
    EXPECT_EQ(one.object[0], packet.object[0]);
    EXPECT_EQ(one.primitive[0], packet.primitive[0]);
    return packet;
  };
  const RayPacket all = hit_with(0xffffffffU);
  EXPECT_EQ(all.object[0], 0U);
  EXPECT_LT(all.primitive[0], 12U);
  EXPECT_NEAR(all.far[0], 2.0F, 1e-6F);
  EXPECT_NEAR(ray_scene.surface(all, 0).position.z, -2.0F, 1e-6F);
  const RayPacket behind = hit_with(~small.mask());
  EXPECT_EQ(behind.object[0], 0U);
  EXPECT_GE(behind.primitive[0], 12U);
  EXPECT_NEAR(behind.far[0], 10.0F, 1e-5F);
  const RayPacket last = hit_with(~small.mask() & ~large.mask());
  EXPECT_EQ(last.object[0], 1U);
  EXPECT_NEAR(last.far[0], 31.0F, 1e-4F);
}

TEST(Emitters, GroupsKeepSizesAndPlacesTogether) {
  std::vector<Emitter> emitters(3000);
  for (std::size_t i = 0; i < emitters.size(); ++i) {
    const bool large = i % 3 == 0;
    emitters[i].center = {static_cast<double>(i % 100), static_cast<double>(i / 100), -3.0};
    emitters[i].radius = large ? 1.0 : 0.01;
  }
  assign_groups(emitters);
  std::set<int> sizes[2];
  for (std::size_t i = 0; i < emitters.size(); ++i) {
    EXPECT_GE(emitters[i].group, 1);
    EXPECT_LE(emitters[i].group, kEmitterGroups);
    sizes[i % 3 == 0 ? 0 : 1].insert(emitters[i].group);
  }
  for (const int group : sizes[0]) EXPECT_EQ(sizes[1].count(group), 0U);
  EXPECT_EQ(sizes[0].size() + sizes[1].size(), 31U);
}

}  // namespace
}  // namespace fstop
