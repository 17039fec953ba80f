#include "core/scene/ray_scene.h"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <stop_token>
#include <utility>

#include <gtest/gtest.h>

#include "core/build_stop.h"
#include "core/error.h"

namespace fstop {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kPi = std::numbers::pi;

Scene scene_of(std::vector<Object> objects, std::vector<Material> materials = {Material{}}) {
  Scene scene;
  scene.objects = std::move(objects);
  scene.materials = std::move(materials);
  return scene;
}

Object sphere(Vec3 center, double radius, Vec3 velocity = {}) {
  return {.shape = SphereObject{.center = center, .radius = radius}, .velocity = velocity};
}
Object quad(Vec3 corner, Vec3 edge_u, Vec3 edge_v, int material = 0) {
  return {.shape = QuadObject{.corner = corner, .edge_u = edge_u, .edge_v = edge_v},
          .material = material};
}
Object mesh(Mesh triangles, Interpolation interpolation = Interpolation::phong) {
  return {.shape = MeshObject{
              .file = "mesh.obj", .interpolation = interpolation, .mesh = std::move(triangles)}};
}
// A right angle of two metres at (0, 0, -3), facing +z.
Mesh one_triangle() {
  return {.positions = {{0, 0, -3}, {2, 0, -3}, {0, 2, -3}}, .triangles = {{0, 1, 2}}};
}

TEST(BuildStop, ScenesAreGivenUpOnceItIsAskedForAndNotBefore) {
  std::stop_source source;
  const auto is_given_up = [] {
    try {
      const RayScene scene(scene_of({mesh(one_triangle())}));
      return false;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::cancelled);
      return true;
    }
  };
  {
    const BuildStop outer(source.get_token());
    EXPECT_FALSE(is_given_up());
    source.request_stop();
    EXPECT_TRUE(is_given_up());
    const BuildStop inner{std::stop_token()};
    EXPECT_FALSE(is_given_up()) << "the newest counts";
  }
  EXPECT_FALSE(is_given_up()) << "it ends with its block";
}

struct Hit {
  float distance = 0.0F;
  Surface surface = {};
};

std::optional<Hit> first_hit(const RayScene& scene, Vec3 origin, Vec3 towards,
                             double seconds = 0.0) {
  RayPacket packet;
  packet.set(0, to_float(origin), to_float(normalized(towards - origin)), kFar,
             static_cast<float>(seconds / kLongestShutter));
  scene.intersect_one(packet);
  if (!packet.hit(0)) return std::nullopt;
  return Hit{.distance = packet.far[0], .surface = scene.surface(packet, 0)};
}

double distance(Vec3f a, Vec3 b) { return norm(Vec3{a.x, a.y, a.z} - b); }

// Where a line meets a sphere first, in double precision.
Vec3 first_on_sphere(Vec3 origin, Vec3 towards, Vec3 center, double radius) {
  const Vec3 d = normalized(towards - origin);
  const double b = dot(d, center - origin);
  const double c = dot(center - origin, center - origin) - radius * radius;
  return origin + d * (b - std::sqrt(b * b - c));
}

// The ray itself is rounded: its direction by 2^-24 a component over the distance, and at a slant
// the point slides along the surface by that over the cosine.
double ray_rounding(const Hit& hit, Vec3 origin, Vec3 towards) {
  const Vec3f n = hit.surface.geometric_normal;
  const double cosine = std::abs(dot(Vec3{n.x, n.y, n.z}, normalized(towards - origin)));
  return (norm(origin) + 2.0 * hit.distance) * 0x1p-24 * 2.0 / cosine;
}

TEST(RayScene, HitsASphereWhereTheQuadraticSays) {
  const Vec3 center{0.3, -0.2, -5};
  const RayScene scene(scene_of({sphere(center, 0.7)}));
  for (const Vec3 origin : {Vec3{0, 0, 0}, Vec3{1.5, 1, -3}, Vec3{-4, -2, -9}}) {
    for (const Vec3 target : {Vec3{0.3, -0.2, -5}, Vec3{0.5, 0.1, -4.9}, Vec3{0, -0.5, -5.2}}) {
      const auto hit = first_hit(scene, origin, target);
      ASSERT_TRUE(hit);
      const Vec3 expected = first_on_sphere(origin, target, center, 0.7);
      const double bound = hit->surface.error + ray_rounding(*hit, origin, target);
      EXPECT_LE(distance(hit->surface.position, expected), bound);
      EXPECT_NEAR(hit->distance, norm(expected - origin), bound);
      // The normal turns by the point's error over the radius.
      const Vec3 normal = (expected - center) * (1.0 / 0.7);
      EXPECT_LE(distance(hit->surface.geometric_normal, normal), bound / 0.7 + 2e-7);
      EXPECT_EQ(hit->surface.shading_normal, hit->surface.geometric_normal);
      EXPECT_TRUE(hit->surface.from_outside);
    }
  }
  EXPECT_FALSE(first_hit(scene, {0, 0, 0}, {0.3, 0.6, -5}));
  EXPECT_FALSE(first_hit(scene, {0, 0, 0}, {0, 0, 5}));
}

