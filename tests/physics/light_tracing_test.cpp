// Light that lamps send by mirrors and glass (caustics), against closed forms and against paths
// traced from the camera.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/render/simulation.h"

namespace fstop {
namespace {

constexpr double kDiffuse = 0.5;

Rgb grey(double value) {
  const auto v = static_cast<float>(value);
  return {v, v, v};
}

Material diffuse(double albedo, double emission = 0.0) {
  return {.model = ShadingModel::phong,
          .emission = {.value = grey(emission)},
          .diffuse = {.value = grey(albedo)}};
}

Material glass(double ior, double transmission, double reflection = 0.0) {
  return {.reflection = reflection, .transmission = transmission, .ior = ior};
}

Object quad(Vec3 corner, Vec3 u, Vec3 v, int material) {
  return {.shape = QuadObject{.corner = corner, .edge_u = u, .edge_v = v}, .material = material};
}

// A floor at y = 0, seen from above: 2 m x 2 m about the origin fill the picture.
Scene floor_of(std::vector<Light> lights) {
  Scene scene;
  scene.materials = {diffuse(kDiffuse)};
  scene.objects = {quad({-20, 0, 20}, {40, 0, 0}, {0, 0, -40}, 0)};
  scene.lights = std::move(lights);
  return scene;
}

constexpr int kSide = 16;

SimulationSpec from_above(const std::string& method = "lens-sampling") {
  SimulationSpec spec;
  spec.camera.position = {0, 4, 0};
  spec.camera.look_at = {0, 0, 0};
  spec.camera.up = {0, 0, -1};
  // The lens's image of 2 m at 4 m: sensor = 2 m * v / 4 m, with v = 1/(1/f - 1/s).
  const double v_mm = 1.0 / (1.0 / 50.0 - 1.0 / 4000.0);
  spec.camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 8.0}, .focus_distance = 4.0_m};
  spec.camera.sensor_width = Length::si(2.0e-3 * v_mm / 4.0);
  spec.camera.sensor_height = spec.camera.sensor_width;
  spec.width = kSide;
  spec.height = kSide;
  spec.effects.diffraction = EffectChoice::off;
  spec.illumination = Illumination::global;
  spec.quality.method = method;
  spec.quality.samples = 4096;
  spec.quality.max_error = 0.002;
  return spec;
}

Photograph photograph(const SimulationSpec& spec, const Scene& scene, int threads = 2) {
  const RayScene ray_scene(scene);
  WorkerPool workers(threads);
  RunControl run;
  run.workers = &workers;
  return simulate(spec, ray_scene, run);
}

// The mean over each pixel of `irradiance`(x, z) on the floor, times its diffuse colour.
template <typename Irradiance>
std::vector<double> expected(const Irradiance& irradiance) {
  constexpr int kFine = 16;
  std::vector<double> values;
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      double sum = 0.0;
      for (int i = 0; i < kFine * kFine; ++i) {
        const double x = -1.0 + 2.0 * (column + (i % kFine + 0.5) / kFine) / kSide;
        const double z = -1.0 + 2.0 * (row + (i / kFine + 0.5) / kFine) / kSide;
        sum += irradiance(x, z);
      }
      values.push_back(kDiffuse * sum / (kFine * kFine));
    }
  }
  return values;
}

double rmse(const Image& image, const std::vector<double>& values) {
  double squares = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double off = double{image.pixels()[3 * i]} - values[i];
    squares += off * off;
  }
  return std::sqrt(squares / static_cast<double>(values.size()));
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double mean_of(const Image& image) {
  double sum = 0.0;
  for (const float value : image.pixels()) sum += double{value};
  return sum / static_cast<double>(image.pixels().size());
}

// I f_radial(d) N.L of a point lamp at (x, y, z), the floor's point at (px, 0, pz).
double from_lamp(Vec3 lamp, const Attenuation& a, double px, double pz) {
  const double d = norm(lamp - Vec3{px, 0, pz});
  return 1.0 / (a.a0 + a.a1 * d + a.a2 * d * d) * lamp.y / d;
}

// The estimate is the root mean square of the picture's error. Of 256 pixels that err independently
// the true one scatters by 1/sqrt(2 256) = 4 % about it, and their mean by a sixteenth of it: 1.3
// and 5 sixteenths leave room for estimates that are as uncertain themselves.
void expect_as_expected(const Photograph& photo, const std::vector<double>& values) {
  const double off = rmse(photo.color, values);
  const double estimate = photo.report.error.estimate;
  const double mean = mean_of(values);
  EXPECT_LT(off, 1.3 * estimate);
  EXPECT_LT(off, 0.15 * mean);
  EXPECT_NEAR(mean_of(photo.color), mean, 5.0 / 16.0 * estimate);
  std::printf("off by %.2g (estimate %.2g) of %.3g, the mean by %+.2g\n", off, estimate, mean,
              mean_of(photo.color) - mean);
}

