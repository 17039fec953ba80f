// What interpolated shading cannot show, each measured against its closed form: highlights inside
// polygons, Mach bands, and the five problems that textbooks name (silhouettes, perspective,
// orientation, shared edges, unrepresentative normals). Where fstop has none of it, that is tested.
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

#include "core/scene/vertex_normals.h"
#include "core/shading/ray_tree.h"

namespace fstop {
namespace {

using std::numbers::pi;

// A dozen single-precision roundings of numbers below 1 leave 1e-6.
constexpr float kTolerance = 1e-5F;

struct Sight {
  bool hit = false;
  float red = 0.0F;
};

Sight seen(const Scene& scene, Vec3f origin, Vec3f direction) {
  const RayScene ray_scene(scene);
  RayPacket packet;
  packet.set(0, origin, normalized(direction), kFar, 0.0F);
  ray_scene.intersect_one(packet);
  ShadingInputs inputs{.scene = ray_scene, .sequence = SampleSequence(1)};
  alignas(64) LaneMask first = {-1};
  LaneColors colors;
  std::uint64_t rays = 0;
  shade(inputs, packet, first, colors, rays);
  return {.hit = packet.hit(0), .red = colors.get(0)[0]};
}

// Of a point of the plane z = -1, from a metre in front of it: diffuse light is the same for all.
float facing(const Scene& scene, float x, float y) {
  return seen(scene, {x, y, 0}, {0, 0, -1}).red;
}

Scene lit(const Mesh& mesh, Interpolation interpolation, const Material& material,
          Vec3 light = {0, 0, -1}) {
  Scene scene;
  scene.materials = {material};
  scene.objects = {{.shape = MeshObject{.interpolation = interpolation, .mesh = mesh}}};
  scene.lights = {{.kind = DirectionalLight{.direction = light}, .intensity = {1, 1, 1}}};
  return scene;
}

Material chalk() { return {.model = ShadingModel::phong, .diffuse = {.value = {1, 1, 1}}}; }

Material gloss(double shininess) {
  return {.model = ShadingModel::phong, .specular = {.value = {1, 1, 1}}, .shininess = shininess};
}

// A square of 2 m at z = -1 that faces +z: corners counter-clockwise from the lower left, cut along
// the diagonal of corners 0 and 2, or of 1 and 3.
Mesh square(bool other_diagonal = false) {
  Mesh mesh{.positions = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}},
            .normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}}};
  mesh.triangles.push_back({0, 1, other_diagonal ? 3U : 2U});
  mesh.triangles.push_back({other_diagonal ? 1U : 0U, 2, 3});
  return mesh;
}

TEST(Gouraud, LosesAHighlightInsideAPolygon) {
  // Seen from the origin R = (0,0,1). At the corners R.V = 1/sqrt 3, and its 90th power is nothing.
  for (const Interpolation kind : {Interpolation::gouraud, Interpolation::phong}) {
    const Sight middle = seen(lit(square(), kind, gloss(90.0)), {0, 0, 0}, {0, 0, -1});
    EXPECT_NEAR(middle.red, kind == Interpolation::phong ? 1.0F : 0.0F, kTolerance);
  }
}

TEST(Gouraud, SmearsAHighlightAtAVertexOverItsPolygons) {
  // The eye is above a corner, a half of the edge away from it the factor is a half; Phong has
  // (R.V)^90, where V = (-1, 0, 1)/sqrt 2.
  const Vec3f eye = {-1, -1, 0};
  EXPECT_NEAR(seen(lit(square(), Interpolation::gouraud, gloss(90.0)), eye, {1, 0, -1}).red, 0.5F,
              kTolerance);
  EXPECT_NEAR(seen(lit(square(), Interpolation::phong, gloss(90.0)), eye, {1, 0, -1}).red,
              std::pow(0.5F, 45.0F), kTolerance);
}

// Sides of a prism about the y axis, from y = -1 to 1, with the round cylinder's normals; a vertex
// lies in the direction `first` (radians from +z towards +x).
Mesh prism(int sides, double first, double radius = 1.0) {
  Mesh mesh;
  for (int i = 0; i < sides; ++i) {
    const double angle = first + 2.0 * pi * i / sides;
    const auto x = static_cast<float>(std::sin(angle));
    const auto z = static_cast<float>(std::cos(angle));
    for (const float y : {-1.0F, 1.0F}) {
      mesh.positions.push_back({static_cast<float>(radius) * x, y, static_cast<float>(radius) * z});
      mesh.normals.push_back({x, 0, z});
    }
    const auto a = static_cast<std::uint32_t>(2 * i);
    const auto b = static_cast<std::uint32_t>(2 * ((i + 1) % sides));
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
  }
  return mesh;
}

