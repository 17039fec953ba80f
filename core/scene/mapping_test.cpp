#include "core/scene/mapping.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/scene/lane_surfaces.h"
#include "core/scene/ray_scene.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Uv {
  double u = 0.0;
  double v = 0.0;
};

// The definitions, in double precision.
Uv planar_uv(const PlanarMapping& m, Vec3 p) {
  // Cramer's rule for q = u edge_u + v edge_v + w n.
  const Vec3 q = p - m.origin;
  const Vec3 n = cross(m.edge_u, m.edge_v);
  const double volume = dot(cross(m.edge_u, m.edge_v), n);
  return {dot(cross(q, m.edge_v), n) / volume, dot(cross(m.edge_u, q), n) / volume};
}
template <typename Turned>
double longitude(const Turned& m, Vec3 q, Vec3 axis) {
  const Vec3 front = normalized(m.front - axis * dot(axis, m.front));
  const Vec3 right = cross(axis, front);
  return m.around * (0.5 + std::atan2(dot(q, right), dot(q, front)) / (2.0 * kPi));
}
Uv spherical_uv(const SphericalMapping& m, Vec3 p) {
  const Vec3 q = p - m.origin;
  const Vec3 axis = normalized(m.axis);
  return {longitude(m, q, axis), 0.5 + std::asin(dot(q, axis) / norm(q)) / kPi};
}
Uv cylindrical_uv(const CylindricalMapping& m, Vec3 p) {
  const Vec3 q = p - m.origin;
  const Vec3 axis = normalized(m.axis);
  return {longitude(m, q, axis), dot(q, axis) / m.height};
}

const PlanarMapping kPlanar{
    .origin = {0.3, -0.2, 0.1}, .edge_u = {0.5, 0.1, 0.2}, .edge_v = {-0.1, 0.8, 0.3}};
const SphericalMapping kSpherical{
    .origin = {0.1, 0.2, -0.3}, .axis = {1, 2, 0.5}, .front = {0.3, 0, 1}, .around = 3};
const CylindricalMapping kCylindrical{.origin = {-0.2, 0.1, 0.4},
                                      .axis = {0, 0, -2},
                                      .front = {1, 1, 0},
                                      .height = 0.25,
                                      .around = 2};

TEST(SurfaceMap, KnowsItsNamedPoints) {
  const SurfaceMap plane(PlanarMapping{.origin = {1, 0, 0}, .edge_u = {0, 0, -2}});
  EXPECT_EQ(plane.at({1, 0, 0}).u, 0.0F);
  EXPECT_EQ(plane.at({1, 0, -2}).u, 1.0F);
  EXPECT_EQ(plane.at({1, 0.25F, -3}).u, 1.5F);
  EXPECT_EQ(plane.at({7, 0.25F, -3}).v, 0.25F) << "projected along the normal";
  // The contract of a sphere: u = 1/2 + atan2(x, z)/2pi, v = 1/2 + asin(y)/pi.
  const SurfaceMap sphere(SphericalMapping{});
  EXPECT_EQ(sphere.at({0, 0, 2}).u, 0.5F);
  EXPECT_EQ(sphere.at({0, 0, 2}).v, 0.5F);
  EXPECT_NEAR(sphere.at({3, 0, 0}).u, 0.75F, 1e-7F);
  EXPECT_NEAR(sphere.at({-3, 0, 0}).u, 0.25F, 1e-7F);
  EXPECT_NEAR(sphere.at({0, 5, 0}).v, 1.0F, 1e-7F);
  EXPECT_NEAR(sphere.at({0, -5, 0}).v, 0.0F, 1e-7F);
  const SurfaceMap tube(CylindricalMapping{.origin = {0, 1, 0}, .height = 0.5, .around = 4});
  EXPECT_EQ(tube.at({0, 1, 2}).u, 2.0F);
  EXPECT_NEAR(tube.at({2, 1, 0}).u, 3.0F, 1e-6F);
  EXPECT_EQ(tube.at({2, 2, 0}).v, 2.0F);
}

