#include "core/render/simulation.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/render/bar_scenes.h"
#include "core/render/busy_scene.h"
#include "core/render/method.h"

namespace fstop {
namespace {

SimulationSpec small_shot(double f_number = 1.4) {
  SimulationSpec spec;
  spec.camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = f_number}, .focus_distance = 2.0_m};
  spec.width = 96;
  spec.height = 64;
  return spec;
}

Photograph photograph(const SimulationSpec& spec, const RayScene& scene, int threads = 2) {
  WorkerPool workers(threads);
  RunControl run;
  run.workers = &workers;
  return simulate(spec, scene, run);
}

// A plane 5 m away, which fills the left half of the frame: along the ray of a pixel at (x, y) on
// the sensor it is 5 m sqrt(1 + (x^2 + y^2)/v^2) away, v = 1/(1/50 - 1/2000) mm.
TEST(Simulation, LayersAreWhatTheirNamesSay) {
  Scene scene;
  scene.materials = {Material{.emission = {.value = {0.5F, 0.5F, 0.5F}}}};
  scene.objects = {
      {.shape = QuadObject{.corner = {-9, -9, -5}, .edge_u = {9, 0, 0}, .edge_v = {0, 18, 0}}}};
  SimulationSpec spec = small_shot();
  spec.quality.samples = 1;
  spec.outputs = {Output::color,    Output::depth,        Output::coc,
                  Output::distance, Output::coc_diameter, Output::valid};
  const Photograph photo = photograph(spec, RayScene(scene));
  const double v = 1.0 / (1.0 / 50.0 - 1.0 / 2000.0);
  const double pitch = 36.0 / 96.0;  // mm
  // c = (f/N) v |1/s - 1/d| in um
  const double blur = 1e3 * (50.0 / 1.4) * v * (1.0 / 2000.0 - 1.0 / 5000.0);
  for (int y = 0; y < spec.height; ++y) {
    for (int x = 0; x < spec.width; ++x) {
      const auto value = [&](Output output) { return *photo.layers.at(output).at(x, y); };
      const bool is_hit = x < spec.width / 2;
      EXPECT_EQ(value(Output::valid), is_hit ? 1.0F : 0.0F) << x << " " << y;
      EXPECT_EQ(std::isinf(value(Output::distance)), !is_hit);
      EXPECT_NEAR(value(Output::coc_diameter), 1e3 * pitch * std::abs(value(Output::coc)), 1e-3);
      if (!is_hit) continue;
      const double right = pitch * (x + 0.5 - spec.width / 2) / v;
      const double down = pitch * (y + 0.5 - spec.height / 2) / v;
      EXPECT_NEAR(value(Output::distance), 5.0 * std::sqrt(1.0 + right * right + down * down),
                  1e-5);
      EXPECT_NEAR(value(Output::coc_diameter), blur, 1e-6 * blur + 1e-3);
    }
  }
}

TEST(Simulation, SamePixelsForAnyNumberOfThreads) {
  const RayScene scene(busy_scene());
  SimulationSpec spec = small_shot();
  spec.outputs = {Output::color,        Output::depth,    Output::coc,
                  Output::all_in_focus, Output::variance, Output::normal};
  const Photograph one = photograph(spec, scene, 1);
  for (const int threads : {2, 4}) {
    const Photograph many = photograph(spec, scene, threads);
    EXPECT_TRUE(one.color == many.color) << threads << " threads";
    EXPECT_TRUE(one.layers == many.layers) << threads << " threads";
    EXPECT_EQ(one.report.error.estimate, many.report.error.estimate);
    EXPECT_EQ(one.report.cost.rays, many.report.cost.rays);
  }
}

TEST(Simulation, WavesAreTheSamePixelsForAnyNumberOfThreads) {
  const RayScene scene(busy_scene());
  SimulationSpec spec = small_shot(16.0);
  spec.camera.sensor_width = 3.6_mm;  // pixels as small as diffraction
  spec.camera.sensor_height = 2.4_mm;
  spec.effects.diffraction = EffectChoice::on;
  spec.outputs = {Output::color, Output::variance};
  const Photograph one = photograph(spec, scene, 1);
  EXPECT_EQ(one.report.method, "wave");
  for (const int threads : {2, 4}) {
    const Photograph many = photograph(spec, scene, threads);
    EXPECT_TRUE(one.color == many.color) << threads << " threads";
    EXPECT_TRUE(one.layers == many.layers) << threads << " threads";
    EXPECT_EQ(one.report.error.upper_95, many.report.error.upper_95);
  }
}