// By how much the slope of the light along the sides' outline, per metre, changes at the edge at
// angle `edge`: slopes over a tenth of a side.
constexpr double kReach = 0.1;
double slope_change(const Scene& scene, int sides, double edge) {
  const double step = 2.0 * pi / sides;
  const auto light_at = [&](double t) {  // t in sides from the edge
    const double other = edge + (t < 0.0 ? -step : step);
    const double share = std::abs(t);
    const auto x = static_cast<float>((1.0 - share) * std::sin(edge) + share * std::sin(other));
    const auto z = static_cast<float>((1.0 - share) * std::cos(edge) + share * std::cos(other));
    return double{seen(scene, {2.0F * x, 0.1F, 2.0F * z}, {-x, 0, -z}).red};
  };
  const double side = 2.0 * std::sin(0.5 * step);
  return (light_at(kReach) + light_at(-kReach) - 2.0 * light_at(0.0)) / (kReach * side);
}

TEST(Gouraud, HasMachBandsAtEdgesWherePhongHasNone) {
  // Light along -z: cos of the angle at a vertex, and between two of them linear. At the edge at
  // angle e the slope changes by (cos(e + d) + cos(e - d) - 2 cos e)/side = -2 cos e (1 - cos
  // d)/side. Phong's normal turns on, alike on both sides, by p with tan p = t sin d/(1 - t + t cos
  // d) in a share t of a side, and the light with it: no jump, but a bend that vanishes with t.
  constexpr int kSides = 12;
  const double d = 2.0 * pi / kSides;
  const double edge = d;
  const double side = 2.0 * std::sin(0.5 * d);
  const double p = std::atan(kReach * std::sin(d) / (1.0 - kReach + kReach * std::cos(d)));
  const auto change = [&](Interpolation kind) {
    return slope_change(lit(prism(kSides, 0.0), kind, chalk()), kSides, edge);
  };
  // Rounding of the light, 1e-6, over a tenth of a side of half a metre.
  constexpr double kRounding = 1e-4;
  EXPECT_NEAR(change(Interpolation::gouraud), -2.0 * std::cos(edge) * (1.0 - std::cos(d)) / side,
              kRounding);
  EXPECT_NEAR(change(Interpolation::phong),
              -2.0 * std::cos(edge) * (1.0 - std::cos(p)) / (kReach * side), kRounding);
}

TEST(InterpolatedShading, LeavesSilhouettesTheirCorners) {
  // Seen along z the outline of a prism with a side towards +x ends at cos(pi/n) of the radius,
  // smooth as it may look.
  constexpr int kSides = 8;
  const double end = std::cos(pi / kSides);
  for (const Interpolation kind :
       {Interpolation::flat, Interpolation::gouraud, Interpolation::phong}) {
    const Scene scene = lit(prism(kSides, pi / kSides), kind, chalk());
    const auto hit = [&](double x) {
      return seen(scene, {static_cast<float>(x), 0.1F, 3}, {0, 0, -1}).hit;
    };
    EXPECT_TRUE(hit(end - 1e-5));
    EXPECT_FALSE(hit(end + 1e-5));
  }
}

TEST(InterpolatedShading, IsLinearOnTheSurfaceNotInThePicture) {
  // A floor at y = -1 from z = -1, lit, to z = -3, dark. Half way between its ends' images,
  // y/|z| = 1 and 1/3, lies z = -1.5, a quarter of the way: 0.75, where the picture's own middle
  // would have 0.5.
  Mesh floor{.positions = {{-9, -1, -1}, {9, -1, -1}, {9, -1, -3}, {-9, -1, -3}},
             .normals = {{0, 1, 0}, {0, 1, 0}, {1, 0, 0}, {1, 0, 0}},
             .triangles = {{0, 1, 2}, {0, 2, 3}}};
  const Scene scene = lit(floor, Interpolation::gouraud, chalk(), {0, -1, 0});
  EXPECT_NEAR(seen(scene, {0, 0, 0}, {0, -2.0F / 3.0F, -1}).red, 0.75F, kTolerance);
}

// Two opposite corners lit, two dark.
Mesh saddle(bool other_diagonal) {
  Mesh mesh = square(other_diagonal);
  mesh.normals[1] = mesh.normals[3] = {1, 0, 0};
  return mesh;
}

