#include "core/shading/relief.h"

#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/shading/ray_tree.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kTexels = 512;
constexpr double kWaves = 2.0;       // of the height, over a metre
constexpr double kAmplitude = 0.03;  // metres: slopes to 0.377, tilts to 20.6 degrees

// A texture of one row, or column, whose texel centres have the values of `value`.
template <typename Value>
TextureSource texture_of(int width, int height, const Value& value) {
  TextureSource source{
      .name = "relief", .color_space = ColorSpace::linear, .filter = TextureFilter::bilinear};
  source.image = Image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vec3 c = value((x + 0.5) / width, 1.0 - (y + 0.5) / height);
      float* const p = source.image.at(x, y);
      p[0] = static_cast<float>(c.x);
      p[1] = static_cast<float>(c.y);
      p[2] = static_cast<float>(c.z);
    }
  }
  return source;
}
TextureSource constant(Vec3 value) {
  return texture_of(2, 2, [&](double, double) { return value; });
}

double slope_at(double x) { return kAmplitude * 2 * kPi * kWaves * std::cos(2 * kPi * kWaves * x); }

// Heights a sin(kx) between 0 and 2a, and normals of the same slope.
TextureSource sine_heights() {
  return texture_of(kTexels, 1, [](double u, double) {
    const double h = 0.5 + 0.5 * std::sin(2 * kPi * kWaves * u);
    return Vec3{h, h, h};
  });
}
TextureSource sine_normals() {
  return texture_of(kTexels, 1, [](double u, double) {
    const Vec3 n = normalized(Vec3{-slope_at(u), 0.0, 1.0});
    return (n + Vec3{1, 1, 1}) * 0.5;
  });
}

enum class Kind { bump, normals };

// A square metre of the plane z = -1 with relief, by its quad's own coordinates.
Scene relief_scene(TextureSource texture, Kind kind, double scale) {
  Scene scene;
  scene.textures = {std::move(texture)};
  Material material{
      .name = "relief", .model = ShadingModel::phong, .diffuse = {.value = {1.0F, 1.0F, 1.0F}}};
  if (kind == Kind::bump) material.bump = {.texture = 0, .scale = scale};
  if (kind == Kind::normals) material.normal_map = {.texture = 0, .scale = scale};
  scene.materials = {material};
  scene.objects = {{.shape = QuadObject{.corner = {0, 0, -1}}}};
  scene.lights = {
      {.kind = DirectionalLight{.direction = {-0.6, 0.0, -0.8}}, .intensity = {1.0F, 1.0F, 1.0F}}};
  return scene;
}

struct Seen {
  Vec3f normal = {};
  Rgb color = {};
  LaneSurfaces surfaces = {};
};

Seen seen(const RayScene& scene, Vec3f origin, Vec3f direction) {
  RayPacket packet;
  packet.set(0, origin, normalized(direction), kFar, 0.0F);
  scene.intersect_one(packet);
  EXPECT_TRUE(packet.hit(0));
  const ShadingInputs inputs{.scene = scene, .sequence = SampleSequence(1)};
  alignas(64) LaneMask first = {-1};
  Seen result;
  LaneColors colors;
  std::uint64_t rays = 0;
  shade_locally(inputs, packet, first, LaneFloats{}, result.surfaces, colors, rays);
  result.normal = result.surfaces.normal(0);
  result.color = colors.get(0);
  return result;
}
Seen seen_from_front(const RayScene& scene, double x, double y = 0.5) {
  return seen(scene, to_float({x, y, 0.0}), {0, 0, -1});
}

double lambert(double slope) {
  return std::max(0.0, (-0.6 * slope + 0.8) / std::sqrt(1.0 + slope * slope));
}

