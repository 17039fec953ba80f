#include "core/render/bokeh_splatting.h"

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/film/film.h"
#include "core/optics/aperture.h"
#include "core/render/sample_loop.h"

namespace fstop {
namespace {

constexpr std::uint32_t kAllGroups = 0xffffffffU;

// A scene and a camera on the axis, looking along -z.
struct SplatTrial {
  explicit SplatTrial(const Scene& scene, const CameraSpec& camera_spec, int side_px)
      : spec(camera_spec),
        ray_scene(scene),
        sensor(sensor_of(spec, side_px, side_px)),
        camera(camera_of(spec, sensor)),
        choice(emitter_choice(ray_scene, camera, 1.0)) {}

  SplatSource source(std::uint32_t seed) const {
    return {.scene = ray_scene,
            .camera = camera,
            .choice = choice,
            .pupil = PupilWarp(aperture_vertices(aperture_of(spec))),
            .seed = seed,
            .falloff = falloff,
            .exposure = exposure};
  }
  SampleSource rays(std::uint32_t seed, std::uint32_t mask) const {
    return {.scene = ray_scene,
            .camera = camera,
            .sensor = sensor,
            .pupil = PupilWarp(aperture_vertices(aperture_of(spec))),
            .sequence = SampleSequence(seed),
            .falloff = falloff,
            .exposure = exposure,
            .mask = mask};
  }

  CameraSpec spec;
  RayScene ray_scene;
  Sensor sensor;
  Camera camera;
  EmitterChoice choice;
  bool falloff = false;
  float exposure = 1.0F;
};

// 50 mm focused at 2 m, f/2, square pixels of 37.5 um.
CameraSpec lens_camera(int side_px, double f_number = 2.0, int blades = 0) {
  CameraSpec spec;
  spec.optics = LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = f_number},
                         .focus_distance = 2.0_m,
                         .aperture = {.blades = blades, .rotation = 0.3}};
  spec.sensor_width = spec.sensor_height = Length::si(37.5e-6 * side_px);
  return spec;
}

Object ball(Vec3 center, double radius, int material = 0) {
  return {.shape = SphereObject{.center = center, .radius = radius}, .material = material};
}
Object plate(Vec3 corner, double width, double height, int material) {
  return {.shape = QuadObject{.corner = corner, .edge_u = {width, 0, 0}, .edge_v = {0, height, 0}},
          .material = material};
}

// Material 0 shines brightly, 1 is black, 2 shines as a background does.
Scene bright_scene(std::vector<Object> objects) {
  Scene scene;
  scene.materials = {{.name = "lamp", .emission = {.value = {80.0F, 40.0F, 20.0F}}},
                     {.name = "black"},
                     {.name = "wall", .emission = {.value = {0.8F, 0.6F, 0.9F}}}};
  scene.objects = std::move(objects);
  return scene;
}

struct Splatted {
  SplatImage light;
  std::vector<SplatTotals> totals = {};
  std::uint64_t rays = 0;
};

Splatted splatted(const SplatTrial& trial, std::uint32_t count, std::uint32_t seed = 1,
                  const RunControl& run = {}) {
  Splatted result{.light = SplatImage(trial.sensor.width, trial.sensor.height)};
  std::vector<SplatRange> ranges;
  for (std::uint32_t i = 0; i < trial.choice.emitters.size(); ++i) {
    ranges.push_back({.emitter = i, .count = count});
  }
  result.totals.resize(ranges.size());
  result.rays = splat(trial.source(seed), 0, ranges, result.light, result.totals, run);
  return result;
}

struct Moments {
  double sum = 0.0;
  double x = 0.0;
  double y = 0.0;
  double mean_square = 0.0;  // of the distance from (x, y)
};

Moments moments_of(const SplatImage& image) {
  Moments m;
  double square = 0.0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double value = image.at(static_cast<std::size_t>(y * image.width() + x))[0];
      m.sum += value;
      m.x += value * (x + 0.5);
      m.y += value * (y + 0.5);
      square += value * (std::pow(x + 0.5, 2) + std::pow(y + 0.5, 2));
    }
  }
  m.x /= m.sum;
  m.y /= m.sum;
  m.mean_square = square / m.sum - m.x * m.x - m.y * m.y;
  return m;
}