// Coordinates of up to 4 m round by 2^-24 of them a few times, which moves uv by its gradient;
// angles err by 3e-7 of a radian, of which `turns` make a unit.
template <typename Map, typename UvOf>
void expect_definition(const Map& map, const UvOf& uv_of, double turns) {
  const SurfaceMap surface_map{Mapping(map)};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-2, 2);
  int compared = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3f p = to_float({place(random), place(random), place(random)});
    const Vec3 exact{double{p.x}, double{p.y}, double{p.z}};
    const UvPoint point = surface_map.at(p);
    const Uv expected = uv_of(exact);
    const auto bound = [&](Vec3f gradient) {
      return 8 * 0x1p-24 * 4.0 * double{norm(gradient)} + 3e-7 * turns;
    };
    EXPECT_NEAR(double{point.u}, expected.u, bound(point.du)) << i;
    EXPECT_NEAR(double{point.v}, expected.v, bound(point.dv)) << i;
    if (norm(point.du) > 4.0F || norm(point.dv) > 4.0F) continue;  // near the axis
    // Central differences err by step^2/6 of the third derivative: below 1e-6 here.
    constexpr double kStep = 1e-4;
    for (const Vec3 e : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
      const Uv more = uv_of(exact + e * kStep);
      const Uv less = uv_of(exact - e * kStep);
      if (std::abs(more.u - less.u) > 0.5) continue;  // across the seam
      EXPECT_NEAR(dot(point.du, to_float(e)), (more.u - less.u) / (2 * kStep), 1e-5) << i;
      EXPECT_NEAR(dot(point.dv, to_float(e)), (more.v - less.v) / (2 * kStep), 1e-5) << i;
      ++compared;
    }
  }
  EXPECT_GT(compared, 5000);
}

TEST(SurfaceMap, IsItsDefinitionAndItsGradients) {
  expect_definition(
      kPlanar, [](Vec3 p) { return planar_uv(kPlanar, p); }, 0.0);
  expect_definition(
      kSpherical, [](Vec3 p) { return spherical_uv(kSpherical, p); }, 3.0);
  expect_definition(
      kCylindrical, [](Vec3 p) { return cylindrical_uv(kCylindrical, p); }, 2.0);
}

// A unit square of uv covers |e_u x e_v| of the plane and 1/cos of it on a surface that leans; of a
// sphere, 2 pi r cos(latitude) times pi r.
TEST(SurfaceMap, RatesAreTheRatioOfAreas) {
  const PlanarMapping plane{.edge_u = {0.5, 0, 0}, .edge_v = {0, 0.2, 0}};
  const UvPoint flat = SurfaceMap(plane).at({3, 4, 5});
  EXPECT_NEAR(uv_rate(flat, {0, 0, 1}), std::sqrt(10.0), 1e-5);
  EXPECT_NEAR(uv_rate(flat, {0, 0.6F, 0.8F}), std::sqrt(10.0 * 0.8), 1e-5);
  EXPECT_NEAR(uv_rate(flat, {0, 0.6F, -0.8F}), std::sqrt(10.0 * 0.8), 1e-5) << "on either side";
  for (const double latitude : {0.0, 0.5, -1.2}) {
    const Vec3f n = to_float({std::cos(latitude), std::sin(latitude), 0.0});
    const UvPoint point = SurfaceMap(SphericalMapping{.around = 2}).at(n * 3.0F);
    const double area = 2.0 * kPi * 3.0 * std::cos(latitude) / 2.0 * (kPi * 3.0);
    EXPECT_NEAR(uv_rate(point, n), 1.0 / std::sqrt(area), 1e-6) << latitude;
  }
}

TEST(SurfaceMap, IsFiniteWhereItHasNoDirection) {
  for (const Mapping& mapping : {Mapping(SphericalMapping{}), Mapping(CylindricalMapping{})}) {
    const SurfaceMap map(mapping);
    for (const Vec3f p : {Vec3f{0, 0, 0}, Vec3f{0, 1, 0}, Vec3f{0, -1e7F, 0}, Vec3f{1e-30F, 1, 0},
                          Vec3f{-0.0F, 0, -1}, Vec3f{1e7F, 1e7F, -1e7F}}) {
      const UvPoint point = map.at(p);
      for (const float x : {point.u, point.v, point.du.x, point.du.y, point.du.z, point.dv.x,
                            point.dv.y, point.dv.z, uv_rate(point, {0, 1, 0})}) {
        EXPECT_TRUE(std::isfinite(x)) << p.x << " " << p.y << " " << p.z;
      }
    }
  }
  EXPECT_EQ(SurfaceMap(SphericalMapping{}).at({0, 0, 0}).u, 0.5F);
}