// Differences over a texel d of a sinusoid are its slope times sinc(k d/2), and between texels
// they are interpolated: together below (kd)^2 (1/24 + 1/8) of the steepest slope, 1e-4 of 0.377;
// heights of 2^-24 over a texel add 0.06 * 2^-24 * 512.
TEST(Relief, ABumpMapOfASinusoidTiltsByItsSlope) {
  const RayScene scene(relief_scene(sine_heights(), Kind::bump, 2 * kAmplitude));
  double steepest = 0.0;
  for (int i = 0; i < 200; ++i) {
    const double x = (i + 0.37) / 200;
    const Seen at = seen_from_front(scene, x);
    const double tilt = std::atan2(-double{at.normal.x}, double{at.normal.z});
    EXPECT_NEAR(tilt, std::atan(slope_at(x)), 5e-5) << x;
    EXPECT_NEAR(at.normal.y, 0.0F, 1e-6F);
    EXPECT_NEAR(at.color[0], lambert(slope_at(x)), 5e-5) << x;
    steepest = std::max(steepest, std::abs(tilt));
  }
  EXPECT_NEAR(steepest, std::atan(kAmplitude * 2 * kPi * kWaves), 1e-3);
}

TEST(Relief, ANormalMapOfTheSameSlopeIsTheSamePicture) {
  const RayScene bump(relief_scene(sine_heights(), Kind::bump, 2 * kAmplitude));
  const RayScene normals(relief_scene(sine_normals(), Kind::normals, 1.0));
  for (int i = 0; i < 200; ++i) {
    const double x = (i + 0.37) / 200;
    EXPECT_NEAR(seen_from_front(normals, x).color[0], lambert(slope_at(x)), 5e-5) << x;
    EXPECT_NEAR(seen_from_front(bump, x).color[0], seen_from_front(normals, x).color[0], 1e-4);
  }
}

// v points up: heights that grow with v lean the normal down.
TEST(Relief, SlopesAlongVAreUpwards) {
  const auto ramp = [](double, double v) { return Vec3{v, v, v}; };
  const RayScene scene(relief_scene(texture_of(1, 64, ramp), Kind::bump, 0.5));
  const Vec3f normal = seen_from_front(scene, 0.3, 0.4).normal;
  EXPECT_NEAR(normal.y / normal.z, -0.5F, 1e-5F);
  const RayScene green(relief_scene(constant({0.5, 0.9, 0.9}), Kind::normals, 1.0));
  const Vec3f up = seen_from_front(green, 0.3, 0.4).normal;
  EXPECT_NEAR(up.y, 0.70710678F, 1e-6F);
  EXPECT_NEAR(up.z, 0.70710678F, 1e-6F);
  const RayScene half(relief_scene(constant({0.5, 0.9, 0.9}), Kind::normals, 0.5));
  EXPECT_NEAR(seen_from_front(half, 0.3, 0.4).normal.y, 0.5 / std::sqrt(1.25), 1e-6);
}

// A sheet that is dented in front stands out behind: both sides' normals are opposite.
TEST(Relief, BothSidesShowOneSheet) {
  for (const Kind kind : {Kind::bump, Kind::normals}) {
    const RayScene scene(relief_scene(kind == Kind::bump ? sine_heights() : sine_normals(), kind,
                                      kind == Kind::bump ? 2 * kAmplitude : 1.0));
    for (const double x : {0.1, 0.33, 0.8}) {
      const Vec3f front = seen_from_front(scene, x).normal;
      const Vec3f back = seen(scene, to_float({x, 0.5, -2.0}), {0, 0, 1}).normal;
      EXPECT_LT(norm(front + back), 1e-6F) << x;
      EXPECT_GT(std::abs(front.x), 0.01F);
    }
  }
}

// Every kind of surface, lit by one light; `relief` adds no tilt.
Scene all_shapes(bool with_map) {
  Scene scene = relief_scene(constant({0.5, 0.5, 1.0}), Kind::normals, 3.0);
  if (!with_map) scene.materials[0].normal_map = {};
  Mesh dome{.positions = {{2, 0, -1}, {3, 0, -1.3F}, {2, 1, -1.4F}},
            .normals = {{-0.3F, 0, 1}, {0.4F, 0.1F, 1}, {0, 0.5F, 1}},
            .uvs = {{0, 0}, {1, 0.2F}, {0.1F, 0.7F}},
            .triangles = {{0, 1, 2}}};
  scene.objects.push_back({.shape = MeshObject{.file = "dome.obj", .mesh = dome}});
  scene.objects.push_back({.shape = SphereObject{.center = {4.5, 0.5, -2}, .radius = 0.8}});
  scene.objects.push_back(
      {.shape = SphereObject{.center = {6.5, 0.5, -2}, .radius = 0.8}, .mapping = PlanarMapping{}});
  return scene;
}