// Area, in pixels, of the perspective image of a sphere seen from (lens_x, lens_y, 0), camera
// frame: its tangent cone, of half angle t around an axis at a to the z axis, meets the plane z = 1
// in an ellipse of semi-axes sin t cos t/(cos^2 a - sin^2 t) and sin t/sqrt(cos^2 a - sin^2 t).
double image_of_sphere(Vec3 center, double radius, double lens_x, double lens_y, double scale) {
  const Vec3 ray{center.x - lens_x, center.y - lens_y, center.z};
  const double sine2 = radius * radius / dot(ray, ray);
  const double cosine2 = ray.z * ray.z / dot(ray, ray);
  return scale * scale * std::numbers::pi * sine2 * std::sqrt(1.0 - sine2) /
         std::pow(cosine2 - sine2, 1.5);
}

// Its mean over a round pupil: 200 rings of equal area times 32 angles, midpoints, which leave
// (R/d)^2/200^2 of it.
double mean_image_of_sphere(Vec3 center, double radius, double pupil_radius, double scale) {
  double sum = 0.0;
  for (int ring = 0; ring < 200; ++ring) {
    const double r = pupil_radius * std::sqrt((ring + 0.5) / 200.0);
    for (int k = 0; k < 32; ++k) {
      const double angle = 2.0 * std::numbers::pi * (k + 0.5) / 32.0;
      sum += image_of_sphere(center, radius, r * std::cos(angle), r * std::sin(angle), scale);
    }
  }
  return sum / (200.0 * 32.0);
}

struct DiscCase {
  double depth;  // metres
  int blades;
  bool breathing;
  double radius;  // metres
  Vec3 offset;    // of the sphere from the axis, camera frame
};

// Sum: closed form to 2e-4: 16,384 points of a smooth weight, and 1e-5 of roundings.
// Centroid: a disc's is the chief ray's to first order in R/d; the second order, (R/d)^2 of the
// field's 20 px, is below 0.02 px; the points leave less than 0.01 px.
// Mean square: c^2/8 of the disc (c^2/8 times the polygon's ratio), a quarter of the sharp image's
// square radius, and 1/6 of the pixel's box; 0.5 %.
TEST(BokehSplatting, DiscHasTheLightPlaceAndWidthOfOptics) {
  const std::vector<DiscCase> cases = {{5.0, 0, true, 0.004, {}},
                                       {5.0, 0, false, 0.004, {0.05, -0.03, 0}},
                                       {1.2, 0, true, 0.001, {0.01, 0.012, 0}},
                                       {5.0, 5, true, 0.004, {}},
                                       {1.2, 5, false, 0.001, {}},
                                       {40.0, 0, true, 1e-5, {0.4, 0.3, 0}},
                                       {2.0, 0, true, 1e-4, {}}};
  for (const DiscCase& disc : cases) {
    SCOPED_TRACE(std::to_string(disc.depth) + " m, blades " + std::to_string(disc.blades));
    CameraSpec camera = lens_camera(96, 1.4, disc.blades);
    camera.breathing = disc.breathing;
    const Vec3 center{disc.offset.x, disc.offset.y, disc.depth};  // camera frame: y down
    SplatTrial trial(bright_scene({ball({center.x, -center.y, -center.z}, disc.radius)}), camera,
                     96);
    ASSERT_EQ(trial.choice.emitters.size(), 1U);
    const Splatted result = splatted(trial, 16384);
    const Moments m = moments_of(result.light);
    const double v = disc.breathing ? 1.0 / (1.0 / 0.050 - 1.0 / 2.0) : 0.050;
    const double scale = v / 37.5e-6;
    const double pupil = 0.5 * 0.050 / 1.4;
    const double sharp = mean_image_of_sphere(center, disc.radius, pupil, scale);
    EXPECT_NEAR(m.sum / (80.0 * sharp), 1.0, 2e-4);
    EXPECT_NEAR(result.totals[0].seen_px / sharp, 1.0, 2e-4);
    EXPECT_NEAR(result.totals[0].reached_share(), 1.0, 1e-12);
    EXPECT_NEAR(m.x, 48.0 + scale * center.x / disc.depth, 0.03);
    EXPECT_NEAR(m.y, 48.0 + scale * center.y / disc.depth, 0.03);
    const double c = 2.0 * pupil * scale * std::abs(1.0 / 2.0 - 1.0 / disc.depth);
    const double sharp_radius = scale * disc.radius / disc.depth;
    const double shape = aperture_mean_square_radius({.blades = disc.blades, .rotation = 0.3});
    const double expected = c * c / 4.0 * shape + 0.5 * sharp_radius * sharp_radius + 1.0 / 6.0;
    // In focus all light falls into one to four pixels: what is left is where their middles lie.
    if (c > 4.0) {
      EXPECT_NEAR(m.mean_square / expected, 1.0, 0.005);
    }
  }
}

