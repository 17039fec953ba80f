// Texture filters on a checkerboard that recedes to the horizon: error of a picture against the
// same by 4,096 bilinear lookups a pixel, time and memory.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/measure/image_difference.h"
#include "core/render/simulation.h"
#include "core/scene/texture.h"

namespace fstop {
namespace {

using Clock = std::chrono::steady_clock;

struct Case {
  const char* name = "";
  TextureFilter filter = TextureFilter::bilinear;
};
constexpr std::array<Case, 6> kCases = {{{"nearest", TextureFilter::nearest},
                                         {"brute-force", TextureFilter::brute_force},
                                         {"mipmap", TextureFilter::mipmap},
                                         {"anisotropic", TextureFilter::anisotropic},
                                         {"summed-area", TextureFilter::summed_area},
                                         {"stochastic", TextureFilter::stochastic}}};

// Squares of 16 texels, with grain so that every texel differs from its neighbour.
TextureSource checkerboard(TextureFilter filter) {
  constexpr int kSide = 1024;
  TextureSource source{.name = "board", .filter = filter};
  source.image = Image(kSide, kSide, 3);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const float grain = static_cast<float>((x * 7919 + y * 104729) % 64) / 256.0F;
      const float value = ((x / 16 + y / 16) % 2 == 0 ? 0.7F : 0.05F) + grain;
      std::fill_n(source.image.at(x, y), 3, value);
    }
  }
  return source;
}

Scene receding_board(TextureFilter filter) {
  Scene scene;
  scene.textures = {checkerboard(filter)};
  scene.materials = {Material{.emission = {.value = {1, 1, 1}, .texture = 0}}};
  // 30 m wide and 60 m deep, a metre below the eye; the texture once in both directions.
  scene.objects = {
      {.shape = QuadObject{.corner = {-15, -1, -1}, .edge_u = {30, 0, 0}, .edge_v = {0, 0, -60}}}};
  scene.background = {0.4F, 0.5F, 0.6F};
  return scene;
}

SimulationSpec picture(bool lens, int samples, double width_px) {
  SimulationSpec spec;
  if (lens) {
    spec.camera.optics = LensSpec{.lens = {.focal_length = Length::si(0.05), .f_number = 1.4},
                                  .focus_distance = Length::si(3.0)};
  } else {
    spec.camera.optics =
        PinholeSpec{.image_distance = Length::si(0.05), .diameter = Length::si(0.0001)};
  }
  spec.width = 384;
  spec.height = 256;
  spec.effects.diffraction = EffectChoice::off;
  spec.quality.method = lens ? "lens-sampling" : "pinhole";
  spec.quality.samples = samples;
  spec.quality.texture_width_px = width_px;
  return spec;
}

// One thread; the least of several runs.
void measure(std::ofstream& csv, bool lens) {
  const SimulationSpec brute = picture(lens, 4096, 0.0);
  WorkerPool all(0);
  const Image truth =
      simulate(brute, RayScene(receding_board(TextureFilter::bilinear)), {.workers = &all}).color;
  for (const Case& c : kCases) {
    const RayScene scene(receding_board(c.filter));
    const double bytes = static_cast<double>(Texture(checkerboard(c.filter)).memory_bytes());
    for (const int samples : {2, 4, 16, 64}) {
      // A lookup covers its share of the pixel: samples side by side.
      const double width = 1.0 / std::sqrt(static_cast<double>(samples));
      double least = 1e9;
      double rmse = 0.0;
      for (int run = 0; run < 5; ++run) {
        const auto start = Clock::now();
        const Photograph photograph = simulate(picture(lens, samples, width), scene, {});
        least = std::min(least, std::chrono::duration<double>(Clock::now() - start).count());
        rmse = image_difference(photograph.color.view(), truth.view()).rmse;
      }
      const double ns = 1e9 * least / (384.0 * 256.0 * samples);
      csv << (lens ? "lens" : "pinhole") << ';' << c.name << ';' << samples << ';' << rmse << ';'
          << 1e3 * least << ';' << ns << ';' << bytes / (1 << 20) << '\n';
      std::printf("%-8s %-12s %3d samples  RMSE %.5f  %7.1f ms  %6.1f ns a sample  %5.1f MiB\n",
                  lens ? "lens" : "pinhole", c.name, samples, rmse, 1e3 * least, ns,
                  bytes / (1 << 20));
    }
  }
}

// The same board upright before a lens that blurs all of it to discs of `coc_px`, a pixel 1.6
// texels wide: what lookups save that average over a share of the disc, and what their own blur
// costs.
Scene upright_board() {
  Scene scene;
  scene.textures = {checkerboard(TextureFilter::mipmap)};
  scene.materials = {Material{.emission = {.value = {1, 1, 1}, .texture = 0}}};
  // At 20 m, 50 mm and 36 mm / 384 px a pixel is 36 mm wide: 1024 texels over 22.8 m.
  scene.objects = {
      {.shape = QuadObject{
           .corner = {-11.4, -11.4, -20}, .edge_u = {22.8, 0, 0}, .edge_v = {0, 22.8, 0}}}};
  return scene;
}

void measure_defocus(std::ofstream& csv) {
  const RayScene scene(upright_board());
  WorkerPool all(0);
  for (const double coc_px : {4.0, 8.0, 16.0, 32.0}) {
    SimulationSpec spec = picture(true, 4096, 0.0);
    // c = (f/N) v (1/s - 1/d): the f-number for this disc, focused at 1 m.
    const double v = 1.0 / (1.0 / 0.05 - 1.0);
    const double f_number = 0.05 * v * (1.0 - 1.0 / 20.0) / (coc_px * 36e-3 / 384.0);
    spec.camera.optics = LensSpec{.lens = {.focal_length = Length::si(0.05), .f_number = f_number},
                                  .focus_distance = Length::si(1.0)};
    const Image truth = simulate(spec, scene, {.workers = &all}).color;
    for (const double share : {0.0, 0.125, 0.25, 0.5}) {
      for (const int samples : {4, 16, 64}) {
        spec.quality.samples = samples;
        spec.quality.texture_width_px = share > 0.0 ? share * coc_px : 0.125;
        spec.seed = 1;  // none of the truth's rays
        const Image made = simulate(spec, scene, {.workers = &all}).color;
        spec.seed = 0;
        const double rmse = image_difference(made.view(), truth.view()).rmse;
        csv << coc_px << ';' << *spec.quality.texture_width_px << ';' << samples << ';' << rmse
            << '\n';
        std::printf("disc %4.0f px  lookup %5.2f px  %3d samples  RMSE %.5f\n", coc_px,
                    *spec.quality.texture_width_px, samples, rmse);
      }
    }
  }
}

}  // namespace
}  // namespace fstop

// texture_bench FOLDER: FOLDER/textures.csv, FOLDER/textures-defocus.csv, a table to standard
// output.
int main(int count, char** words) {
  const std::filesystem::path folder = count > 1 ? words[1] : "build/bench";
  std::filesystem::create_directories(folder);
  std::ofstream csv(folder / "textures.csv");
  csv << "camera;filter;samples;rmse;ms;ns_a_sample;mebibytes\n";
  for (const bool lens : {false, true}) fstop::measure(csv, lens);
  std::ofstream blurred(folder / "textures-defocus.csv");
  blurred << "coc_px;lookup_px;samples;rmse\n";
  fstop::measure_defocus(blurred);
  return csv && blurred ? 0 : 1;
}