TEST(Simulation, AnotherSeedIsAnotherImageWithinItsVariance) {
  const RayScene scene(busy_scene());
  SimulationSpec spec = small_shot();
  spec.quality.samples = 64;
  spec.outputs = {Output::color, Output::variance};
  const Photograph a = photograph(spec, scene);
  spec.seed = 1;
  const Photograph b = photograph(spec, scene);
  EXPECT_FALSE(a.color == b.color);
  double normalised = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < a.color.pixels().size(); ++i) {
    const double variance = static_cast<double>(a.layers.at(Output::variance).pixels()[i]) +
                            static_cast<double>(b.layers.at(Output::variance).pixels()[i]);
    const double difference = a.color.pixels()[i] - b.color.pixels()[i];
    // A pixel without scatter may still round differently by a few 2^-24.
    if (variance < 1e-12) {
      EXPECT_LT(std::abs(difference), 1e-3);
      continue;
    }
    normalised += difference * difference / variance;
    count += 1.0;
  }
  // Independent samples give a mean of 1 with deviation sqrt(2/count); scrambled nets less. Four
  // deviations above 1 would mean that the images disagree.
  ASSERT_GT(count, 1000.0);
  EXPECT_LT(normalised / count, 1.0 + 4.0 * std::sqrt(2.0 / count));
}

TEST(Simulation, BoundHoldsTheTrueError) {
  const RayScene scene(busy_scene());
  SimulationSpec spec = small_shot();
  spec.effects.diffraction = EffectChoice::off;  // the reference has none
  SimulationSpec reference = spec;
  reference.quality.samples = 4096;    // its own error is below 2e-4
  reference.quality.max_error = 1e-4;  // narrow texture lookups
  reference.seed = 999;
  const Photograph truth = photograph(reference, scene);
  int inside = 0;
  int runs = 0;
  for (const double target : {0.03, 0.01, 0.004}) {
    for (std::uint32_t seed = 0; seed < 5; ++seed) {
      spec.quality.max_error = target;
      spec.seed = seed;
      const Photograph picture = photograph(spec, scene);
      const double error = std::sqrt(mse_of(picture.color, truth.color));
      EXPECT_LE(picture.report.error.upper_95, target);
      inside += error <= picture.report.error.upper_95 ? 1 : 0;
      ++runs;
    }
  }
  // At least 95 % are promised; 14 of 15 is the most that 15 runs can tell apart from it.
  EXPECT_GE(inside, runs - 1);
}

TEST(Simulation, PlannerTakesThePinholeWhereNothingIsBlurred) {
  const RayScene scene(busy_scene());
  SimulationSpec spec = small_shot(64.0);  // discs of at most 0.05 px at 96 pixels
  spec.effects.diffraction = EffectChoice::off;
  const Photograph picture = photograph(spec, scene);
  EXPECT_EQ(picture.report.method, "pinhole");
  ASSERT_EQ(picture.report.passed_over.size(), render_methods().size() - 1);
  for (const PassedOverMethod& other : picture.report.passed_over) {
    EXPECT_NE(other.method, "pinhole");
    EXPECT_FALSE(other.why.empty()) << other.method;
  }
  spec.camera.optics = small_shot(1.4).camera.optics;
  EXPECT_TRUE(photograph(spec, scene).report.method.starts_with("lens-"));
}

TEST(Simulation, PinholeIsTheLimitOfASmallAperture) {
  const RayScene scene(busy_scene());
  SimulationSpec spec = small_shot(1e6);
  spec.quality.samples = 256;
  spec.quality.method = "lens-sampling";
  const Photograph lens = photograph(spec, scene);
  spec.quality.method = "pinhole";
  const Photograph pinhole = photograph(spec, scene);
  // The pupil moves rays by at most 25 nm: the images differ where such a shift changes a hit,
  // in next to no pixel.
  EXPECT_LT(std::sqrt(mse_of(lens.color, pinhole.color)), 1e-4);
}

TEST(Simulation, ForcedSamplesAreRenderedExactly) {
  const RayScene scene(busy_scene());
  SimulationSpec spec = small_shot();
  for (const int samples : {1, 2, 3, 24, 100}) {
    spec.quality.samples = samples;
    const Photograph picture = photograph(spec, scene);
    EXPECT_EQ(picture.report.cost.samples_max, samples);
    EXPECT_GE(picture.report.cost.rays, static_cast<std::uint64_t>(samples) * 96U * 64U);
    for (const float value : picture.color.pixels()) ASSERT_TRUE(std::isfinite(value));
  }
}