TEST(RayScene, SphereSeenFromInsideTurnsItsNormal) {
  const RayScene scene(scene_of({sphere({0, 0, 0}, 2.0)}));
  const auto hit = first_hit(scene, {0, 0, 0}, {1, 0, 0});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance, 2.0, hit->surface.error);
  EXPECT_LE(distance(hit->surface.geometric_normal, {-1, 0, 0}), 1e-6);
  EXPECT_EQ(hit->surface.shading_normal, hit->surface.geometric_normal);
  EXPECT_FALSE(hit->surface.from_outside);
  for (const Corner& corner : scene.corners(hit->surface)) {
    EXPECT_EQ(corner.position, hit->surface.position);
    EXPECT_EQ(corner.normal, hit->surface.shading_normal);
  }
}

// u = 1/2 + atan2(x, z)/2pi, v = 1/2 + asin(y)/pi of the outward normal.
TEST(RayScene, SphereCoordinatesAreThoseOfTheContract) {
  const Vec3 center{1, 2, -3};
  const RayScene scene(scene_of({sphere(center, 0.5)}));
  for (const Vec3 n : {Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{-1, 0, 0}, Vec3{0.6, 0, -0.8},
                       Vec3{0, 0.6, 0.8}, Vec3{0.48, -0.6, 0.64}}) {
    const auto hit = first_hit(scene, center + n * 2.0, center);
    ASSERT_TRUE(hit);
    // The point's relative error over the radius, 3e-6 m/0.5 m, over pi.
    EXPECT_NEAR(hit->surface.u, 0.5 + std::atan2(n.x, n.z) / (2 * kPi), 3e-6);
    EXPECT_NEAR(hit->surface.v, 0.5 + std::asin(n.y) / kPi, 3e-6);
  }
  // One turn over 2 pi r, half a turn over pi r: the root of the product.
  const auto hit = first_hit(scene, {1, 2, 0}, center);
  EXPECT_NEAR(hit->surface.uv_per_metre, 1.0 / (std::sqrt(2.0) * kPi * 0.5), 1e-7);
}

TEST(RayScene, QuadIsHitAtItsPointWithCoordinatesAlongItsEdges) {
  const Vec3 corner{-1, -2, -6};
  const Vec3 edge_u{2, 0, 0.25};
  const Vec3 edge_v{0.5, 3, 0};
  const RayScene scene(scene_of({quad(corner, edge_u, edge_v)}));
  const Vec3 origin{0.1, 0.2, 1};
  for (const double u : {0.01, 0.25, 0.5, 0.7, 0.99}) {
    for (const double v : {0.01, 0.3, 0.5, 0.99}) {
      const Vec3 target = corner + edge_u * u + edge_v * v;
      const auto hit = first_hit(scene, origin, target);
      ASSERT_TRUE(hit) << u << ", " << v;
      const double bound = hit->surface.error + ray_rounding(*hit, origin, target);
      EXPECT_LE(distance(hit->surface.position, target), bound);
      EXPECT_NEAR(hit->distance, norm(target - origin), bound);
      EXPECT_NEAR(hit->surface.u, u, bound / 2.0 * 1.1);  // the edge is 2 m long, a bit aslant
      EXPECT_NEAR(hit->surface.v, v, bound / 3.0 * 1.1);
      EXPECT_NEAR(hit->surface.uv_per_metre, 1.0 / std::sqrt(norm(cross(edge_u, edge_v))), 1e-6);
    }
  }
  for (const auto& [u, v] : {std::pair{-0.01, 0.5}, {1.01, 0.5}, {0.5, -0.01}, {0.5, 1.01}}) {
    EXPECT_FALSE(first_hit(scene, origin, corner + edge_u * u + edge_v * v)) << u << ", " << v;
  }
}