TEST(Relief, AFlatNormalMapChangesNoBit) {
  const RayScene plain(all_shapes(false));
  const RayScene mapped(all_shapes(true));
  for (const Vec3 at : {Vec3{0.2, 0.7, 0}, Vec3{2.3, 0.2, 0}, Vec3{2.1, 0.6, 0}, Vec3{4.2, 0.9, 0},
                        Vec3{5, 0.2, 0}, Vec3{6.3, 0.4, 0}, Vec3{4.5, 0.5, 0}}) {
    const Seen before = seen_from_front(plain, at.x, at.y);
    const Seen after = seen_from_front(mapped, at.x, at.y);
    EXPECT_EQ(after.normal, before.normal) << at.x;
    EXPECT_EQ(after.color, before.color) << at.x;
    EXPECT_GT(before.color[0], 0.0F);
  }
}

// On a sphere u runs east and v north.
TEST(Relief, ASpheresFrameIsEastAndNorth) {
  Scene scene = relief_scene(constant({0.5 + 0.3, 0.5, 0.9}), Kind::normals, 1.0);
  scene.objects = {{.shape = SphereObject{.center = {0, 0, -3}, .radius = 1.0}}};
  Scene north = scene;
  north.textures[0] = constant({0.5, 0.5 + 0.3, 0.9});
  const RayScene east_scene(scene);
  const RayScene north_scene(north);
  for (const Vec3 at : {Vec3{0.1, 0.2, 0}, Vec3{-0.5, 0.4, 0}, Vec3{0.3, -0.7, 0}}) {
    const Vec3 n{at.x, at.y, std::sqrt(1.0 - at.x * at.x - at.y * at.y)};
    const Vec3 east = normalized(cross(Vec3{0, 1, 0}, n));
    const auto expect = [&](const RayScene& on, Vec3 tilted) {
      const Vec3f normal = seen_from_front(on, at.x, at.y).normal;
      EXPECT_LT(norm(Vec3{double{normal.x}, double{normal.y}, double{normal.z}} - tilted), 2e-6);
    };
    expect(east_scene, n * 0.8 + east * 0.6);
    expect(north_scene, n * 0.8 + cross(n, east) * 0.6);
  }
}

// The plane's slopes do not depend on who tells the coordinates: a quad, a mesh whose uv is
// turned over, or a mapping on a mesh without any.
TEST(Relief, FollowsMappingsAndMirroredCoordinates) {
  const RayScene own(relief_scene(sine_heights(), Kind::bump, 2 * kAmplitude));
  Scene scene = relief_scene(sine_heights(), Kind::bump, 2 * kAmplitude);
  const Mesh bare{.positions = {{0, 0, -1}, {2, 0, -1}, {0, 2, -1}}, .triangles = {{0, 1, 2}}};
  scene.objects = {{.shape = MeshObject{.file = "bare.obj", .mesh = bare},
                    .mapping = PlanarMapping{.origin = {0, 0, 5}}}};
  const RayScene planar(scene);
  Scene mirrored = relief_scene(sine_normals(), Kind::normals, 1.0);
  Mesh turned = bare;
  turned.uvs = {{0.25F, 0}, {-1.75F, 0}, {0.25F, 2}};  // u = 1/4 - x
  mirrored.objects = {{.shape = MeshObject{.file = "turned.obj", .mesh = turned}}};
  const RayScene mirrored_scene(mirrored);
  for (const double x : {0.1, 0.33, 0.8}) {
    EXPECT_LT(norm(seen_from_front(planar, x).normal - seen_from_front(own, x).normal), 2e-5F);
    // Heights h(1/4 - x) lean the other way.
    const Vec3f normal = seen_from_front(mirrored_scene, x).normal;
    EXPECT_NEAR(normal.x / normal.z, slope_at(0.25 - x), 5e-4) << x;
  }
}

TEST(Relief, SlopesOfBothMapsAdd) {
  Scene scene = relief_scene(constant({0.5 + 0.3, 0.5, 0.9}), Kind::normals, 1.0);
  const auto ramp = [](double, double v) { return Vec3{v, v, v}; };
  scene.textures.push_back(texture_of(1, 64, ramp));
  scene.materials[0].bump = {.texture = 1, .scale = 0.25};
  const Vec3f normal = seen_from_front(RayScene(scene), 0.3, 0.4).normal;
  EXPECT_NEAR(normal.x / normal.z, 0.75F, 1e-5F);
  EXPECT_NEAR(normal.y / normal.z, -0.25F, 1e-5F);
}

