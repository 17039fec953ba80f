// A closed room of six walls, each of its own albedo and emission, against radiosity: the room cut
// into patches, their form factors by Lambert's formula, the linear system solved in double
// precision.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/shading/ray_tree.h"

namespace fstop {
namespace {

using Color = std::array<double, 3>;

struct Wall {
  Vec3 corner = {};
  Vec3 edge_u = {};
  Vec3 edge_v = {};
  Color emission = {};
  Color albedo = {};

  Vec3 at(double u, double v) const { return corner + edge_u * u + edge_v * v; }
};

// 3 x 2 x 4 metres, normals (edge_u x edge_v) inwards.
std::array<Wall, 6> room() {
  return {{{{0, 0, 0}, {0, 2, 0}, {0, 0, 4}, {0, 0, 0}, {0.8, 0.2, 0.1}},
           {{3, 0, 0}, {0, 0, 4}, {0, 2, 0}, {0, 0, 0}, {0.1, 0.7, 0.2}},
           {{0, 0, 0}, {0, 0, 4}, {3, 0, 0}, {0, 0, 0.1}, {0.6, 0.6, 0.5}},
           {{0, 2, 0}, {3, 0, 0}, {0, 0, 4}, {1.0, 0.8, 0.5}, {0.7, 0.7, 0.7}},
           {{0, 0, 0}, {3, 0, 0}, {0, 2, 0}, {0, 0, 0}, {0.9, 0.9, 0.9}},
           {{0, 0, 4}, {0, 2, 0}, {3, 0, 0}, {0, 0.1, 0}, {0.3, 0.4, 0.8}}}};
}

// --- radiosity ---------------------------------------------------------------------------------

// The configuration factor from a point with unit `normal` to a polygon before it, its corners
// counter-clockwise as seen from there: sum of n.(p x q)/|p x q| times the angle between p and q,
// over 2 pi, edge by edge. Source: Lambert 1760; Sparrow 1963.
double factor_to_polygon(Vec3 point, Vec3 normal, const std::array<Vec3, 4>& corners) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 p = corners[i] - point;
    const Vec3 q = corners[(i + 1) % 4] - point;
    const Vec3 across = cross(p, q);
    const double sine = norm(across);
    if (sine > 0.0) sum += dot(normal, across) / sine * std::atan2(sine, dot(p, q));
  }
  return std::abs(sum) / (2.0 * std::numbers::pi);
}

// Mean radiosity, as radiance, of every wall from side^2 patches each.
std::array<Color, 6> mean_radiances(const std::array<Wall, 6>& walls, int side) {
  // Two points of Gauss along each side of a patch.
  const std::array<double, 2> gauss = {0.5 - 0.5 / std::sqrt(3.0), 0.5 + 0.5 / std::sqrt(3.0)};
  const int each = side * side;
  const int count = 6 * each;
  std::vector<double> factors(static_cast<std::size_t>(count) * static_cast<std::size_t>(count));
  const auto factor = [&](int i, int j) -> double& {
    return factors[static_cast<std::size_t>(i) * static_cast<std::size_t>(count) +
                   static_cast<std::size_t>(j)];
  };
  const auto wall_of = [&](int i) -> const Wall& {
    return walls[static_cast<std::size_t>(i / each)];
  };
  const auto u_of = [&](int i, double in) { return (i % each % side + in) / side; };
  const auto v_of = [&](int i, double in) { return (i % each / side + in) / side; };
  for (int i = 0; i < count; ++i) {
    const Vec3 normal = normalized(cross(wall_of(i).edge_u, wall_of(i).edge_v));
    for (int j = 0; j < count; ++j) {
      if (i / each == j / each) continue;
      const Wall& other = wall_of(j);
      const std::array<Vec3, 4> corners = {
          other.at(u_of(j, 0), v_of(j, 0)), other.at(u_of(j, 1), v_of(j, 0)),
          other.at(u_of(j, 1), v_of(j, 1)), other.at(u_of(j, 0), v_of(j, 1))};
      for (const double a : gauss) {
        for (const double b : gauss) {
          factor(i, j) +=
              0.25 * factor_to_polygon(wall_of(i).at(u_of(i, a), v_of(i, b)), normal, corners);
        }
      }
    }
  }
  std::array<Color, 6> means = {};
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> light(static_cast<std::size_t>(count));
    for (int sweep = 0; sweep < 200; ++sweep) {  // Gauss and Seidel
      for (int i = 0; i < count; ++i) {
        double seen = 0.0;
        for (int j = 0; j < count; ++j) seen += factor(i, j) * light[static_cast<std::size_t>(j)];
        light[static_cast<std::size_t>(i)] = wall_of(i).emission[c] + wall_of(i).albedo[c] * seen;
      }
    }
    for (int i = 0; i < count; ++i) {
      means[static_cast<std::size_t>(i / each)][c] += light[static_cast<std::size_t>(i)] / each;
    }
  }
  return means;
}