TEST(BokehSplatting, PinholeCastsItsShadowDisc) {
  CameraSpec camera = lens_camera(96);
  camera.optics = PinholeSpec{.image_distance = 50.0_mm, .diameter = 1.5_mm};
  const Vec3 center{0.02, 0.01, 4.0};
  SplatTrial trial(bright_scene({ball({center.x, -center.y, -center.z}, 0.002)}), camera, 96);
  ASSERT_EQ(trial.choice.emitters.size(), 1U);
  const Moments m = moments_of(splatted(trial, 16384).light);
  const double scale = 0.050 / 37.5e-6;
  EXPECT_NEAR(m.sum / (80.0 * mean_image_of_sphere(center, 0.002, 0.75e-3, scale)), 1.0, 2e-4);
  // The hole's shadow, 1 + v/d times as wide.
  const double c = 1.5e-3 / 37.5e-6 * (1.0 + 0.050 / 4.0);
  const double sharp = scale * 0.002 / 4.0;
  EXPECT_NEAR(m.mean_square / (c * c / 8.0 + 0.5 * sharp * sharp + 1.0 / 6.0), 1.0, 0.005);
}

// Mean and variance of pixels over independent replicates.
class Replicates {
 public:
  explicit Replicates(std::size_t size) : sum_(size), square_(size) {}
  void add(const std::vector<double>& image) {
    for (std::size_t i = 0; i < image.size(); ++i) {
      sum_[i] += image[i];
      square_[i] += image[i] * image[i];
    }
    ++count_;
  }
  double mean(std::size_t i) const { return sum_[i] / count_; }
  double variance_of_mean(std::size_t i) const {
    const double m = mean(i);
    return std::max(0.0, square_[i] / count_ - m * m) / (count_ - 1);
  }

 private:
  std::vector<double> sum_;
  std::vector<double> square_;
  int count_ = 0;
};

std::vector<double> with_total(std::vector<double> image) {
  double total = 0.0;
  for (const double value : image) total += value;
  image.push_back(total);
  return image;
}

std::vector<double> traced(const SplatTrial& trial, std::uint32_t seed, std::uint32_t mask,
                           std::uint32_t samples) {
  Film film(trial.sensor.width, trial.sensor.height);
  WorkerPool workers(2);
  RunControl run;
  run.workers = &workers;
  trace_pass(trial.rays(seed, mask), {.count = samples}, film, run);
  film.end_pass(static_cast<int>(samples));
  const Image mean = film.mean();
  return {mean.pixels().begin(), mean.pixels().end()};
}

constexpr int kReplicates = 16;

// Camera rays alone against splats and masked camera rays. Each pixel's difference over its
// standard error, both from 16 replicates, is Student's t with 15 to 30 degrees of freedom, whose
// square has a mean of 15/13 at most; over 300 to 1,000 pixels the mean of squares scatters by
// under 0.12: limit 1.5. The total is one such t: 4.0 has significance 0.01 for 8 scenes (Sidak).
void expect_agreement(const SplatTrial& trial, std::uint32_t camera_samples = 256,
                      std::uint32_t points = 4096) {
  ASSERT_FALSE(trial.choice.emitters.empty());
  ASSERT_NE(trial.choice.camera_mask, kAllGroups);
  const std::size_t size = 3U * static_cast<std::size_t>(trial.sensor.width) *
                           static_cast<std::size_t>(trial.sensor.height);
  Replicates brute(size + 1);
  Replicates joined(size + 1);
  for (std::uint32_t r = 0; r < kReplicates; ++r) {
    brute.add(with_total(traced(trial, 100 + r, kAllGroups, camera_samples)));
    std::vector<double> masked = traced(trial, 200 + r, trial.choice.camera_mask, camera_samples);
    const Splatted splats = splatted(trial, points, 300 + r);
    for (std::size_t i = 0; i < size; ++i) masked[i] += splats.light.values()[i];
    joined.add(with_total(std::move(masked)));
  }
  double squares = 0.0;
  double pixels = 0.0;
  for (std::size_t i = 0; i < size; i += 3) {
    const double variance = brute.variance_of_mean(i) + joined.variance_of_mean(i);
    // Where nothing varies both must say the same, to the roundings of single precision.
    if (variance < 1e-12) {
      EXPECT_NEAR(brute.mean(i), joined.mean(i), 1e-5) << "pixel " << i / 3;
      continue;
    }
    squares += std::pow(brute.mean(i) - joined.mean(i), 2) / variance;
    pixels += 1.0;
  }
  const double total_error =
      std::sqrt(brute.variance_of_mean(size) + joined.variance_of_mean(size));
  std::printf("mean t^2 %.3f over %.0f pixels; total %.5g against %.5g, standard error %.2g\n",
              squares / pixels, pixels, joined.mean(size), brute.mean(size), total_error);
  EXPECT_LT(squares / pixels, 1.5);
  EXPECT_NEAR(joined.mean(size), brute.mean(size), 4.0 * total_error);
}