TEST(Simulation, LayersAreThoseOfTheCentreRay) {
  Scene wall = busy_scene();
  wall.objects.resize(1);
  const RayScene scene(wall);
  SimulationSpec spec = small_shot();
  spec.outputs = {Output::depth, Output::coc, Output::normal};
  const Photograph picture = photograph(spec, scene);
  const Image& depth = picture.layers.at(Output::depth);
  // The wall is a plane at 5 m: the same depth everywhere, not the distance along the ray. Float
  // positions of a metre or two round by 2^-22.
  EXPECT_NEAR(*depth.at(0, 0), 5.0F, 2e-6F);
  EXPECT_NEAR(*depth.at(48, 32), 5.0F, 2e-6F);
  // c = 35.714 mm * 51.282 mm (1/2 - 1/5)/m over 375 um = 1.46520 px
  EXPECT_NEAR(*picture.layers.at(Output::coc).at(48, 32), 1.46520F, 1e-5F);
  EXPECT_NEAR(picture.layers.at(Output::normal).at(48, 32)[2], 1.0F, 1e-6F);
}

TEST(Simulation, MotionSpreadsAnObjectOverTheShutterTime) {
  Scene moving;
  moving.materials = {Material{.emission = {.value = {1, 1, 1}}}};
  // A bar 0.1 m wide at 2 m moves 0.2 m to the right in 0.1 s: its edges ramp over 0.2 m.
  moving.objects = {
      {.shape = QuadObject{.corner = {-0.15, -1, -2}, .edge_u = {0.1, 0, 0}, .edge_v = {0, 2, 0}},
       .velocity = {2, 0, 0}}};
  const RayScene scene(moving);
  SimulationSpec spec = small_shot(8.0);
  spec.camera.shutter_seconds = 0.1;
  spec.quality.samples = 256;
  const Photograph picture = photograph(spec, scene);
  double sum = 0.0;
  double first_moment = 0.0;
  for (int x = 0; x < 96; ++x) {
    sum += picture.color.at(x, 32)[0];
    first_moment += picture.color.at(x, 32)[0] * (x + 0.5);
  }
  // A pixel is 0.375 mm * 2 m/51.28 mm = 14.625 mm there: the bar covers 6.8376 px of light, its
  // mean place is at x = 0, the image's middle.
  EXPECT_NEAR(sum, 0.1 / 0.014625, 0.02);
  EXPECT_NEAR(first_moment / sum, 48.0, 0.02);
  EXPECT_LT(picture.color.at(48, 32)[0], 0.6F);
}

TEST(Simulation, FalloffIsTheChiefRaysCosineToTheFourth) {
  Scene wall;
  wall.materials = {Material{.emission = {.value = {1, 1, 1}}}};
  wall.objects = {
      {.shape = QuadObject{.corner = {-9, -9, -5}, .edge_u = {18, 0, 0}, .edge_v = {0, 18, 0}}}};
  const RayScene scene(wall);
  SimulationSpec spec = small_shot();
  spec.effects.falloff = EffectChoice::on;
  spec.quality.samples = 64;
  const Photograph picture = photograph(spec, scene);
  // The corner pixel's centre is 17.8125 and 11.8125 mm off the axis, v = 51.282 mm.
  const double tangent2 = (17.8125 * 17.8125 + 11.8125 * 11.8125) / (51.28205 * 51.28205);
  EXPECT_NEAR(picture.color.at(0, 0)[0], 1.0 / ((1 + tangent2) * (1 + tangent2)), 1e-4);
}