// --- fstop -------------------------------------------------------------------------------------

Rgb rgb(const Color& color) {
  return {static_cast<float>(color[0]), static_cast<float>(color[1]), static_cast<float>(color[2])};
}

Scene room_scene(const std::array<Wall, 6>& walls) {
  Scene scene;
  for (const Wall& wall : walls) {
    scene.objects.push_back(
        {.shape = QuadObject{.corner = wall.corner, .edge_u = wall.edge_u, .edge_v = wall.edge_v},
         .material = static_cast<int>(scene.materials.size())});
    scene.materials.push_back({.model = ShadingModel::phong,
                               .emission = {.value = rgb(wall.emission)},
                               .diffuse = {.value = rgb(wall.albedo)}});
  }
  return scene;
}

// The mean over a wall of what a viewer inside sees of it: each sample at a point of its own.
Color mean_seen(const RayScene& scene, const Wall& wall, std::uint32_t samples) {
  const SampleSequence sequence(11);
  Color mean = {};
  for (std::uint32_t first = 0; first < samples; first += kLanes) {
    SampleKeys keys;
    for (std::uint32_t k = 0; k < kLanes; ++k) keys.index[k] = first + k;
    LaneValues u, v;
    sequence.fill(keys, Dimension::pixel_x, u);
    sequence.fill(keys, Dimension::pixel_y, v);
    RayPacket packet;
    alignas(64) LaneMask all;
    all.fill(-1);
    const Vec3 eye{1.4, 1.1, 1.7};
    for (std::size_t k = 0; k < kLanes; ++k) {
      packet.set(static_cast<int>(k), to_float(eye),
                 to_float(normalized(wall.at(u[k], v[k]) - eye)), kFar, 0.0F);
    }
    scene.intersect(packet, all, Coherence::incoherent);
    const ShadingInputs inputs{
        .scene = scene, .sequence = sequence, .keys = keys, .illumination = Illumination::global};
    LaneColors colors;
    std::uint64_t rays = 0;
    shade(inputs, packet, all, colors, rays);
    for (std::size_t k = 0; k < kLanes; ++k) {
      mean[0] += double{colors.r[k]} / samples;
      mean[1] += double{colors.g[k]} / samples;
      mean[2] += double{colors.b[k]} / samples;
    }
  }
  return mean;
}

TEST(Radiosity, FactorsOfAClosedRoomAddUpToOne) {
  const std::array<Wall, 6> walls = room();
  double sum = 0.0;
  for (std::size_t i = 1; i < 6; ++i) {
    const Wall& wall = walls[i];
    sum += factor_to_polygon(walls[0].at(0.3, 0.6), {1, 0, 0},
                             {wall.at(0, 0), wall.at(1, 0), wall.at(1, 1), wall.at(0, 1)});
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
}

// One percent, as promised; what patches leave is told by a coarser cut, four times as wrong.
TEST(Radiosity, GlobalIlluminationAgreesOnEveryWall) {
  const std::array<Wall, 6> walls = room();
  const std::array<Color, 6> coarse = mean_radiances(walls, 5);
  const std::array<Color, 6> expected = mean_radiances(walls, 10);
  const RayScene scene(room_scene(walls));
  double worst = 0.0;
  double worst_cut = 0.0;
  for (std::size_t i = 0; i < 6; ++i) {
    const Color seen = mean_seen(scene, walls[i], 1U << 17);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(seen[c], expected[i][c], 0.01 * expected[i][c]) << "wall " << i << ", " << c;
      EXPECT_NEAR(coarse[i][c], expected[i][c], 0.004 * expected[i][c]);
      worst = std::max(worst, std::abs(seen[c] / expected[i][c] - 1.0));
      worst_cut = std::max(worst_cut, std::abs(coarse[i][c] / expected[i][c] - 1.0));
    }
  }
  std::printf("radiosity: worst wall %.2g off; 5 against 10 patches a side %.2g\n", worst,
              worst_cut);
}

}  // namespace
}  // namespace fstop