// A mirror with relief reflects about the tilted normal.
TEST(Relief, MirrorsReflectAboutTheTiltedNormal) {
  Scene scene = relief_scene(constant({0.5 + 0.3, 0.5, 0.9}), Kind::normals, 1.0);
  scene.materials[0].model = ShadingModel::unlit;
  scene.materials[0].reflection = 1.0;
  scene.materials.push_back({.emission = {.value = {0.5F, 0.25F, 1.0F}}});
  // From (0.5, 0.5, -1) along 2 (n.v) n - v with n = (0.6, 0, 0.8): (0.96, 0, 0.28).
  scene.objects.push_back(
      {.shape = SphereObject{.center = {0.5 + 9.6, 0.5, -1 + 2.8}, .radius = 0.2}, .material = 1});
  const RayScene ray_scene(scene);
  RayPacket packet;
  packet.set(0, {0.5F, 0.5F, 0}, {0, 0, -1}, kFar, 0.0F);
  ray_scene.intersect_one(packet);
  alignas(64) LaneMask first = {-1};
  LaneColors colors;
  std::uint64_t rays = 0;
  shade({.scene = ray_scene, .sequence = SampleSequence(1)}, packet, first, colors, rays);
  EXPECT_EQ(colors.get(0), (Rgb{0.5F, 0.25F, 1.0F}));
}

// Whatever texels and coordinates may be, normals have length 1 and lie on the surface's side.
TEST(Relief, IsFiniteWhateverTheTexels) {
  const TextureSource textures[] = {
      constant({0, 0, 0}), constant({3e38, -3e38, 3e38}), constant({0.5, 0.5, 0.0}),
      texture_of(4, 4, [](double u, double v) {
        return Vec3{u < 0.5 ? 3e38 : -3e38, v < 0.5 ? 3e38 : 0.0, 1.0};
      })};
  for (const TextureSource& texture : textures) {
    for (const Kind kind : {Kind::bump, Kind::normals}) {
      for (const double scale : {0.0, 1.0, -1000.0}) {
        Scene scene = relief_scene(texture, kind, scale);
        scene.objects.push_back({.shape = SphereObject{.center = {2.5, 0.5, -2}, .radius = 0.5}});
        const Mesh collapsed{.positions = {{4, 0, -1}, {5, 0, -1}, {4, 1, -1}},
                             .uvs = {{0.3F, 0.3F}, {0.3F, 0.3F}, {0.3F, 0.3F}},
                             .triangles = {{0, 1, 2}}};
        scene.objects.push_back({.shape = MeshObject{.file = "one-uv.obj", .mesh = collapsed}});
        const RayScene ray_scene(scene);
        for (const Vec3 at : {Vec3{0.49, 0.51, 0}, Vec3{2.5, 0.5, 0}, Vec3{2.5, 0.9999, 0},
                              Vec3{2.5001, 0.5, 0}, Vec3{4.2, 0.2, 0}}) {
          const Seen result = seen_from_front(ray_scene, at.x, at.y);
          EXPECT_NEAR(norm(result.normal), 1.0F, 1e-5F);
          EXPECT_TRUE(std::isfinite(result.color[0]));
        }
      }
    }
  }
}

TEST(Relief, NeedsADirectionOnTheSurface) {
  Scene scene = relief_scene(sine_heights(), Kind::bump, 0.1);
  scene.objects[0].mapping = ScreenMapping{};
  EXPECT_THROW(RayScene{scene}, Error);
  const Mesh bare{.positions = {{0, 0, -1}, {2, 0, -1}, {0, 2, -1}}, .triangles = {{0, 1, 2}}};
  scene.objects = {{.shape = MeshObject{.file = "bare.obj", .mesh = bare}}};
  try {
    const RayScene refused(scene);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("bare.obj"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("relief"), std::string::npos);
  }
  scene.objects[0].mapping = PlanarMapping{};
  EXPECT_NO_THROW(RayScene{scene});
}

}  // namespace
}  // namespace fstop