TEST(RayScene, NormalsAreOnTheRaysSide) {
  // Its edges turn anticlockwise seen from +z.
  const RayScene scene(scene_of({quad({-1, -1, -3}, {2, 0, 0}, {0, 2, 0})}));
  for (const float side : {1.0F, -1.0F}) {
    const auto hit = first_hit(scene, {0.2, 0.3, -3.0 + 3.0 * side}, {0.2, 0.3, -3});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->surface.geometric_normal, (Vec3f{0, 0, side}));
    EXPECT_EQ(hit->surface.shading_normal, (Vec3f{0, 0, side}));
    EXPECT_EQ(hit->surface.from_outside, side > 0.0F);
  }
}

TEST(RayScene, MeshInterpolatesCoordinatesAndNormals) {
  Mesh triangle = one_triangle();
  triangle.uvs = {{0.25F, 0.5F}, {0.75F, 0.5F}, {0.25F, 1.0F}};
  triangle.normals = {{0, 0, 1}, {0.6F, 0, 0.8F}, {0, 0.6F, 0.8F}};
  const RayScene scene(scene_of({mesh(triangle)}));
  const Vec3 target{0.5, 1.2, -3};  // weights 0.15, 0.25, 0.6
  const auto hit = first_hit(scene, {0.1, 0.1, 0}, target);
  ASSERT_TRUE(hit);
  // Ten roundings of 2^-24 of coordinates up to 3.
  EXPECT_LE(distance(hit->surface.position, target), 2e-6);
  EXPECT_NEAR(hit->surface.b1, 0.25, 1e-6);
  EXPECT_NEAR(hit->surface.b2, 0.6, 1e-6);
  EXPECT_NEAR(hit->surface.u, 0.25 + 0.5 * 0.25, 1e-6);
  EXPECT_NEAR(hit->surface.v, 0.5 + 0.5 * 0.6, 1e-6);
  EXPECT_EQ(hit->surface.geometric_normal, (Vec3f{0, 0, 1}));
  EXPECT_LE(distance(hit->surface.shading_normal, normalized(Vec3{0.15, 0.36, 0.83})), 1e-6);
  // The uv triangle has 1/16 of the area of the triangle's 2 m^2.
  EXPECT_NEAR(hit->surface.uv_per_metre, 0.25, 1e-6);
  // From behind both normals turn together.
  const auto behind = first_hit(scene, {0.1, 0.1, -6}, target);
  ASSERT_TRUE(behind);
  EXPECT_LE(distance(behind->surface.shading_normal, normalized(Vec3{-0.15, -0.36, -0.83})), 2e-6);
}

TEST(RayScene, CornersHaveVertexNormalsOnTheRaysSide) {
  Mesh triangle = one_triangle();
  triangle.normals = {{0, 0, 2}, {0.6F, 0, 0.8F}, {0, -0.6F, -0.8F}};  // one long, one inwards
  const RayScene scene(scene_of({mesh(triangle, Interpolation::gouraud)}));
  for (const double side : {1.0, -1.0}) {
    const auto hit = first_hit(scene, {0.5, 0.5, -3 + 3 * side}, {0.5, 0.5, -3});
    ASSERT_TRUE(hit);
    const auto corners = scene.corners(hit->surface);
    EXPECT_EQ(corners[0].position, (Vec3f{0, 0, -3}));
    EXPECT_EQ(corners[1].position, (Vec3f{2, 0, -3}));
    EXPECT_EQ(corners[2].position, (Vec3f{0, 2, -3}));
    EXPECT_LE(distance(corners[0].normal, Vec3{0, 0, 1} * side), 2e-7);
    EXPECT_LE(distance(corners[1].normal, Vec3{0.6, 0, 0.8} * side), 2e-7);
    EXPECT_LE(distance(corners[2].normal, Vec3{0, 0.6, 0.8} * side), 2e-7);
  }
}

