#include "core/shading/texture_footprint.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;

// What a ray sees of `scene`, one lookup averaging over `rate` metres per metre of distance.
Rgb seen(const RayScene& scene, Vec3f origin, Vec3f direction, float rate = 0.0F,
         const FilmPlaces* film = nullptr) {
  RayPacket packet;
  packet.set(0, origin, normalized(direction), kFar, 0.0F);
  scene.intersect_one(packet);
  alignas(64) LaneMask first = {-1};
  LaneSurfaces surfaces;
  LaneColors colors;
  std::uint64_t rays = 0;
  shade_locally(
      {.scene = scene, .sequence = SampleSequence(1), .footprint_rate = rate, .film = film}, packet,
      first, LaneFloats{}, surfaces, colors, rays);
  return colors.get(0);
}

template <typename Value>
TextureSource grey(int width, int height, TextureFilter filter, const Value& value) {
  TextureSource source{.name = "grey", .filter = filter};
  source.image = Image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      std::fill_n(source.image.at(x, y), 3, static_cast<float>(value(x, y)));
    }
  }
  return source;
}
TextureSource checker(int width, int height, TextureFilter filter) {
  return grey(width, height, filter, [](int x, int y) { return (x + y) % 2; });
}

Scene unlit_scene(TextureSource texture, Object object) {
  Scene scene;
  scene.textures = {std::move(texture)};
  scene.materials = {Material{.emission = {.value = {1, 1, 1}, .texture = 0}}};
  scene.objects = {std::move(object)};
  return scene;
}

// The unit sphere about (0, 0, -4) between circles of latitude and longitude, flat.
Mesh globe(int circles) {
  Mesh mesh;
  for (int row = 0; row <= circles; ++row) {
    for (int column = 0; column <= 2 * circles; ++column) {
      const double latitude = kPi * (double(row) / circles - 0.5);
      const double longitude = kPi * double(column) / circles;
      const Vec3f p = to_float({std::cos(latitude) * std::sin(longitude), std::sin(latitude),
                                std::cos(latitude) * std::cos(longitude) - 4.0});
      mesh.positions.push_back({p.x, p.y, p.z});
    }
  }
  const auto columns = static_cast<std::uint32_t>(2 * circles + 1);
  for (std::uint32_t row = 0; row < static_cast<std::uint32_t>(circles); ++row) {
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      const std::uint32_t a = row * columns + column;
      mesh.triangles.push_back({a, a + 1, a + columns + 1});
      mesh.triangles.push_back({a, a + columns + 1, a + columns});
    }
  }
  return mesh;
}

// A mesh inscribed in a sphere lies below it by d^2/4 at most, d = pi/circles the angle between its
// circles (d^2/8 along either), so that a ray that meets the sphere at an angle t to its normal
// meets the mesh up to tan(t) d^2/4 further on. Where no edge of the checker is as near, the
// sphere's own coordinates and the mapping must show the same field.
TEST(SphericalMapping, AMeshShowsTheCheckerOfTheSphere) {
  constexpr int kCircles = 160;
  const TextureSource texture = checker(16, 8, TextureFilter::nearest);
  const RayScene sphere(
      unlit_scene(texture, {.shape = SphereObject{.center = {0, 0, -4}, .radius = 1.0}}));
  const RayScene mesh(
      unlit_scene(texture, {.shape = MeshObject{.file = "globe.obj", .mesh = globe(kCircles)},
                            .mapping = SphericalMapping{.origin = {0, 0, -4}}}));
  int compared = 0;
  int near = 0;
  for (int i = 0; i < 120; ++i) {
    for (int j = 0; j < 120; ++j) {
      const double x = (i + 0.5) / 60 - 1.0;
      const double y = (j + 0.5) / 60 - 1.0;
      const double squared = x * x + y * y;
      if (squared > 0.96) continue;
      const Vec3 n{x, y, std::sqrt(1.0 - squared)};
      const double off = std::sqrt(squared) / n.z * std::pow(kPi / kCircles, 2) / 4.0 + 1e-5;
      const double longitude = std::atan2(n.x, n.z);
      const double latitude = std::asin(n.y);
      const auto from_edge = [](double angle) {
        const double fields = angle / (kPi / 8);
        return std::abs(fields - std::round(fields)) * (kPi / 8);
      };
      if (from_edge(longitude) * std::cos(latitude) < off || from_edge(latitude) < off) {
        ++near;
        continue;
      }
      ++compared;
      const Vec3f origin = to_float({x, y, 0.0});
      ASSERT_EQ(seen(mesh, origin, {0, 0, -1}), seen(sphere, origin, {0, 0, -1})) << x << " " << y;
    }
  }
  EXPECT_GT(compared, 10 * near);
}