TEST(BokehSplatting, AgreesWithCameraRaysBehindAnEdge) {
  // The plate at 3 m covers half of the disc.
  expect_agreement(SplatTrial(bright_scene({ball({0, 0, -5}, 0.007), plate({0, -1, -3}, 1, 2, 1)}),
                              lens_camera(32, 1.0), 32));
}

TEST(BokehSplatting, TakesAwayTheBackgroundThatAnEmitterHides) {
  // A wall at 6 m that is a quarter as bright as a dim lamp.
  Scene scene = bright_scene({ball({0.01, 0.01, -5}, 0.008), plate({-3, -3, -6}, 6, 6, 2)});
  scene.materials[0].emission.value = {2.0F, 1.5F, 1.2F};
  expect_agreement(SplatTrial(scene, lens_camera(32, 1.0), 32));
}

TEST(BokehSplatting, KnowsBladesFalloffAndExposure) {
  CameraSpec camera = lens_camera(32, 1.0, 5);
  camera.breathing = false;
  SplatTrial trial(bright_scene({ball({0.02, -0.015, -5}, 0.007), plate({-3, -3, -6}, 6, 6, 2)}),
                   camera, 32);
  trial.falloff = true;
  trial.exposure = 0.25F;
  expect_agreement(trial);
}

TEST(BokehSplatting, ReadsTexturesAndLightsOfAnEmitter) {
  Scene scene =
      bright_scene({plate({-0.006, -0.006, -5}, 0.012, 0.012, 0), plate({-3, -3, -6}, 6, 6, 2)});
  TextureSource texture{
      .name = "halves", .filter = TextureFilter::nearest, .image = Image(2, 2, 3)};
  for (int i = 0; i < 4; ++i) {
    for (int c = 0; c < 3; ++c) texture.image.at(i % 2, i / 2)[c] = 0.25F * static_cast<float>(i);
  }
  scene.textures = {texture};
  scene.materials[0].emission.texture = 0;
  scene.materials[0].model = ShadingModel::phong;
  scene.materials[0].diffuse.value = {9.0F, 5.0F, 2.0F};
  scene.lights = {{.kind = PointLight{.position = {1, 1, -4}}, .intensity = {3, 3, 3}}};
  expect_agreement(SplatTrial(scene, lens_camera(32, 1.0), 32));
}

TEST(BokehSplatting, SortsOutEmittersBeforeEmitters) {
  // One right behind the other, one beside, in depths from 4 m to 6 m.
  Scene scene = bright_scene(
      {ball({0, 0, -4}, 0.005), ball({0.002, 0, -5}, 0.008), ball({0.03, 0, -6}, 0.007, 3)});
  scene.materials.push_back({.name = "blue", .emission = {.value = {9.0F, 9.0F, 90.0F}}});
  expect_agreement(SplatTrial(scene, lens_camera(32, 1.0), 32));
}

// A mesh of two lamps, one a closed box, one a bent strip that partly hides itself, and a large
// dark triangle of the same material far outside the frame.
TEST(BokehSplatting, FindsIslandsOfAMesh) {
  Mesh mesh;
  for (const float z : {-5.0F, -5.01F}) {
    for (const auto& [x, y] :
         {std::pair{-0.02F, -0.005F}, {-0.01F, -0.005F}, {-0.01F, 0.005F}, {-0.02F, 0.005F}}) {
      mesh.positions.push_back({x, y, z});
    }
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}, {0, 4, 5}, {0, 5, 1},
                    {1, 5, 6}, {1, 6, 2}, {2, 6, 7}, {2, 7, 3}, {3, 7, 4}, {3, 4, 0}};
  const auto strip = static_cast<std::uint32_t>(mesh.positions.size());
  // A Z seen from above: its front blade hides half of the back one.
  for (const auto& [x, z] :
       {std::pair{0.005F, -5.0F}, {0.0125F, -5.0F}, {0.0075F, -5.01F}, {0.0175F, -5.01F}}) {
    mesh.positions.push_back({x, -0.00375F, z});
    mesh.positions.push_back({x, 0.00375F, z});
  }
  for (std::uint32_t i = strip; i < strip + 6; i += 2) {
    mesh.triangles.push_back({i, i + 2, i + 3});
    mesh.triangles.push_back({i, i + 3, i + 1});
  }
  const auto far = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {{50, 0, -5}, {60, 0, -5}, {50, 10, -5}});
  mesh.triangles.push_back({far, far + 1, far + 2});
  Scene scene =
      bright_scene({{.shape = MeshObject{.interpolation = Interpolation::flat, .mesh = mesh}},
                    plate({-3, -3, -6}, 6, 6, 2)});
  const SplatTrial trial(scene, lens_camera(32, 1.0), 32);
  EXPECT_EQ(trial.choice.found, 3U);
  EXPECT_EQ(trial.choice.emitters.size(), 2U);
  expect_agreement(trial);
}