// `error` is the distance at which a new ray no longer meets the surface it leaves.
TEST(RayScene, RaysThatLeaveASurfaceDoNotMeetItAgain) {
  const RayScene scene(
      scene_of({sphere({30, -20, 50}, 0.5), quad({-9, -2, 40}, {20, 0, 1}, {0, 30, 2})}));
  std::mt19937 random(4);
  std::uniform_real_distribution<double> offset(-0.45, 0.45);
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 target = i % 2 == 0 ? Vec3{30 + offset(random), -20 + offset(random), 50}
                                   : Vec3{0.5 + offset(random) * 18, 14 + offset(random) * 18, 41};
    const auto hit = first_hit(scene, {5, 10, -100}, target);
    if (!hit) continue;
    ++hits;
    const Surface& s = hit->surface;
    const Vec3f start = s.position + s.geometric_normal * s.error;
    const Vec3f tangent = normalized(cross(s.geometric_normal, {0.3F, 0.8F, 0.5F}));
    RayPacket packet;
    packet.set(0, start, normalized(s.geometric_normal + tangent * 3.0F), kFar, 0.0F);
    scene.intersect_one(packet);
    ASSERT_FALSE(packet.hit(0) && packet.object[0] == s.object) << i;
  }
  EXPECT_GT(hits, 1500);
}

Material sheet(double transmission, std::optional<double> ior = {}) {
  return {.transmission = transmission, .ior = ior};
}

// Sheets at z = -1, -2, -3, ... of the given materials.
RayScene stack_of(const std::vector<Material>& materials) {
  std::vector<Object> objects;
  for (int i = 0; i < static_cast<int>(materials.size()); ++i) {
    objects.push_back(quad({-1, -1, -1.0 - i}, {2, 0, 0}, {0, 2, 0}, i));
  }
  return RayScene(scene_of(std::move(objects), materials));
}

float passed(const RayScene& scene, float distance) {
  return scene.transmittance({0.1F, 0.2F, 0}, {0, 0, -1}, distance, 0.0F);
}

TEST(Transmittance, IsTheProductOfTheSheets) {
  const RayScene scene = stack_of({sheet(0.5), sheet(0.8), sheet(0.25)});
  EXPECT_TRUE(scene.has_thin_sheets());
  EXPECT_EQ(passed(scene, 0.5F), 1.0F);
  EXPECT_EQ(passed(scene, 1.5F), 0.5F);
  EXPECT_FLOAT_EQ(passed(scene, 2.5F), 0.4F);
  EXPECT_FLOAT_EQ(passed(scene, 3.5F), 0.1F);
  EXPECT_FLOAT_EQ(passed(scene, kFar), 0.1F);
}

TEST(Transmittance, IsZeroBehindAnythingElse) {
  EXPECT_EQ(passed(stack_of({sheet(0.5), Material{}}), kFar), 0.0F);
  EXPECT_EQ(passed(stack_of({sheet(0.5), sheet(0.9, 1.5)}), kFar), 0.0F);  // refracts
  EXPECT_EQ(passed(stack_of({sheet(0.5), Material{}}), 1.5F), 0.5F);
  EXPECT_FALSE(stack_of({Material{}, sheet(0.9, 1.5)}).has_thin_sheets());
}

TEST(Transmittance, PassesBothWallsOfAThinSphere) {
  const RayScene scene(scene_of({sphere({0, 0, -5}, 1.0)}, {sheet(0.5)}));
  EXPECT_FLOAT_EQ(passed(scene, 5.0F), 0.5F);
  EXPECT_FLOAT_EQ(passed(scene, kFar), 0.25F);
}

TEST(RayScene, MovingObjectsAreWhereTheyAreAtTheTime) {
  const Vec3 velocity{2, 0, -1};  // metres per second
  const RayScene scene(scene_of({sphere({0, 0, -5}, 0.5, velocity)}));
  EXPECT_TRUE(scene.moves());
  for (const double seconds : {0.0, 0.5, 1.0, 10.0}) {
    const Vec3 center = Vec3{0, 0, -5} + velocity * seconds;
    const auto hit = first_hit(scene, {0, 0, 0}, center, seconds);
    ASSERT_TRUE(hit) << seconds;
    const Vec3 expected = first_on_sphere({0, 0, 0}, center, center, 0.5);
    // The end of the motion, 128 m away, is rounded to 8e-6 m, of which the time takes its share.
    const double bound = hit->surface.error + 8e-6 * (seconds / 64) + 8e-6;
    EXPECT_LE(distance(hit->surface.position, expected), bound) << seconds;
    EXPECT_NEAR(hit->distance, norm(expected), bound) << seconds;
  }
  EXPECT_FALSE(first_hit(scene, {0, 0, 0}, {0, 0, -5}, 1.0));
}

