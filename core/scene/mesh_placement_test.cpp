#include "core/scene/mesh_placement.h"

#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

// A box of 4 x 1 x 2 about (12, 0.5, -1).
Mesh box() {
  Mesh mesh;
  for (const float x : {10.0F, 14.0F}) {
    for (const float y : {0.0F, 1.0F}) {
      for (const float z : {-2.0F, 0.0F}) mesh.positions.push_back({x, y, z});
    }
  }
  mesh.normals.assign(mesh.positions.size(), {0.0F, 0.0F, 1.0F});
  return mesh;
}

void expect_near(const std::array<float, 3>& point, float x, float y, float z) {
  constexpr float kRounding = 1e-6F;
  EXPECT_NEAR(point[0], x, kRounding);
  EXPECT_NEAR(point[1], y, kRounding);
  EXPECT_NEAR(point[2], z, kRounding);
}

TEST(MeshPlacement, ScalesTheLargestSideAboutTheCentre) {
  Mesh mesh = box();
  place(mesh, {.center = {1.0, 2.0, 3.0}, .size = 2.0});
  expect_near(mesh.positions.front(), 0.0F, 1.75F, 2.5F);
  expect_near(mesh.positions.back(), 2.0F, 2.25F, 3.5F);
  expect_near(mesh.normals.front(), 0.0F, 0.0F, 1.0F);
}

// A quarter turn takes +z to +x and +x to -z.
TEST(MeshPlacement, TurnsAboutTheVertical) {
  Mesh mesh = box();
  place(mesh, {.center = {}, .size = 4.0, .turn = std::numbers::pi / 2.0});
  expect_near(mesh.positions.front(), -1.0F, -0.5F, 2.0F);
  expect_near(mesh.positions.back(), 1.0F, 0.5F, -2.0F);
  expect_near(mesh.normals.front(), 1.0F, 0.0F, 0.0F);
}

TEST(MeshPlacement, RefusesWhatHasNoExtent) {
  Mesh none;
  EXPECT_THROW(place(none, {}), Error);
  Mesh point;
  point.positions.assign(3, {1.0F, 2.0F, 3.0F});
  EXPECT_THROW(place(point, {}), Error);
}

}  // namespace
}  // namespace fstop
