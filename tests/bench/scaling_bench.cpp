// How cost grows: with threads, with pixels, with triangles; and the memory of each. Processor time
// where it tells cost, wall time where it tells what threads save. Writes scaling.csv for
// scaling.gp into the folder named by its argument.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "core/render/simulation.h"
#include "tests/bench/bench_scenes.h"

namespace fstop {
namespace {

constexpr int kRuns = 3;  // the least time of each is told
constexpr int kSamples = 4;

struct Cost {
  double wall = 0.0;  // seconds
  double processor = 0.0;
  double bytes = 0.0;  // most that was held at once beyond what was there before
};

// Bytes of a line of /proc/self/status, as VmRSS: or VmHWM:.
double status_bytes(const std::string& name) {
  std::ifstream file("/proc/self/status");
  for (std::string word; file >> word;) {
    double kilobytes = 0.0;
    if (word == name && file >> kilobytes) return 1024.0 * kilobytes;
  }
  return 0.0;
}

template <typename Work>
Cost cost_of(const Work& work) {
  std::ofstream("/proc/self/clear_refs") << 5;  // forget the highest mark so far
  const double before = status_bytes("VmRSS:");
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t clock = std::clock();
  work();
  return {.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
          .processor = static_cast<double>(std::clock() - clock) / CLOCKS_PER_SEC,
          .bytes = status_bytes("VmHWM:") - before};
}

Cost picture_cost(const RayScene& scene, int width, int height, int threads) {
  SimulationSpec spec;
  spec.width = width;
  spec.height = height;
  spec.camera.sensor_height = spec.camera.sensor_width * (static_cast<double>(height) / width);
  spec.camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 2.8}, .focus_distance = 2.0_m};
  spec.quality.samples = kSamples;
  spec.quality.method = "lens-sampling";
  spec.effects.diffraction = EffectChoice::off;
  WorkerPool workers(threads);
  Cost least;
  for (int run = 0; run < kRuns; ++run) {
    const Cost cost = cost_of([&] { simulate(spec, scene, {.workers = &workers}); });
    if (run == 0) {
      least = cost;
      continue;
    }
    least.wall = std::min(least.wall, cost.wall);
    least.processor = std::min(least.processor, cost.processor);
  }
  return least;
}

// Hills of two triangles a cell, textureless, lit by the sun, filling the picture.
Scene hills(int triangles) {
  const int cells = std::max(1, static_cast<int>(std::lround(std::sqrt(triangles / 2.0))));
  Mesh mesh;
  for (int row = 0; row <= cells; ++row) {
    for (int column = 0; column <= cells; ++column) {
      const double x = 4.0 * column / cells - 2.0;
      const double y = 3.0 * row / cells - 1.5;
      const double z =
          -3.0 + 0.4 * std::sin(3.0 * x) * std::cos(4.0 * y) + 0.05 * std::sin(40.0 * x);
      mesh.positions.push_back(
          {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
    }
  }
  const auto columns = static_cast<std::uint32_t>(cells + 1);
  for (std::uint32_t row = 0; row + 1 < columns; ++row) {
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      const std::uint32_t a = row * columns + column;
      mesh.triangles.push_back({a, a + 1, a + columns + 1});
      mesh.triangles.push_back({a, a + columns + 1, a + columns});
    }
  }
  Scene scene;
  scene.materials = {{.model = ShadingModel::phong, .diffuse = {.value = {0.7F, 0.7F, 0.7F}}}};
  scene.objects.push_back({.shape = MeshObject{.file = "hills", .mesh = std::move(mesh)}});
  scene.lights = {
      {.kind = DirectionalLight{.direction = {0.4, -0.8, -0.4}}, .intensity = {0.9F, 0.9F, 0.9F}}};
  return scene;
}

// One table: rows go to the screen and to a file, whose blocks gnuplot tells apart by `index`.
class Table {
 public:
  explicit Table(const std::string& path) : file_(std::fopen(path.c_str(), "w")) {}
  ~Table() {
    if (file_ != nullptr) std::fclose(file_);
  }
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;
  bool good() const { return file_ != nullptr; }

  void begin(const char* names) {
    std::fprintf(file_, "%s%s\n", first_ ? "" : "\n\n", names);
    std::printf("\n%s\n", names);
    first_ = false;
  }
  void row(const std::vector<double>& values) {
    std::string text;
    for (const double value : values) {
      char number[32];
      std::snprintf(number, sizeof number, "%s%.6g", text.empty() ? "" : ";", value);
      text += number;
    }
    std::fprintf(file_, "%s\n", text.c_str());
    std::printf("%s\n", text.c_str());
    std::fflush(stdout);
  }

 private:
  std::FILE* file_;
  bool first_ = true;
};

void measure_threads(Table& table) {
  table.begin("threads;wall_s;processor_s");
  const RayScene scene(bench_mesh(ShadingModel::phong));
  for (const int threads : {1, 2, 4}) {
    const Cost cost = picture_cost(scene, 1224, 816, threads);
    table.row({static_cast<double>(threads), cost.wall, cost.processor});
  }
}

void measure_pixels(Table& table) {
  table.begin("megapixels;processor_s;ns_a_sample;bytes_a_pixel");
  const RayScene scene(bench_mesh(ShadingModel::phong));
  for (const int width : {612, 1224, 2448, 4896}) {
    const int height = width * 2 / 3;
    const double pixels = static_cast<double>(width) * height;
    const Cost cost = picture_cost(scene, width, height, 1);
    table.row({1e-6 * pixels, cost.processor, 1e9 * cost.processor / (pixels * kSamples),
               cost.bytes / pixels});
  }
}

void measure_triangles(Table& table) {
  table.begin("triangles;processor_s;ns_a_sample;build_s;bytes_a_triangle;resident_a_triangle");
  for (const double wanted : {1e3, 1e4, 1e5, 1e6, 1e7}) {
    Scene made = hills(static_cast<int>(wanted));
    const auto triangles =
        static_cast<double>(std::get<MeshObject>(made.objects[0].shape).mesh.triangles.size());
    std::unique_ptr<RayScene> scene;
    const double before = status_bytes("VmRSS:");
    const Cost build = cost_of([&] { scene = std::make_unique<RayScene>(std::move(made)); });
    const double resident = status_bytes("VmRSS:") - before;
    const Cost cost = picture_cost(*scene, 960, 640, 1);
    table.row({triangles, cost.processor, 1e9 * cost.processor / (960.0 * 640 * kSamples),
               build.processor, static_cast<double>(scene->memory_bytes()) / triangles,
               std::max(0.0, resident) / triangles});
  }
}

}  // namespace
}  // namespace fstop

int main(int argc, char** argv) {
  using namespace fstop;
  const std::string folder = argc > 1 ? argv[1] : ".";
  Table table(folder + "/scaling.csv");
  if (!table.good()) {
    std::fprintf(stderr, "cannot write %s/scaling.csv\n", folder.c_str());
    return 1;
  }
  double load = 0.0;
  getloadavg(&load, 1);
  std::printf("%u processors, load average %.1f; the least of %d runs each, %d samples a pixel\n",
              std::thread::hardware_concurrency(), load, kRuns, kSamples);
  measure_threads(table);
  measure_pixels(table);
  measure_triangles(table);
  return 0;
}