TEST(RayScene, MovingMeshesMoveWithTheirCorners) {
  Object moving = mesh(one_triangle(), Interpolation::gouraud);
  moving.velocity = {0, 4, 0};
  const RayScene scene(scene_of({moving}));
  const auto hit = first_hit(scene, {0.5, 2.5, 0}, {0.5, 2.5, -3}, 0.5);  // two metres higher
  ASSERT_TRUE(hit);
  EXPECT_LE(distance(hit->surface.position, {0.5, 2.5, -3}), 2e-5);  // 256 m rounded to 2^-24
  EXPECT_FALSE(first_hit(scene, {0.5, 2.5, 0}, {0.5, 2.5, -3}, 0.0));
  const auto corners = scene.corners(hit->surface);
  EXPECT_LE(distance(corners[0].position, {0, 2, -3}), 2e-5);
  EXPECT_LE(distance(corners[2].position, {0, 4, -3}), 2e-5);
}

// Many spheres and a mesh, for rays in all directions.
RayScene crowd() {
  std::vector<Object> objects = {mesh(one_triangle()),
                                 quad({-20, -3, -20}, {40, 0, 0}, {0, 0, 40})};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-10, 10);
  for (int i = 0; i < 60; ++i) {
    objects.push_back(sphere({place(random), place(random), place(random)}, 0.8));
  }
  return RayScene(scene_of(std::move(objects)));
}

void expect_packets_of_single_rays(const RayScene& scene) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  int hits = 0;
  for (int repeat = 0; repeat < 500; ++repeat) {
    RayPacket packet;
    alignas(64) LaneMask valid = {};
    for (int i = 0; i < kLanes; ++i) {
      const Vec3 direction{normal(random), -1.5 + normal(random), normal(random)};
      packet.set(i, to_float({normal(random), 12 + normal(random), normal(random)}),
                 to_float(normalized(direction)), 25.0F, 0.0F);
      valid[static_cast<std::size_t>(i)] = (repeat + i) % 5 == 0 ? 0 : -1;
    }
    const auto coherence = repeat % 2 == 0 ? Coherence::coherent : Coherence::incoherent;
    const RayPacket rays = packet;
    RayPacket shadows = packet;
    scene.intersect(packet, valid, coherence);
    scene.occlude(shadows, valid, coherence);
    for (int i = 0; i < kLanes; ++i) {
      const auto k = static_cast<std::size_t>(i);
      RayPacket single;
      single.set(0, rays.origin(i), rays.direction(i), 25.0F, 0.0F);
      if (valid[k] != 0) scene.intersect_one(single);  // else nothing is traced
      ASSERT_EQ(packet.hit(i), single.hit(0));
      ASSERT_EQ(shadows.far[k], single.hit(0) ? -kFar : 25.0F);
      if (!packet.hit(i)) continue;
      ++hits;
      ASSERT_EQ(packet.object[k], single.object[0]);
      ASSERT_EQ(packet.primitive[k], single.primitive[0]);
      // The kernels round differently: by what `error` allows, at a slant by its square root.
      ASSERT_NEAR(packet.far[k], single.far[0], 1e-3F);
      const Vec3f apart = scene.surface(packet, i).position - scene.surface(single, 0).position;
      ASSERT_LE(norm(apart), 1e-3F);
    }
  }
  EXPECT_GT(hits, 2500);
}

TEST(RayScene, PacketsAgreeWithSingleRays) { expect_packets_of_single_rays(crowd()); }

// Where Embree has packets of eight alone, and where it has none but of four.
TEST(RayScene, PacketsAgreeWithSingleRaysOnSmallerMachines) {
  for (const char* machine : {"isa=avx2", "isa=sse4.2"}) {
    setenv("FSTOP_EMBREE", machine, 1);
    const RayScene scene = crowd();
    unsetenv("FSTOP_EMBREE");
    SCOPED_TRACE(machine);
    expect_packets_of_single_rays(scene);
  }
}

// The unit sphere around `center` as triangles between circles of latitude and of longitude.
Mesh globe(Vec3f center, std::uint32_t circles) {
  Mesh result;
  for (std::uint32_t row = 0; row <= circles; ++row) {
    for (std::uint32_t column = 0; column < circles; ++column) {
      const double latitude = kPi * (double(row) / circles - 0.5);
      const double longitude = 2.0 * kPi * column / circles;
      const Vec3f p =
          center + to_float({std::cos(latitude) * std::cos(longitude),
                             std::cos(latitude) * std::sin(longitude), std::sin(latitude)});
      result.positions.push_back({p.x, p.y, p.z});
      if (row == circles) continue;
      const std::uint32_t right = row * circles + (column + 1) % circles;
      const std::uint32_t here = row * circles + column;
      result.triangles.push_back({here, right, right + circles});
      result.triangles.push_back({here, right + circles, here + circles});
    }
  }
  return result;
}