const std::vector<Attenuation> kAttenuations = {{0, 0, 1}, {1, 0, 0}, {0.5, 0.2, 0.1}};

TEST(LightTracing, AMirrorMakesTheLampsImageASecondLamp) {
  for (const Attenuation& attenuation : kAttenuations) {
    const Vec3 lamp{0.4, 2.0, 0.3};
    Scene scene = floor_of({{.kind = PointLight{.position = lamp, .attenuation = attenuation},
                             .intensity = grey(1.0)}});
    scene.materials.push_back({.reflection = 0.8});
    scene.objects.push_back(quad({2.0, 0.5, 1.3}, {0, 1.2, 0}, {0, 0, -2.6}, 1));
    const auto both = [&](double x, double z) {
      const Vec3 image{4.0 - lamp.x, lamp.y, lamp.z};
      return from_lamp(lamp, attenuation, x, z) + 0.8 * from_lamp(image, attenuation, x, z);
    };
    const Photograph photo = photograph(from_above(), scene);
    expect_as_expected(photo, expected(both));
  }
}

TEST(LightTracing, AMirrorTurnsParallelLight) {
  Scene scene =
      floor_of({{.kind = DirectionalLight{.direction = {0.6, -0.8, 0.0}}, .intensity = grey(0.5)}});
  scene.materials.push_back({.reflection = 0.7});
  scene.objects.push_back(quad({2.0, 0.5, 1.2}, {0, 4, 0}, {0, 0, -2.4}, 1));
  const auto both = [](double, double) { return 0.5 * 0.8 * 1.7; };
  expect_as_expected(photograph(from_above(), scene), expected(both));
}

// Glass of index 1 bends nothing: shadow rays end at it, so that all light below was carried
// forward, and must be what there would be without it.
TEST(LightTracing, GlassOfIndexOneCastsNoShadow) {
  struct Case {
    const char* name;
    double half;  // metres, of the pane's side: all rays to what the camera sees pass it
    Light light;
    std::vector<double> values;
  };
  const Vec3 lamp{0.2, 3.0, 0.1};
  const Attenuation square{0, 0, 1};
  const AreaLight area{.corner = {0.0, 3.0, 0.3},
                       .edge_u = {0.5, 0, 0},
                       .edge_v = {0, 0, -0.5},
                       .attenuation = square};
  const std::vector<Case> cases = {
      {"point",
       0.06,
       {.kind = PointLight{.position = lamp, .attenuation = square}, .intensity = grey(2.0)},
       expected([&](double x, double z) { return 2.0 * from_lamp(lamp, square, x, z); })},
      {"spot",
       0.06,
       {.kind =
            SpotLight{
                .position = lamp, .direction = {0, -1, 0}, .exponent = 3, .attenuation = square},
        .intensity = grey(2.0)},
       expected([&](double x, double z) {
         const double cosine = lamp.y / norm(lamp - Vec3{x, 0, z});
         return 2.0 * from_lamp(lamp, square, x, z) * std::pow(cosine, 3);
       })},
      {"area", 0.32, {.kind = area, .intensity = grey(2.0)}, expected([&](double x, double z) {
         double sum = 0.0;
         for (int i = 0; i < 64; ++i) {
           const Vec3 at =
               area.corner + area.edge_u * ((i % 8 + 0.5) / 8) + area.edge_v * ((i / 8 + 0.5) / 8);
           sum += 2.0 / 64 * from_lamp(at, square, x, z);
         }
         return sum;
       })},
      {"directional",
       1.2,
       {.kind = DirectionalLight{.direction = {0, -1, 0}}, .intensity = grey(0.4)},
       expected([](double, double) { return 0.4; })}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    Scene scene = floor_of({c.light});
    scene.materials.push_back(glass(1.0, 1.0));
    const Vec3 corner{(c.half < 1.0 ? lamp.x : 0.0) - c.half, 2.9,
                      (c.half < 1.0 ? lamp.z : 0.0) + c.half};
    scene.objects.push_back(quad(corner, {2.0 * c.half, 0, 0}, {0, 0, -2.0 * c.half}, 1));
    SimulationSpec spec = from_above();
    spec.camera.position = {0, 2.5, 0};  // under the pane
    spec.camera.sensor_width = spec.camera.sensor_width * (4.0 / 2.5);
    spec.camera.sensor_height = spec.camera.sensor_width;
    expect_as_expected(photograph(spec, scene), c.values);
  }
}