TEST(Simulation, CancellationEndsTheRenderAndSaysSo) {
  const RayScene scene(busy_scene());
  SimulationSpec spec = small_shot();
  spec.width = 960;
  spec.height = 640;
  spec.quality.samples = 65536;  // minutes of work
  WorkerPool workers(2);
  RunControl run;
  run.workers = &workers;
  std::stop_source stop;
  run.stop = stop.get_token();
  std::chrono::steady_clock::time_point asked;
  run.progress = [&](double) {
    if (stop.stop_requested()) return;
    asked = std::chrono::steady_clock::now();
    stop.request_stop();
  };
  try {
    simulate(spec, scene, run);
    FAIL() << "was not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - asked;
  std::printf("stopped %.1f ms after it was asked to\n", took.count());
}

TEST(Simulation, ProgressNeverFallsAndEndsAtOne) {
  const RayScene scene(busy_scene());
  WorkerPool workers(2);
  RunControl run;
  run.workers = &workers;
  double last = 0.0;
  bool falls = false;
  run.progress = [&](double fraction) {
    falls = falls || fraction < last;
    last = fraction;
  };
  SimulationSpec spec = small_shot();
  spec.width = 480;
  spec.height = 320;
  simulate(spec, scene, run);
  EXPECT_FALSE(falls);
  EXPECT_EQ(last, 1.0);
}

ErrorCode refusal_of(const SimulationSpec& spec, const RayScene& scene) {
  try {
    simulate(spec, scene, {});
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::internal;
}

TEST(Simulation, RefusesWhatNoMethodCoversOrNoCameraIs) {
  const RayScene scene(busy_scene());
  SimulationSpec spec = small_shot();
  spec.effects.diffraction = EffectChoice::on;
  spec.quality.method = "lens-sampling";
  EXPECT_EQ(refusal_of(spec, scene), ErrorCode::no_valid_method);
  spec = small_shot(0.9);  // waves are paraxial
  spec.effects.diffraction = EffectChoice::on;
  EXPECT_EQ(refusal_of(spec, scene), ErrorCode::no_valid_method);
  spec = small_shot();
  spec.effects.defocus = EffectChoice::off;
  spec.quality.method = "lens-sampling";
  EXPECT_EQ(refusal_of(spec, scene), ErrorCode::no_valid_method);
  spec = small_shot();
  std::get<LensSpec>(spec.camera.optics).focus_distance = 50.0_mm;
  EXPECT_EQ(refusal_of(spec, scene), ErrorCode::outside_domain);
  spec = small_shot();
  Scene moving = busy_scene();
  moving.objects[1].velocity = {1, 0, 0};
  spec.camera.shutter_seconds = 65.0;
  EXPECT_EQ(refusal_of(spec, RayScene(moving)), ErrorCode::outside_domain);
  spec = small_shot();
  spec.height = 65;
  EXPECT_EQ(refusal_of(spec, scene), ErrorCode::outside_domain);
  spec = small_shot();
  spec.camera.up = {0, 0, 1};
  EXPECT_EQ(refusal_of(spec, scene), ErrorCode::outside_domain);
}

// Focused a tenth of a micrometre beyond f the image lies 25 km behind the lens: at 375 um a pixel
// and f/2.8, N_w = 1.4 million, the Airy disc is 2.44 * 0.55 um * 1.4e6 / 375 um = 5,000 px wide.
TEST(Simulation, WavesRefuseDiscsFarWiderThanThePicture) {
  const RayScene scene(busy_scene());
  SimulationSpec spec = small_shot(2.8);
  std::get<LensSpec>(spec.camera.optics).focus_distance = 50.0001_mm;
  spec.quality.samples = 1;
  spec.quality.method = "wave";
  EXPECT_EQ(refusal_of(spec, scene), ErrorCode::no_valid_method);
  spec.quality.method = "auto";
  EXPECT_NE(photograph(spec, scene).report.method, "wave");
}

// A dark mirror of 0.0009 before a wall behind the camera: its pixels are the wall's radiance times
// 0.0009 and the exposure. What the smallest branch would hide depends on how bright that is.
TEST(Simulation, FaintMirrorsShowWhatIsBright) {
  constexpr double kMirror = 0.0009;
  const auto shown = [](double radiance, std::optional<double> iso) {
    Scene scene;
    const auto value = static_cast<float>(radiance);
    scene.materials = {Material{.reflection = kMirror},
                       Material{.emission = {.value = {value, value, value}}}};
    scene.objects = {
        {.shape = QuadObject{.corner = {-9, -9, -5}, .edge_u = {18, 0, 0}, .edge_v = {0, 18, 0}}},
        {.shape = QuadObject{.corner = {-40, -40, 20}, .edge_u = {80, 0, 0}, .edge_v = {0, 80, 0}},
         .material = 1}};
    SimulationSpec spec = small_shot(4.0);
    spec.quality.max_error = 0.01;
    if (iso) {
      spec.camera.shutter_seconds = 0.01;
      spec.camera.exposure = IsoExposure{.iso = *iso};
    }
    const Photograph photo = photograph(spec, RayScene(scene));
    return std::pair(double{*photo.color.at(48, 32)}, photo.report.error.upper_95);
  };
  const auto [bright, bright_bound] = shown(1000.0, {});
  EXPECT_NEAR(bright, 0.9, 1e-4);
  EXPECT_LT(bright_bound, 0.01);
  // Of white 0.0009 is under the smallest branch: black, and told.
  const auto [white, white_bound] = shown(1.0, {});
  EXPECT_EQ(white, 0.0);
  EXPECT_GE(white_bound, kMirror * (1.0 - 1e-4));  // in single precision, summed in whole steps
  // 8000 t (S/100)/N_w^2 with N_w = N v/f, v/f = 1/(1 - f/s).
  const double working = 4.0 / (1.0 - 0.05 / 2.0);
  const auto [exposed, exposed_bound] = shown(1.0, 10'000.0);
  EXPECT_NEAR(exposed, kMirror * 8000.0 * 0.01 * 100.0 / (working * working), 1e-4);
  EXPECT_LT(exposed_bound, 0.01);
}

// A lamp in a glass ball: 3 L/n of the picture, or all that shows glass, may be white unseen.
TEST(Simulation, TellsHowMuchOfHighlightsNoSampleMayHaveSeen) {
  Scene scene;
  scene.materials = {Material{.transmission = 1.0, .ior = 1.5},
                     Material{.emission = {.value = {50.0F, 50.0F, 50.0F}}}};
  scene.objects = {
      {.shape = SphereObject{.center = {0, 0, -2}, .radius = 0.2}},
      {.shape = QuadObject{.corner = {-1, 2, -3}, .edge_u = {2, 0, 0}, .edge_v = {0, 0.1, 0}},
       .material = 1}};
  SimulationSpec spec = small_shot(4.0);
  spec.quality.samples = 64;
  const auto told = [&](const RenderReport& report) {
    return std::ranges::find(report.model, "highlights that no sample saw",
                             &ModelledEffect::effect);
  };
  const RenderReport report = photograph(spec, RayScene(scene)).report;
  ASSERT_NE(told(report), report.model.end());
  EXPECT_NEAR(told(report)->bound, std::sqrt(3.0 * 50.0 / (64.0 * spec.width * spec.height)), 1e-9);
  EXPECT_GE(report.error.upper_95, told(report)->bound);
  scene.materials[1].emission.value = {1.0F, 1.0F, 1.0F};
  const RenderReport dim = photograph(spec, RayScene(scene)).report;
  EXPECT_EQ(told(dim), dim.model.end());
}

// What is lit may be brighter than white, too: of a wall whose exposed value is 200, a mirror of
// 0.00099 shows 0.00099/0.0011 of what one of 0.0011 does.
TEST(Simulation, FaintMirrorsShowWhatIsLitBrightly) {
  const auto shown = [](double reflection) {
    Scene scene;
    scene.materials = {
        Material{.model = ShadingModel::phong, .diffuse = {.value = {0.8F, 0.8F, 0.8F}}},
        Material{.reflection = reflection}};
    scene.objects = {
        {.shape = QuadObject{.corner = {-1.5, -0.5, -4}, .edge_u = {3, 0, 0}, .edge_v = {0, 2, 0}}},
        {.shape = QuadObject{.corner = {-2, -0.3, 0}, .edge_u = {4, 0, 0}, .edge_v = {0, 0, -3.9}},
         .material = 1}};
    scene.lights = {
        {.kind = DirectionalLight{.direction = {0, -0.5, -1}}, .intensity = {250, 250, 250}}};
    const Photograph photo = photograph(small_shot(4.0), RayScene(scene));
    return double{*photo.color.at(48, 58)};
  };
  const double above = shown(0.0011);
  EXPECT_GT(above, 0.05);
  EXPECT_NEAR(shown(0.00099), above * 0.9, 0.02 * above);
}

TEST(Simulation, WarnsOfMaterialsThatPassOnMoreThanTheyGet) {
  Scene scene;
  scene.materials = {Material{.name = "glass", .reflection = 0.6, .transmission = 0.6, .ior = 1.5}};
  scene.objects = {{.shape = SphereObject{.center = {0, 0, -3}, .radius = 1.0}}};
  SimulationSpec spec = small_shot();
  spec.quality.samples = 1;
  const auto warned = [&] {
    const RenderReport report = photograph(spec, RayScene(scene)).report;
    return std::ranges::any_of(report.warnings, [](const std::string& warning) {
      return warning.find("reflection + transmission is 1.2") != std::string::npos;
    });
  };
  EXPECT_TRUE(warned());
  scene.materials[0].fresnel = true;
  EXPECT_FALSE(warned());
}

TEST(Simulation, WarnsWhereDiffractionIsLeftOutBeyondTheTarget) {
  const RayScene scene(busy_scene());
  SimulationSpec spec = small_shot();
  spec.camera.optics = PinholeSpec{.image_distance = 50.0_mm, .diameter = 0.1_mm};
  spec.camera.sensor_width = 3.6_mm;
  spec.camera.sensor_height = 2.4_mm;
  spec.quality.method = "lens-sampling";
  const Photograph picture = photograph(spec, scene);
  EXPECT_GT(picture.report.error.upper_95, spec.quality.max_error);
  EXPECT_FALSE(picture.report.warnings.empty());
}

}  // namespace
}  // namespace fstop
