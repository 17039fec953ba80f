#include "core/scene/vertex_normals.h"

#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// A cube of corners (+-1, +-1, +-1), two triangles a side, outwards.
Mesh cube() {
  Mesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.positions.push_back({i & 1 ? 1.0F : -1.0F, i & 2 ? 1.0F : -1.0F, i & 4 ? 1.0F : -1.0F});
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

TEST(VertexNormals, ASmoothCubeHasItsDiagonals) {
  const Mesh smooth = with_averaged_normals(cube(), 100.0 * kDegree);
  ASSERT_EQ(smooth.positions.size(), 8U);
  for (std::size_t i = 0; i < 8; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // Each side has 90 degrees at each vertex, whether one triangle brings it or two.
      EXPECT_NEAR(smooth.normals[i][axis], smooth.positions[i][axis] / std::sqrt(3.0F), 1e-6F);
    }
  }
}

TEST(VertexNormals, BelowItsAngleAnEdgeIsACrease) {
  const Mesh sharp = with_averaged_normals(cube(), 89.0 * kDegree);
  EXPECT_EQ(sharp.positions.size(), 24U) << "three normals at each of eight corners";
  for (std::size_t f = 0; f < sharp.triangles.size(); ++f) {
    const auto& t = sharp.triangles[f];
    EXPECT_EQ(sharp.normals[t[0]], sharp.normals[t[1]]);
    EXPECT_EQ(sharp.normals[t[0]], sharp.normals[t[2]]);
    EXPECT_EQ(sharp.positions[t[0]], cube().positions[cube().triangles[f][0]]);
  }
  EXPECT_EQ(with_averaged_normals(cube(), 90.0 * kDegree).positions.size(), 8U)
      << "an edge of just the angle is smooth";
}

// A band of a cylinder: the mean of two sides' normals is the radius, whatever their number.
TEST(VertexNormals, ACylindersNormalsAreItsRadii) {
  constexpr int kSides = 12;
  Mesh mesh;
  for (int i = 0; i < kSides; ++i) {
    const double turn = 2.0 * std::numbers::pi * i / kSides;
    for (const float y : {0.0F, 1.0F}) {
      mesh.positions.push_back(
          {static_cast<float>(std::cos(turn)), y, static_cast<float>(std::sin(turn))});
    }
  }
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t a = 2 * i;
    const std::uint32_t b = (2 * i + 2) % (2 * kSides);
    mesh.triangles.push_back({a, a + 1, b});
    mesh.triangles.push_back({b, a + 1, b + 1});
  }
  const Mesh smooth = with_averaged_normals(mesh, 40.0 * kDegree);
  ASSERT_EQ(smooth.positions.size(), 24U);
  for (std::size_t i = 0; i < 24; ++i) {
    EXPECT_NEAR(smooth.normals[i][0], smooth.positions[i][0], 1e-6F);
    EXPECT_NEAR(smooth.normals[i][1], 0.0F, 1e-6F);
    EXPECT_NEAR(smooth.normals[i][2], smooth.positions[i][2], 1e-6F);
  }
}

// Unrepresentative normals: zigzag faces of +-45 degrees average to straight up at every inner
// vertex, as if the surface were flat.
TEST(VertexNormals, ACorrugatedSurfaceLooksFlat) {
  Mesh mesh;
  for (int i = 0; i < 9; ++i) {
    for (const float z : {0.0F, 1.0F}) {
      mesh.positions.push_back({static_cast<float>(i), i % 2 == 0 ? 0.0F : 1.0F, z});
    }
  }
  for (std::uint32_t i = 0; i < 8; ++i) {
    const std::uint32_t a = 2 * i;
    mesh.triangles.push_back({a, a + 1, a + 2});
    mesh.triangles.push_back({a + 2, a + 1, a + 3});
  }
  const Mesh smooth = with_averaged_normals(mesh, 100.0 * kDegree);
  int inner = 0;
  for (std::size_t i = 0; i < smooth.positions.size(); ++i) {
    if (smooth.positions[i][0] < 0.5F || smooth.positions[i][0] > 7.5F) continue;
    ++inner;
    EXPECT_NEAR(std::abs(smooth.normals[i][1]), 1.0F, 1e-6F);
  }
  EXPECT_EQ(inner, 14);
}

TEST(VertexNormals, SeamsOfUvShareTheirNormalsAndKeepTheirUv) {
  Mesh mesh = cube();
  const auto seam = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.push_back(mesh.positions[0]);  // the same place, another uv
  mesh.triangles[0][0] = seam;
  mesh.uvs.assign(mesh.positions.size(), {0.0F, 0.0F});
  mesh.uvs[seam] = {0.5F, 0.25F};
  const Mesh smooth = with_averaged_normals(mesh, 100.0 * kDegree);
  ASSERT_EQ(smooth.positions.size(), 9U);
  ASSERT_EQ(smooth.uvs.size(), 9U);
  const std::uint32_t there = smooth.triangles[0][0];
  EXPECT_EQ(smooth.uvs[there], (std::array{0.5F, 0.25F}));
  EXPECT_EQ(smooth.normals[there], smooth.normals[smooth.triangles[1][0]]);
}

TEST(VertexNormals, FacesWithoutAreaHaveNoSay) {
  Mesh mesh = cube();
  mesh.triangles.push_back({0, 0, 7});
  const Mesh smooth = with_averaged_normals(mesh, 100.0 * kDegree);
  for (const auto& normal : smooth.normals) {
    for (const float n : normal) EXPECT_TRUE(std::isfinite(n));
  }
}

TEST(VertexNormals, AFanWithoutEndIsRefused) {
  Mesh mesh;
  mesh.positions.push_back({0, 0, 0});
  for (int i = 0; i < 1200; ++i) {
    mesh.positions.push_back(
        {static_cast<float>(std::cos(0.005 * i)), static_cast<float>(std::sin(0.005 * i)), 0});
  }
  for (std::uint32_t i = 1; i < 1200; ++i) mesh.triangles.push_back({0, i, i + 1});
  EXPECT_THROW(with_averaged_normals(mesh, 1.0), Error);
}

}  // namespace
}  // namespace fstop
