// Edges against independently computed fixtures: a blurred slanted edge, and a half-plane in front
// of a texture.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>

#include <gtest/gtest.h>

#include "core/optics/thin_lens.h"
#include "tests/physics/test_scenes.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr Length kPitch = Length::si(37.5e-6);
constexpr double kSlant = 5.0 * std::numbers::pi / 180.0;

// Pixels of an image of the edge, by their signed distance from it.
std::map<double, double> edge_profile(const Image& image) {
  std::map<double, double> profile;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double dx = x + 0.5 - image.width() / 2.0;
      const double dy = y + 0.5 - image.height() / 2.0;
      profile[dx * std::cos(kSlant) + dy * std::sin(kSlant)] = image.at(x, y)[1];
    }
  }
  return profile;
}

double interpolated(const std::map<double, double>& profile, double at) {
  const auto above = profile.lower_bound(at);
  const auto below = std::prev(above);
  const double share = (at - below->first) / (above->first - below->first);
  return below->second + share * (above->second - below->second);
}

// Bright where x cos + y sin > 0 (raster, y down), at 5 m, seen with a disc of radius R px.
Scene slanted_edge(Length depth) {
  const double d = depth.si();
  const Vec3 along{-std::sin(kSlant), -std::cos(kSlant), 0.0};  // raster (-sin, +cos): downwards
  const Vec3 across{std::cos(kSlant), -std::sin(kSlant), 0.0};  // into the bright side
  const Vec3 corner = Vec3{0.0, 0.0, -d} - along * 2.0;
  return glowing_scene({glowing_quad(corner, along * 4.0, across * 4.0)});
}

// Tolerance: 1 % of full scale as promised. The fixture's box lies along the edge's normal, ours
// along the pixel grid: their variances agree, and fourth moments differ by under 1e-4 in the
// spread at 5 degrees. Interpolation between pixels 0.01 px apart costs less still; the rest is
// the noise of 8,192 net points.
TEST(Edge, SpreadOfASlantedEdgeIsTheDiscsAndThePixels) {
  double worst = 0.0;
  const nlohmann::json fixture = oracle::fixture("disc_blur");
  ASSERT_FALSE(fixture.at("rows").empty());
  for (const auto& row : fixture.at("rows")) {
    const double radius_px = row.at("R_px").get<double>();
    const double blur_per_pupil = (1.0 / 2.0 - 1.0 / 5.0) / (1.0 / 0.050 - 1.0 / 2.0);
    const double pupil = 2.0 * radius_px * kPitch.si() / blur_per_pupil;
    double reach = 29.0;  // px from the edge
    for (const auto& point : row.at("edge")) {
      reach = std::max(reach, std::abs(point.at("x").get<double>()));
    }
    const int side = 2 * (static_cast<int>(reach) + 3);
    SimulationSpec shot = lens_shot(0.050 / pupil, kPitch, side, side);
    shot.quality.samples = 8192;
    shot.effects.defocus = EffectChoice::on;
    shot.effects.diffraction = EffectChoice::off;  // the fixture's disc is one of rays
    const RayScene scene(slanted_edge(5.0_m));
    const std::map<double, double> profile = edge_profile(finished_exr(shot, scene));
    for (const auto& point : row.at("edge")) {
      const double x = point.at("x").get<double>();
      const double expected = point.at("esf_box").get<double>();
      const double measured = interpolated(profile, x);
      worst = std::max(worst, std::abs(measured - expected));
      EXPECT_NEAR(measured, expected, 0.01) << "R " << radius_px << " px at " << x << " px";
    }
  }
  std::printf("worst error of the edge spread: %.5f of full scale\n", worst);
}

constexpr double kFinePixel = 0.05e-3;  // metres on the focused plane