// The lamp is seen directly, in a mirror below it and through a thin sheet beside it: what comes
// after a first hit is the camera rays' own.
TEST(BokehSplatting, CountsNothingTwiceInMirrorsAndBehindSheets) {
  Scene scene = bright_scene(
      {ball({0, 0.01, -5}, 0.008),
       {.shape = QuadObject{.corner = {-1, -0.03, -3}, .edge_u = {2, 0, 0}, .edge_v = {0, 0, -4}},
        .material = 3},
       plate({0.0, -1, -4}, 1, 2, 4),
       plate({-3, -3, -8}, 6, 6, 2)});
  scene.materials.push_back({.name = "mirror", .reflection = 0.7});
  scene.materials.push_back({.name = "sheet", .transmission = 0.6});
  scene.materials.push_back({.name = "glass", .transmission = 0.9, .ior = 1.5});
  scene.objects.push_back(ball({-0.07, 0.05, -4.5}, 0.03, 5));
  expect_agreement(SplatTrial(scene, lens_camera(32, 1.0), 32));
}

TEST(BokehSplatting, BytesAreEqualForAnyNumberOfThreads) {
  std::vector<Object> objects;
  for (int i = 0; i < 9; ++i) objects.push_back(ball({0.02 * (i - 4), 0.01 * i, -5.0 - i}, 0.003));
  objects.push_back(plate({-3, -3, -20}, 6, 6, 2));
  const SplatTrial trial(bright_scene(objects), lens_camera(64), 64);
  ASSERT_EQ(trial.choice.emitters.size(), 9U);
  const Splatted alone = splatted(trial, 16384);
  for (const int threads : {1, 2, 3, 4}) {
    WorkerPool workers(threads);
    RunControl run;
    run.workers = &workers;
    const Splatted shared = splatted(trial, 16384, 1, run);
    EXPECT_EQ(shared.light.values(), alone.light.values()) << threads << " threads";
    EXPECT_EQ(shared.rays, alone.rays);
  }
}

// Halves of the points, each weighed by a half, are the whole; replicates are others.
TEST(BokehSplatting, RangesAddUp) {
  const SplatTrial trial(bright_scene({ball({0, 0, -5}, 0.003)}), lens_camera(64), 64);
  const Splatted whole = splatted(trial, 8192);
  SplatImage halves(64, 64);
  for (const std::uint32_t first : {0U, 4096U}) {
    const SplatRange range{.first = first, .count = 4096, .weight = 0.5};
    splat(trial.source(1), 0, {&range, 1}, halves, {}, {});
  }
  SplatImage other(64, 64);
  const SplatRange range{.count = 8192};
  splat(trial.source(1), 1, {&range, 1}, other, {}, {});
  double difference = 0.0;
  for (std::size_t i = 0; i < halves.values().size(); ++i) {
    EXPECT_NEAR(halves.values()[i], whole.light.values()[i], 1e-12);
    difference = std::max(difference, std::abs(other.values()[i] - whole.light.values()[i]));
  }
  EXPECT_GT(difference, 1e-3);
}

TEST(BokehSplatting, StopsWhenAsked) {
  const SplatTrial trial(bright_scene({ball({0, 0, -5}, 0.003)}), lens_camera(32), 32);
  std::stop_source stop;
  stop.request_stop();
  RunControl run;
  run.stop = stop.get_token();
  EXPECT_THROW(splatted(trial, 4096, 1, run), Error);
  WorkerPool workers(2);
  run.workers = &workers;
  EXPECT_THROW(splatted(trial, 4096, 1, run), Error);
}

}  // namespace
}  // namespace fstop