// A lamp's light that a thin sheet lets pass arrives by shadow rays: nothing is carried beside it.
TEST(LightTracing, SheetsCountOnce) {
  const Vec3 lamp{0.2, 3.0, 0.1};
  Scene scene = floor_of({{.kind = PointLight{.position = lamp}, .intensity = grey(1.0)}});
  scene.materials.push_back({.reflection = 0.3, .transmission = 0.6});
  scene.objects.push_back(quad({-1.2, 2.9, 1.2}, {2.4, 0, 0}, {0, 0, -2.4}, 1));
  SimulationSpec spec = from_above();
  spec.camera.position = {0, 2.5, 0};
  spec.camera.sensor_width = spec.camera.sensor_width * (4.0 / 2.5);
  spec.camera.sensor_height = spec.camera.sensor_width;
  const Photograph photo = photograph(spec, scene);
  const auto direct =
      expected([&](double x, double z) { return 0.6 * from_lamp(lamp, Attenuation{}, x, z); });
  // Beside it the sheet throws back (1 - 0.6) 0.3 of the floor's own light, at most.
  EXPECT_GT(mean_of(photo.color), 0.999 * mean_of(direct));
  EXPECT_LT(mean_of(photo.color), (1.0 + 0.13 * kDiffuse) * mean_of(direct));
}

// Of what turns a lamp's light: the lamp as a light, whose paths are carried forward, and as a
// shining square of the same intensity, A L / pi, which paths from the camera find by chance. The
// square shines by the cosine: within 0.05 rad, by 0.998 and more.
void expect_agreement(const Object& turner, const Material& glass, double brightest) {
  const double side = 0.5;
  const double radiance = 60.0;
  const Vec3 corner{-side / 2, 8.0, side / 2};
  SimulationSpec spec = from_above();
  spec.camera.position = {3, 1, 0};  // below what it does not see
  spec.camera.look_at = {0, 0, 0};
  spec.camera.sensor_width = Length::si(0.1 * 50e-3);
  spec.camera.sensor_height = spec.camera.sensor_width;
  Scene scene = floor_of({});
  scene.materials.push_back(glass);
  scene.objects.push_back(turner);
  Scene lamp = scene;
  lamp.lights = {{.kind = AreaLight{.corner = corner,
                                    .edge_u = {side, 0, 0},
                                    .edge_v = {0, 0, -side},
                                    .attenuation = {0, 0, 1}},
                  .intensity = grey(side * side * radiance / 3.14159265358979)}};
  Scene square = scene;
  square.materials.push_back({.model = ShadingModel::unlit, .emission = {.value = grey(radiance)}});
  square.objects.push_back(quad(corner, {side, 0, 0}, {0, 0, -side}, 2));
  spec.quality.samples = 4096;
  const Photograph forward = photograph(spec, lamp);
  spec.quality.samples = 16384;
  const Photograph backward = photograph(spec, square);
  double squares = 0.0;
  for (std::size_t i = 0; i < forward.color.pixels().size(); ++i) {
    squares += std::pow(double{forward.color.pixels()[i]} - double{backward.color.pixels()[i]}, 2);
  }
  const double off = std::sqrt(squares / static_cast<double>(forward.color.pixels().size()));
  const double error = std::hypot(forward.report.error.estimate, backward.report.error.estimate);
  const double mean = mean_of(backward.color);
  std::printf("off by %.2g (estimates %.2g and %.2g), means %.5f and %.5f\n", off,
              forward.report.error.estimate, backward.report.error.estimate, mean_of(forward.color),
              mean);
  EXPECT_LT(off, 1.3 * error);
  EXPECT_NEAR(mean_of(forward.color), mean, 0.002 * mean + 5.0 / 16.0 * error);
  EXPECT_GT(*std::ranges::max_element(forward.color.pixels()), brightest * mean);
}

TEST(LightTracing, ForwardAgreesWithBackwardBehindABall) {
  // Which gathers light: brighter than the floor beside it.
  expect_agreement({.shape = SphereObject{.center = {0, 0.5, 0}, .radius = 0.3}, .material = 1},
                   glass(1.5, 0.9, 0.05), 3.0);
}

TEST(LightTracing, ForwardAgreesWithBackwardWithinGlass) {
  // Lamp outside, floor and camera inside.
  expect_agreement(quad({-0.8, 1.5, 0.8}, {1.6, 0, 0}, {0, 0, -1.6}, 1), glass(1.5, 0.9), 1.0);
}

TEST(LightTracing, BytesDoNotDependOnThreadsAndTheReportTellsIt) {
  Scene scene = floor_of({{.kind = PointLight{.position = {0.2, 3.0, 0.1}}, .intensity = grey(1)}});
  scene.materials.push_back(glass(1.5, 0.9));
  scene.objects.push_back(
      {.shape = SphereObject{.center = {0, 1, 0}, .radius = 0.3}, .material = 1});
  SimulationSpec spec = from_above();
  const Photograph one = photograph(spec, scene, 1);
  const Photograph three = photograph(spec, scene, 3);
  EXPECT_EQ(one.color, three.color);
  const auto told = [](const Photograph& photo, const std::string& effect) {
    return std::ranges::count(photo.report.model, effect, &ModelledEffect::effect);
  };
  EXPECT_EQ(told(one, "caustics"), 1);
  EXPECT_EQ(told(one, "caustics in mirrors and glass"), 1);  // the ball is in the picture
  spec.illumination = Illumination::recursive;
  EXPECT_EQ(told(photograph(spec, scene), "caustics"), 0);
}

}  // namespace
}  // namespace fstop
