#include "core/scene/lane_surfaces.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "core/scene/ray_scene.h"

namespace fstop {
namespace {

using Random = std::mt19937;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
std::array<float, 3> point(Random& random, double reach) {
  return {static_cast<float>(uniform(random, -reach, reach)),
          static_cast<float>(uniform(random, -reach, reach)),
          static_cast<float>(uniform(random, -reach, reach) - 5.0)};
}

// Triangles anywhere in front of the origin, with vertex normals and uv where asked for.
Mesh soup(Random& random, bool normals, bool uvs) {
  Mesh mesh;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const auto a = point(random, 3.0);
    for (int corner = 0; corner < 3; ++corner) {
      auto p = a;
      if (corner > 0) {
        for (float& axis : p) axis += static_cast<float>(uniform(random, -1.0, 1.0));
      }
      mesh.positions.push_back(p);
      if (normals) {
        const Vec3f n = to_float(normalized(
            Vec3{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 0.2, 1)}));
        mesh.normals.push_back({n.x, n.y, n.z});
      }
      if (uvs) {
        mesh.uvs.push_back({static_cast<float>(uniform(random, -2, 2)),
                            static_cast<float>(uniform(random, -2, 2))});
      }
    }
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

Material textured(ShadingModel model) {
  return {.model = model,
          .emission = {.value = {1, 1, 1}, .texture = 0},
          .diffuse = {.value = {1, 1, 1}, .texture = 0}};
}

// All kinds of objects, resting and moving, lit and textured.
Scene mixed_scene(bool moving) {
  Random random(31);
  Scene scene;
  scene.textures = {{.name = "card", .image = Image(4, 4, 3)}};
  scene.materials = {textured(ShadingModel::phong),
                     textured(ShadingModel::blinn_phong),
                     {.model = ShadingModel::phong, .diffuse = {.value = {1, 1, 1}}}};
  for (const auto& [normals, uvs] : {std::pair{true, true}, {false, true}, {true, false}}) {
    for (const Interpolation way : {Interpolation::phong, Interpolation::flat}) {
      scene.objects.push_back({.shape = MeshObject{.file = "soup.obj",
                                                   .interpolation = way,
                                                   .mesh = soup(random, normals, uvs)},
                               .material = uvs ? 0 : 2});
    }
  }
  for (int i = 0; i < 6; ++i) {
    const auto c = point(random, 2.0);
    scene.objects.push_back(
        {.shape = SphereObject{.center = {c[0], c[1], c[2]}, .radius = 0.5}, .material = 1});
    scene.objects.push_back({.shape = QuadObject{.corner = {c[0] - 1, c[1], c[2] - 1},
                                                 .edge_u = {0.9, 0.1, 0.2},
                                                 .edge_v = {-0.2, 1.1, 0.3}},
                             .material = 1});
  }
  scene.objects.push_back(
      {.shape = QuadObject{.corner = {-9, -9, -9}, .edge_u = {18, 0, 0}, .edge_v = {0, 18, 0}}});
  if (moving) {
    for (std::size_t i = 0; i < scene.objects.size(); i += 2) {
      scene.objects[i].velocity = {uniform(random, -1, 1), uniform(random, -1, 1), 0.0};
    }
  }
  return scene;
}

// Rays from near the origin; `spread` 0: all along one way, so that they meet one triangle.
RayPacket packet_of(Random& random, double spread) {
  RayPacket packet;
  const Vec3 middle{uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5), -1.0};
  for (int lane = 0; lane < kLanes; ++lane) {
    const Vec3 direction = normalized(
        middle + Vec3{uniform(random, -spread, spread), uniform(random, -spread, spread), 0.0});
    packet.set(lane, {0.01F, 0.02F, 0.0F}, to_float(direction), kFar,
               static_cast<float>(uniform(random, 0.0, 1.0 / kLongestShutter)));
  }
  return packet;
}

// Both interpolate in single precision with their sums in another order: some roundings of 2^-24
// of coordinates up to 9, of uv up to 2, of unit normals over what a corner's weights lose.
void expect_same(const LaneSurfaces& lanes, std::size_t k, const Surface& one, int material) {
  ASSERT_EQ(lanes.material[k], material);
  EXPECT_LT(norm(lanes.position(k) - one.position), 5e-6F);
  EXPECT_LT(norm(lanes.face(k) - one.geometric_normal), 2e-5F);
  EXPECT_LT(norm(lanes.normal(k) - one.shading_normal), 2e-5F);
  if (material != 2) {  // texture coordinates hold where there is a texture
    EXPECT_NEAR(lanes.u[k], one.u, 2e-6F);
    EXPECT_NEAR(lanes.v[k], one.v, 2e-6F);
  }
  EXPECT_EQ(lanes.uv_per_metre[k], one.uv_per_metre);
  EXPECT_NEAR(lanes.error[k] / one.error, 1.0F, 1e-5F);
  EXPECT_LT(norm(Vec3f{lanes.shift_x[k], lanes.shift_y[k], lanes.shift_z[k]} - one.shift), 1e-6F);
  EXPECT_EQ(lanes.outside[k] != 0, one.from_outside);
}

void expect_packets_agree(bool moving) {
  const RayScene scene(mixed_scene(moving));
  Random random(77);
  int spheres = 0;
  int mixed = 0;
  int uniform_packets = 0;
  for (int i = 0; i < 2000; ++i) {
    RayPacket packet = packet_of(random, i % 3 == 0 ? 0.0 : (i % 3 == 1 ? 0.02 : 0.6));
    alignas(64) LaneMask valid = {};
    for (auto& lane : valid) lane = i % 5 == 0 && random() % 3 == 0 ? 0 : -1;
    scene.intersect(packet, valid, Coherence::incoherent);
    LaneSurfaces lanes;
    scene.surfaces(packet, valid, lanes);
    bool same = true;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (valid[k] == 0 || !packet.hit(static_cast<int>(k))) {
        EXPECT_EQ(lanes.material[k], -1);
        same = false;
        continue;
      }
      const Object& object = scene.scene().objects[packet.object[k]];
      expect_same(lanes, k, scene.surface(packet, static_cast<int>(k)), object.material);
      spheres += std::holds_alternative<SphereObject>(object.shape) ? 1 : 0;
      same = same && packet.primitive[k] == packet.primitive[0] &&
             packet.object[k] == packet.object[0];
    }
    (same ? uniform_packets : mixed) += 1;
  }
  // Every path was taken.
  EXPECT_GT(spheres, 500);
  EXPECT_GT(mixed, 500);
  EXPECT_GT(uniform_packets, 200);
}

TEST(LaneSurfaces, AgreeWithSingleSurfaces) { expect_packets_agree(false); }

TEST(LaneSurfaces, AgreeWithSingleSurfacesOfMovingObjects) { expect_packets_agree(true); }

}  // namespace
}  // namespace fstop