TEST(InterpolatedShading, OfAQuadrilateralDependsOnItsDiagonal) {
  const auto middle = [](bool other_diagonal) {
    return facing(lit(saddle(other_diagonal), Interpolation::gouraud, chalk()), 0.0F, 0.0F);
  };
  EXPECT_NEAR(middle(false), 1.0F, kTolerance);
  EXPECT_NEAR(middle(true), 0.0F, kTolerance);
}

TEST(InterpolatedShading, OfTrianglesDoesNotDependOnTheirOrientation) {
  // Scan lines would interpolate other pairs of edges once the square is turned; corners' weights
  // are those of the triangle however it lies.
  const Mesh upright = saddle(false);
  for (const double turn : {0.3, 1.1, 2.0}) {
    const auto c = static_cast<float>(std::cos(turn));
    const auto s = static_cast<float>(std::sin(turn));
    Mesh turned = upright;
    for (auto* values : {&turned.positions, &turned.normals}) {
      for (auto& [x, y, z] : *values) std::tie(x, y) = std::pair(c * x - s * y, s * x + c * y);
    }
    for (const float x : {-0.7F, 0.1F, 0.4F}) {
      const float y = 0.25F;
      const float expected = facing(lit(upright, Interpolation::gouraud, chalk()), x, y);
      const float actual =
          facing(lit(turned, Interpolation::gouraud, chalk()), c * x - s * y, s * x + c * y);
      EXPECT_NEAR(actual, expected, kTolerance) << turn;
    }
  }
}

TEST(InterpolatedShading, BreaksAtAnEdgeWithAVertexOnOneSideOnly) {
  // Left of x = 0 one triangle, right of it two, which share a vertex in the middle of the edge.
  // The edge's ends have N.L = 0.6, that vertex 1: beside it the left is 0.6, the right 1.
  const Mesh mesh{
      .positions = {{-1, 0, -1}, {0, -1, -1}, {0, 1, -1}, {0, 0, -1}, {1, 0, -1}},
      .normals = {{0.8F, 0, 0.6F}, {0.8F, 0, 0.6F}, {0.8F, 0, 0.6F}, {0, 0, 1}, {0.8F, 0, 0.6F}},
      .triangles = {{0, 1, 2}, {1, 4, 3}, {3, 4, 2}}};
  for (const Interpolation kind : {Interpolation::gouraud, Interpolation::phong}) {
    const Scene scene = lit(mesh, kind, chalk());
    // A micrometre beside the edge: the light has changed by less than 1e-6 of itself.
    EXPECT_NEAR(facing(scene, -1e-6F, 0.0F), 0.6F, kTolerance);
    EXPECT_NEAR(facing(scene, 1e-6F, 0.0F), 1.0F, kTolerance);
  }
}

TEST(InterpolatedShading, FollowsNormalsThatMisrepresentTheSurface) {
  // Zigzag faces of +-45 degrees, light from 30 degrees beside +z: flat, the faces have cos 15 and
  // cos 75; averaged normals are all +z and leave cos 30.
  Mesh mesh;
  for (int i = 0; i < 9; ++i) {
    for (const float y : {-1.0F, 1.0F}) {
      mesh.positions.push_back({static_cast<float>(i) - 4.0F, y, i % 2 == 0 ? -2.0F : -1.0F});
    }
  }
  for (std::uint32_t a = 0; a < 16; a += 2) {
    mesh.triangles.push_back({a, a + 2, a + 3});
    mesh.triangles.push_back({a, a + 3, a + 1});
  }
  const double degree = pi / 180.0;
  const Vec3 light = {std::sin(30.0 * degree), 0, -std::cos(30.0 * degree)};
  const Scene flat = lit(mesh, Interpolation::flat, chalk(), light);
  const Scene smooth =
      lit(with_averaged_normals(mesh, 100.0 * degree), Interpolation::phong, chalk(), light);
  const auto cosine = [&](double degrees) {
    return static_cast<float>(std::cos(degrees * degree));
  };
  EXPECT_NEAR(facing(flat, -0.5F, 0.1F), cosine(75.0), kTolerance);
  EXPECT_NEAR(facing(flat, 0.5F, 0.1F), cosine(15.0), kTolerance);
  for (const float x : {-0.5F, 0.5F})
    EXPECT_NEAR(facing(smooth, x, 0.1F), cosine(30.0), kTolerance);
}

}  // namespace
}  // namespace fstop