TEST(SurfaceMap, RefusesWhatHasNoMap) {
  const Mapping rows[] = {
      PlanarMapping{.edge_u = {0, 0, 0}},
      PlanarMapping{.edge_u = {1, 0, 0}, .edge_v = {-3, 0, 0}},
      PlanarMapping{.edge_u = {1e-7, 0, 0}},
      PlanarMapping{.origin = {kNan, 0, 0}},
      PlanarMapping{.edge_v = {0, 1e8, 0}},
      SphericalMapping{.axis = {0, 0, 0}},
      SphericalMapping{.front = {0, 0, 0}},
      SphericalMapping{.axis = {0, 0, 3}},
      SphericalMapping{.axis = {kNan, 1, 0}},
      SphericalMapping{.around = 0},
      CylindricalMapping{.height = 0.0},
      CylindricalMapping{.height = kNan},
      CylindricalMapping{.around = 1001},
  };
  int number = 0;
  for (const Mapping& mapping : rows) {
    EXPECT_THROW(SurfaceMap{mapping}, Error) << number;
    Scene scene;
    scene.materials = {Material{}};
    scene.objects = {{.shape = SphereObject{}, .mapping = mapping}};
    EXPECT_THROW(RayScene{scene}, Error) << number++;
  }
}

// Spheres and triangles of several objects in one packet, resting and moving; some have their own
// coordinates.
TEST(LaneSurfaces, AgreeWithSingleSurfacesOfMappedObjects) {
  Scene scene;
  scene.textures = {{.name = "card", .image = Image(4, 4, 3)}};
  scene.materials = {Material{.emission = {.value = {1, 1, 1}, .texture = 0}}};
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-1, 1);
  const Mapping mappings[] = {kPlanar, kSpherical, kCylindrical, OwnMapping{}};
  for (int i = 0; i < 24; ++i) {
    const Vec3 at{place(random), place(random), place(random) - 4.0};
    Object object{.shape = SphereObject{.center = at, .radius = 0.25},
                  .velocity = {i % 3 == 0 ? 0.5 : 0.0, 0.0, 0.0},
                  .mapping = mappings[i % 4]};
    if (i % 2 == 0) object.shape = QuadObject{at, {0.7, 0.1, 0.1}, {-0.1, 0.8, 0.2}};
    scene.objects.push_back(object);
  }
  const RayScene ray_scene(scene);
  int mapped = 0;
  for (int i = 0; i < 1000; ++i) {
    RayPacket packet;
    const double spread = i % 2 == 0 ? 0.3 : 0.01;
    const Vec3 middle{0.25 * place(random), 0.25 * place(random), -1.0};
    for (int lane = 0; lane < kLanes; ++lane) {
      const Vec3 direction = middle + Vec3{spread * place(random), spread * place(random), 0.0};
      packet.set(lane, {0, 0, 0}, to_float(normalized(direction)), kFar,
                 static_cast<float>(0.5 * (1.0 + place(random)) / kLongestShutter));
    }
    alignas(64) LaneMask valid;
    valid.fill(-1);
    ray_scene.intersect(packet, valid, Coherence::incoherent);
    LaneSurfaces lanes;
    ray_scene.surfaces(packet, valid, lanes);
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (!packet.hit(static_cast<int>(k))) continue;
      const Surface one = ray_scene.surface(packet, static_cast<int>(k));
      // Hit points differ by 2e-6 m at most; uv by that times the gradient, of 1/0.2 m about.
      EXPECT_NEAR(lanes.u[k], one.u, 2e-4F);
      EXPECT_NEAR(lanes.v[k], one.v, 2e-4F);
      EXPECT_NEAR(lanes.uv_per_metre[k], one.uv_per_metre, 1e-3F * (1.0F + one.uv_per_metre));
      const Mapping& mapping = scene.objects[one.object].mapping;
      if (!maps_by_position(mapping)) continue;
      ++mapped;
      const Vec3f rest = one.position - one.shift;
      EXPECT_NEAR(one.u, SurfaceMap(mapping).at(rest).u, 1e-5F) << "moves with the object";
    }
  }
  EXPECT_GT(mapped, 2000);
}

}  // namespace
}  // namespace fstop