// A checker of single texels is 1 or 0 at a texel's centre in the full image and 1/2 in all others,
// so that a lookup of level of detail l in 0 to 1 is l/2 at a black one. The footprint of w metres
// a metre over a distance d spans w d N/L texels of a texture of N texels over L metres, and
// sqrt(cos) as many where the surface leans out of the mapping's plane.
TEST(PlanarMapping, ChoosesTheAnalyticMipLevel) {
  constexpr int kSize = 64;
  constexpr double kEdge = 0.8;
  constexpr float kRate = 0.01F;
  for (const double lean : {0.0, 0.6, 1.2}) {
    for (const double distance : {1.4, 1.7, 2.2, 2.4}) {
      // A plane through the point that leans about the x axis; the mapping lies in z = 0.
      const Vec3 up{0.0, std::cos(lean), std::sin(lean)};
      const Mesh bare{.positions = {{-9, 0, 0}, {9, 0, 0}, {0, 1, 1}}, .triangles = {{0, 1, 2}}};
      Object object{.shape = MeshObject{.file = "plane.obj", .mesh = bare},
                    .mapping = PlanarMapping{.edge_u = {kEdge, 0, 0}, .edge_v = {0, kEdge, 0}}};
      auto& positions = std::get<MeshObject>(object.shape).mesh.positions;
      const double texel = kEdge / kSize;
      const Vec3 point{20.5 * texel, 20.5 * texel, 0.0};  // the centre of texel (20, 63 - 20)
      int corner = 0;
      for (const Vec3 p : {point - up - Vec3{1, 0, 0}, point - up + Vec3{1, 0, 0}, point + up}) {
        const Vec3f f = to_float(p);
        positions[static_cast<std::size_t>(corner++)] = {f.x, f.y, f.z};
      }
      const RayScene scene(unlit_scene(
          grey(kSize, kSize, TextureFilter::mipmap, [](int x, int y) { return (x + y + 1) % 2; }),
          object));
      const Vec3f origin = to_float(point + Vec3{0, 0, distance});
      const double texels = double{kRate} * distance / texel * std::sqrt(std::cos(lean));
      const double expected = 0.5 * std::clamp(std::log2(texels), 0.0, 1.0);
      EXPECT_NEAR(seen(scene, origin, {0, 0, -1}, kRate)[0], expected, 2e-5)
          << "lean " << lean << " distance " << distance;
    }
  }
}

// The same lookup on the screen: texels of the picture's share that it averages over.
TEST(ScreenMapping, IsTheFilmPositionWhateverTheSurface) {
  Scene scene = unlit_scene(
      grey(40, 20, TextureFilter::nearest, [](int x, int y) { return x + 100 * y; }),
      {.shape = SphereObject{.center = {0, 0, -4}, .radius = 1.0}, .mapping = ScreenMapping{}});
  const RayScene ray_scene(scene);
  FilmPlaces film(400, 200, 0.0F);
  for (const auto& [x, y] : {std::pair{5.0F, 5.0F}, {395.0F, 5.0F}, {205.0F, 195.0F}}) {
    film.set(0, x, y);
    for (const Vec3f direction : {Vec3f{0, 0, -1}, Vec3f{0.1F, -0.2F, -1}}) {
      const float expected = std::floor(x / 10) + 100.0F * std::floor(y / 10);
      EXPECT_EQ(seen(ray_scene, {0, 0, 0}, direction, 1.0F, &film)[0], expected);
    }
  }
  // Without a film there is a colour all the same.
  EXPECT_TRUE(std::isfinite(seen(ray_scene, {0, 0, 0}, {0, 0, -1})[0]));
}

TEST(ScreenMapping, LooksUpTheShareOfThePicture) {
  Scene scene = unlit_scene(
      grey(64, 64, TextureFilter::mipmap, [](int x, int y) { return (x + y) % 2; }),
      {.shape = SphereObject{.center = {0, 0, -4}, .radius = 1.0}, .mapping = ScreenMapping{}});
  const RayScene ray_scene(scene);
  // Half a pixel of a picture of 20 x 20 pixels is 1.6 texels, whatever the distance.
  FilmPlaces film(20, 20, 0.5F);
  film.set(0, 10.0F * 20 / 64 + 0.5F * 20 / 64, 10.0F * 20 / 64 + 0.5F * 20 / 64);
  EXPECT_NEAR(seen(ray_scene, {0, 0, 0}, {0, 0, -1}, 0.3F, &film)[0], 0.5 * std::log2(1.6), 1e-5);
}

// Random ellipses from their axes: M = a^2 e e^T + b^2 f f^T.
TEST(TexelEllipse, HasTheAxesOfItsMatrix) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int i = 0; i < 1000; ++i) {
    const double a = 1.0 + 30.0 * share(random);
    const double b = a * (0.02 + 0.9 * share(random));
    const double turn = 2 * kPi * share(random);
    const double c = std::cos(turn);
    const double s = std::sin(turn);
    const TexelEllipse ellipse = ellipse_of(static_cast<float>(a * a * c * c + b * b * s * s),
                                            static_cast<float>((a * a - b * b) * c * s),
                                            static_cast<float>(a * a * s * s + b * b * c * c));
    EXPECT_NEAR(ellipse.major, a, 1e-5 * a);
    // The smaller eigenvalue keeps the roundings of the larger: a^2 2^-22 over 2b.
    EXPECT_NEAR(ellipse.minor, b, 1e-5 * a + a * a * 0x1p-21 / (2.0 * b));
    EXPECT_NEAR(std::abs(ellipse.major_u * c + ellipse.major_v * s), 1.0, 1e-5);
  }
  const TexelEllipse round = ellipse_of(4.0F, 0.0F, 4.0F);
  EXPECT_EQ(round.major, 2.0F);
  EXPECT_EQ(round.minor, 2.0F);
  EXPECT_EQ(round.major_u * round.major_u + round.major_v * round.major_v, 1.0F);
  EXPECT_EQ(ellipse_of(0, 0, 0).major, 0.0F);
}