// No light leaks between triangles: half of the rays are aimed at edges, half anywhere. (Of rays
// aimed at a vertex itself Embree loses one in a thousand: its edges round differently.)
TEST(RayScene, ClosedMeshIsWatertight) {
  const Vec3f center{10, -3, 7};
  const Mesh ball = globe(center, 60);
  const RayScene scene(scene_of({mesh(ball)}));
  std::mt19937 random(7);
  std::uniform_real_distribution<float> within(-0.3F, 0.3F);
  std::uniform_real_distribution<float> share(0.0F, 1.0F);
  const auto corner = [&](std::size_t triangle, std::size_t k) {
    const auto& p = ball.positions[ball.triangles[triangle][k]];
    return Vec3f{p[0], p[1], p[2]};
  };
  alignas(64) LaneMask all;
  all.fill(-1);
  RayPacket packet;
  int escaped = 0;
  for (int ray = 0; ray < 1'000'000; ray += kLanes) {
    for (int i = 0; i < kLanes; ++i) {
      const Vec3f origin = center + Vec3f{within(random), within(random), within(random)};
      const std::size_t t = random() % ball.triangles.size();
      const Vec3f a = corner(t, 0);
      const Vec3f b = corner(t, 1);
      const Vec3f on_edge = a + (b - a) * share(random);
      const Vec3f inside = on_edge + (corner(t, 2) - on_edge) * share(random);
      const Vec3f target = i % 2 == 0 ? on_edge : inside;
      packet.set(i, origin, normalized(target - origin), kFar, 0.0F);
    }
    scene.intersect(packet, all, Coherence::incoherent);
    for (int i = 0; i < kLanes; ++i) escaped += packet.hit(i) ? 0 : 1;
  }
  EXPECT_EQ(escaped, 0);
}

ErrorCode refusal(const Object& object) {
  try {
    const RayScene scene(scene_of({object}));
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::internal;
}

TEST(RayScene, RefusesBadMeshes) {
  Mesh empty = one_triangle();
  empty.triangles.clear();
  EXPECT_EQ(refusal(mesh(empty)), ErrorCode::bad_geometry);
  Mesh out_of_range = one_triangle();
  out_of_range.triangles.push_back({0, 1, 3});
  EXPECT_EQ(refusal(mesh(out_of_range)), ErrorCode::bad_geometry);
  for (const float bad : {kNan, kFar, 2e7F, -2e7F}) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Mesh not_finite = one_triangle();
      not_finite.positions[1][axis] = bad;
      EXPECT_EQ(refusal(mesh(not_finite)), ErrorCode::bad_geometry) << bad << " on axis " << axis;
    }
  }
}

TEST(RayScene, RefusesBadQuadsSpheresAndMotion) {
  const std::vector<Object> bad = {quad({0, 0, 0}, {1, 0, 0}, {0, 0, 0}),
                                   quad({0, 0, 0}, {1, 2, 3}, {-2, -4, -6}),
                                   quad({kNan, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                                   quad({0, 0, 0}, {1, kNan, 0}, {0, 1, 0}),
                                   quad({0, 0, 0}, {1, 0, 0}, {0, 1e8, 0}),
                                   sphere({0, 0, -5}, 0.0),
                                   sphere({0, 0, -5}, -1.0),
                                   sphere({0, 0, -5}, kNan),
                                   sphere({0, 0, -5}, 1e8),
                                   sphere({0, kNan, 0}, 1.0),
                                   sphere({0, 0, 0}, 1.0, {0, 0, kNan}),
                                   sphere({0, 0, 0}, 1.0, {0, 1e6, 0})};
  for (std::size_t i = 0; i < bad.size(); ++i) {
    EXPECT_EQ(refusal(bad[i]), ErrorCode::bad_geometry) << "object " << i;
  }
}

TEST(RayScene, EmptySceneIsLegal) {
  const RayScene scene(scene_of({}));
  EXPECT_FALSE(first_hit(scene, {0, 0, 0}, {0, 0, -1}));
  EXPECT_FALSE(scene.moves());
  EXPECT_FALSE(scene.has_thin_sheets());
}

}  // namespace
}  // namespace fstop