Mesh rectangle(Vec3f corner, Vec3f u, Vec3f v, float u_from, float u_to) {
  Mesh mesh;
  for (const Vec3f p : {corner, corner + u, corner + u + v, corner + v}) {
    mesh.positions.push_back({p.x, p.y, p.z});
  }
  mesh.uvs = {{u_from, 0.5F}, {u_to, 0.5F}, {u_to, 0.5F}, {u_from, 0.5F}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

// mean + amp cos(2 pi u + phase) over one period of u. Bilinear lookup of 512 texels errs by
// (2 pi/512)^2/8 of the amplitude, 2e-5.
TextureSource cosine(double mean, double amplitude, double phase) {
  TextureSource texture{
      .name = "cosine", .filter = TextureFilter::bilinear, .image = Image(512, 1, 3)};
  for (int x = 0; x < 512; ++x) {
    const double value =
        mean + amplitude * std::cos(2.0 * std::numbers::pi * (x + 0.5) / 512.0 + phase);
    for (int c = 0; c < 3; ++c) texture.image.at(x, 0)[c] = static_cast<float>(value);
  }
  return texture;
}

// The row of pixels at `xf` metres from its middle on the focused plane, between pixel centres.
double radiance_at(const Image& image, double xf) {
  const double x = 0.5 * (image.width() - 1) + xf / kFinePixel;
  const int below = std::min(static_cast<int>(x), image.width() - 2);
  const double share = x - below;
  return (1.0 - share) * image.at(below, 0)[0] + share * image.at(below + 1, 0)[0];
}

Scene occluder_scene(const nlohmann::json& row, double largest_xf) {
  const double near = row.at("u1").get<double>() / 1e3;
  const double far = row.at("u2").get<double>() / 1e3;
  const double edge = row.at("x0").get<double>() / 1e3;
  const double cycles_per_metre = row.at("g").get<double>() * 1e3;
  const auto grey = static_cast<float>(row.at("L_occ").get<double>());
  Scene scene;
  scene.textures = {cosine(row.at("mean").get<double>(), row.at("amp").get<double>(),
                           row.at("phase").get<double>())};
  scene.materials = {Material{.name = "occluder", .emission = {.value = {grey, grey, grey}}},
                     Material{.name = "wave", .emission = {.value = {1, 1, 1}, .texture = 0}}};
  // Metres to each side: where the rays of the outermost point end, and as much again.
  const double focus = row.at("s").get<double>() / 1e3;
  const double radius = row.at("a").get<double>() / 1e3;
  const double reach = std::max(2.0, 2.0 * (largest_xf + radius) * (1.0 + far / focus));
  const auto f = [](double v) { return static_cast<float>(v); };
  scene.objects.push_back(
      {.shape = MeshObject{.mesh = rectangle({f(edge - reach), -1, f(-near)}, {f(reach), 0, 0},
                                             {0, 2, 0}, 0, 1)},
       .material = 0});
  scene.objects.push_back(
      {.shape =
           MeshObject{.mesh = rectangle({f(-reach), -1, f(-far)}, {f(2 * reach), 0, 0}, {0, 2, 0},
                                        f(-reach * cycles_per_metre), f(reach * cycles_per_metre))},
       .material = 1});
  return scene;
}

// Tolerance: 1 % of full scale as promised; parts: the pixel's box on the finest wave, 0.33
// cycles/mm on the focused plane, 5e-4, and as much for the line between two pixels where a point
// lies between their centres; 4,096 net points of a step inside a disc, under 3e-3.
TEST(Edge, HalfPlaneBeforeATextureHasTheExactRadiance) {
  double worst = 0.0;
  const nlohmann::json fixture = oracle::fixture("occluder");
  for (const auto& row : fixture.at("rows")) {
    const double focus = row.at("s").get<double>() / 1e3;
    const double radius = row.at("a").get<double>() / 1e3;
    double reach = 0.0;
    for (const auto& point : row.at("points")) {
      reach = std::max(reach, std::abs(point.at("xf").get<double>() / 1e3));
    }
    const int half = static_cast<int>(std::lround(reach / kFinePixel)) + 1;
    const int width = 2 * half + 1;
    const Length focal_length = 50.0_mm;
    const Length pitch = kFinePixel / focus * image_distance(focal_length, Length::si(focus));
    SimulationSpec shot = lens_shot(1.0, pitch, width, 1);
    auto& lens = std::get<LensSpec>(shot.camera.optics);
    lens.focus_distance = Length::si(focus);
    lens.lens.f_number = focal_length.si() / (2.0 * radius);
    shot.quality.samples = 4096;
    shot.effects.defocus = EffectChoice::on;
    shot.effects.diffraction = EffectChoice::off;
    const RayScene scene(occluder_scene(row, reach));
    const Image image = finished_exr(shot, scene);
    for (const auto& point : row.at("points")) {
      const double xf = point.at("xf").get<double>() / 1e3;
      const double measured = radiance_at(image, xf);
      const double expected = point.at("radiance").get<double>();
      worst = std::max(worst, std::abs(measured - expected));
      EXPECT_NEAR(measured, expected, 0.01) << "s " << focus << " m, xf " << xf << " m";
    }
  }
  std::printf("worst error behind the half-plane: %.5f of full scale\n", worst);
}

}  // namespace
}  // namespace fstop