// A floor seen at a slant, ten times as long as wide in a lookup of one texel's width: stripes
// along the view, 2 texels each, keep all their contrast; a round lookup of ten texels has none.
TEST(AnisotropicFilter, KeepsWhatRunsAlongTheView) {
  constexpr int kSize = 256;
  constexpr double kTexel = 1.0 / kSize;
  const auto stripes = [](int x, int) { return x / 2 % 2; };  // a period of 4 texels
  const double slant = std::acos(0.1);
  const Vec3 point{0.5, 0.5, 0.0};
  const Vec3 eye = point + Vec3{0, -std::sin(slant), std::cos(slant)} * 2.0;
  const float rate = static_cast<float>(kTexel / 2.0);
  const auto contrast = [&](TextureFilter filter, float width) {
    const RayScene scene(unlit_scene(grey(kSize, kSize, filter, stripes),
                                     {.shape = QuadObject{.corner = {0, 0, 0}}}));
    double least = 1.0;
    double most = 0.0;
    for (int i = 0; i < 16; ++i) {
      const Vec3 shift{0.25 * i * kTexel, 0, 0};
      const float value =
          seen(scene, to_float(eye + shift), to_float(point - eye), width * rate)[0];
      least = std::min(least, double{value});
      most = std::max(most, double{value});
    }
    return most - least;
  };
  EXPECT_GT(contrast(TextureFilter::anisotropic, 1.0F), 0.99);
  EXPECT_LT(contrast(TextureFilter::mipmap, 10.0F), 0.01);
}

// Across the view the mean over the ellipse's length counts: of a wave of f periods a texel, n
// lookups a texel apart keep sin(pi n f)/(n sin(pi f)), and each bilinear one sinc^2(f).
TEST(AnisotropicFilter, AveragesOverTheEllipsesLength) {
  constexpr int kSize = 512;
  constexpr double kFrequency = 1.0 / 32.0;  // of a texel
  const auto wave = [](int, int y) {
    return 0.5 + 0.5 * std::cos(2 * kPi * kFrequency * (y + 0.5));
  };
  const double cosine = 0.125;  // eight texels long
  const double slant = std::acos(cosine);
  const auto amplitude = [&](TextureFilter filter) {
    const RayScene scene(
        unlit_scene(grey(kSize, kSize, filter, wave), {.shape = QuadObject{.corner = {0, 0, 0}}}));
    const float rate = static_cast<float>(1.0 / kSize / 2.0 * 0.9999);
    double real = 0.0;
    constexpr int kLooks = 512;
    for (int i = 0; i < kLooks; ++i) {
      const double y = 0.25 + (i + 0.5) / kLooks * 0.5;
      const Vec3 eye = Vec3{0.5, y, 0} + Vec3{0, -std::sin(slant), cosine} * 2.0;
      const float value = seen(scene, to_float(eye), to_float(Vec3{0.5, y, 0} - eye), rate)[0];
      real += 2.0 / kLooks * double{value} * std::cos(2 * kPi * kFrequency * kSize * y);
    }
    return real;
  };
  const double probes = 8.0;
  const double box = std::sin(kPi * probes * kFrequency) / (probes * std::sin(kPi * kFrequency));
  const double tent = std::pow(std::sin(kPi * kFrequency) / (kPi * kFrequency), 2);
  EXPECT_NEAR(amplitude(TextureFilter::anisotropic), 0.5 * box * tent, 1e-3);
  EXPECT_NEAR(amplitude(TextureFilter::mipmap), 0.5 * tent, 1e-3) << "a texel's width alone";
}

TEST(AnisotropicFilter, IsTheMipMapSeenFromStraightAbove) {
  const auto texture = [](TextureFilter filter) {
    return grey(64, 64, filter, [](int x, int y) { return (x * 7 + y * 13) % 11 / 11.0; });
  };
  const Object quad{.shape = QuadObject{.corner = {0, 0, 0}}};
  const RayScene anisotropic(unlit_scene(texture(TextureFilter::anisotropic), quad));
  const RayScene mipmap(unlit_scene(texture(TextureFilter::mipmap), quad));
  for (const float rate : {0.0F, 0.01F, 0.03F, 0.2F}) {
    for (const float x : {0.21F, 0.5F, 0.77F}) {
      EXPECT_NEAR(seen(anisotropic, {x, 0.4F, 1}, {0, 0, -1}, rate)[0],
                  seen(mipmap, {x, 0.4F, 1}, {0, 0, -1}, rate)[0], 1e-5F)
          << rate;
    }
  }
}

}  // namespace
}  // namespace fstop
