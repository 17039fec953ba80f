// Previews for interaction: 640 x 427 pixels through the whole light path, over 100 changes of
// aperture and focus, the scene loaded. Wall time from the call to the finished picture and to the
// first picture under way, processor time of all threads, the error told and, of some, the true
// one.
//
// Arguments: threads (default: those of the machine), scenes by the beginning of their names, and
// how many changes (default: 100).

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "api/limits.h"
#include "api/scene_assets.h"
#include "api/scene_json.h"
#include "api/scene_store.h"
#include "core/render/simulation.h"
#include "tests/bench/bench_scenes.h"

namespace fstop {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 427;
constexpr int kTruths = 2;  // how many changes are held against the truth
constexpr int kTruthSamples = 64;

Scene bundled_scene(const std::string& name) {
  const api::Limits limits;
  const api::SceneStore store({FSTOP_SOURCE_DIR "/core/scenes"}, limits);
  return api::load_scene(api::parse_scene_text(store.text(name), limits),
                         folder_assets(store.folder_of(name), limits.assets), "#", limits)
      .scene;
}

double cpu_ms() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }
double wall_ms() {
  return std::chrono::duration<double, std::milli>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  const auto last = static_cast<double>(values.size() - 1);
  return values[static_cast<std::size_t>(std::ceil(share * last))];
}

// How somebody turns the rings: the focus from 1 to 6 m and back, the aperture from f/1.4 to f/16.
SimulationSpec change(SimulationSpec spec, int i, int changes) {
  const double turn = std::abs(2.0 * i / changes - 1.0);
  const double focus = 1.0 * std::pow(6.0, turn);
  const double f_number = 1.4 * std::pow(2.0, 0.5 * (i % 8));
  spec.camera.optics = LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = f_number},
                                .focus_distance = Length::si(focus)};
  spec.seed = static_cast<std::uint32_t>(i);
  return spec;
}

SimulationSpec preview_spec() {
  SimulationSpec spec;
  spec.width = kWidth;
  spec.height = kHeight;
  spec.camera.sensor_height = spec.camera.sensor_width * (double(kHeight) / kWidth);
  spec.effects.diffraction = EffectChoice::off;
  return spec;
}

double true_error(const Image& image, const SimulationSpec& spec, const RayScene& scene,
                  const RunControl& run) {
  SimulationSpec reference = spec;
  reference.quality = {.samples = kTruthSamples};
  reference.seed = spec.seed + 7919;
  const Photograph photograph = simulate(reference, scene, {.workers = run.workers});
  const Image& truth = photograph.color;
  double sum = 0.0;
  for (std::size_t i = 0; i < truth.pixels().size(); ++i) {
    const double a = std::clamp(image.pixels()[i], 0.0F, 1.0F);
    const double b = std::clamp(truth.pixels()[i], 0.0F, 1.0F);
    sum += (a - b) * (a - b);
  }
  // The reference is noisy, too, by as much as it says.
  const double own = photograph.report.error.estimate;
  return std::sqrt(std::max(0.0, sum / static_cast<double>(truth.pixels().size()) - own * own));
}

struct Figures {
  std::vector<double> wall = {}, first = {}, cpu = {}, bound = {}, samples = {};
  std::vector<double> truth = {}, told = {}, told_bound = {};
  int late = 0;
};

Figures measured(const RayScene& scene, const QualitySpec& quality, double limit_ms, int changes,
                 WorkerPool& workers) {
  Figures figures;
  SimulationSpec spec = preview_spec();
  spec.quality = quality;
  for (int i = -3; i < changes; ++i) {  // three to warm up
    const SimulationSpec shot = change(spec, std::max(0, i), changes);
    RunControl run{.workers = &workers};
    const double start = wall_ms();
    const double cpu = cpu_ms();
    std::optional<double> first;
    run.preview = [&](const Image&, double) {
      if (!first) first = wall_ms() - start;
    };
    const Photograph photograph = simulate(shot, scene, run);
    const double wall = wall_ms() - start;
    if (i < 0) continue;
    figures.wall.push_back(wall);
    figures.cpu.push_back(cpu_ms() - cpu);
    figures.first.push_back(first.value_or(wall));
    figures.bound.push_back(photograph.report.error.upper_95);
    figures.samples.push_back(photograph.report.cost.samples_mean);
    if (wall > limit_ms) ++figures.late;
    if (i % std::max(1, changes / kTruths) != 0) continue;
    figures.truth.push_back(true_error(photograph.color, shot, scene, run));
    figures.told.push_back(photograph.report.error.estimate);
    figures.told_bound.push_back(photograph.report.error.upper_95);
  }
  return figures;
}

void row(const std::string& scene, const char* quality, const Figures& f) {
  std::printf("%-12s %-15s %6.1f %6.1f %6.1f %6.1f %7.1f %7.1f %6d %7.1f %8.4f  ", scene.c_str(),
              quality, quantile(f.first, 0.5), quantile(f.first, 0.95), quantile(f.wall, 0.5),
              quantile(f.wall, 0.95), quantile(f.cpu, 0.5), quantile(f.cpu, 0.95), f.late,
              quantile(f.samples, 0.5), quantile(f.bound, 0.5));
  for (std::size_t i = 0; i < f.truth.size(); ++i) {
    std::printf(" %.4f/%.4f<%.4f", f.truth[i], f.told[i], f.told_bound[i]);
  }
  std::printf("\n");
  std::fflush(stdout);
}

void previews(const std::string& name, const RayScene& scene, int threads, int changes) {
  WorkerPool workers(threads);
  const double limit = threads >= 4 ? 33.0 : 60.0;
  const QualitySpec in_time{.max_error = 0.01, .max_time_ms = limit};
  row(name, threads >= 4 ? "33 ms" : "60 ms", measured(scene, in_time, limit, changes, workers));
  row(name, "max_error 0.05", measured(scene, {.max_error = 0.05}, limit, changes, workers));
}

double load() {
  double average = 0.0;
  return getloadavg(&average, 1) == 1 ? average : -1.0;
}

}  // namespace
}  // namespace fstop

int main(int argc, char** argv) {
  using namespace fstop;
  const int cores = static_cast<int>(std::thread::hardware_concurrency());
  std::vector<int> counts = {cores};
  if (argc > 1) counts = {std::atoi(argv[1])};
  const std::string_view wanted = argc > 2 ? argv[2] : "";
  const int changes = argc > 3 ? std::max(1, std::atoi(argv[3])) : 100;
  for (const int threads : counts) {
    std::printf(
        "\n%d threads on a machine of %d processors, load average %.1f: where others work, wall "
        "times\ntell of them too. %d changes each; ms, median and 95 %%; late: over the limit.\n"
        "True error / estimate < bound, of %d.\n\n",
        threads, cores, load(), changes, kTruths);
    std::fflush(stdout);
    std::printf("%-12s %-15s %13s %13s %15s %6s %7s %8s\n", "scene", "asked for", "first picture",
                "finished", "processor", "late", "samples", "bound");
    const auto with = [&](const std::string& name, auto make) {
      if (!name.starts_with(wanted)) return;
      const RayScene scene(make());
      previews(name, scene, threads, changes);
    };
    with("still-life", [] { return bundled_scene("still-life"); });
    with("slats", [] { return bench_slats(); });
    with("mesh", [] { return bench_mesh(ShadingModel::phong); });
  }
  return 0;
}
