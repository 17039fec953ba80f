// How well the server predicts what renders cost: random requests over the bundled scenes, each
// predicted before it is made and learnt from after. Arguments: requests, seed, a file for the
// figures of each as CSV, a file for them as rows of server/measured_costs.inc, the share of
// pinholes (0.15).
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "api/limits.h"
#include "api/render_request.h"
#include "api/scene_store.h"
#include "core/parallel.h"
#include "core/scene/ray_scene.h"
#include "server/cost_model.h"

namespace fstop {
namespace {

constexpr int kWarmUp = 50;  // requests: ten for each scene

double processor_ms() {
  std::timespec time = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

// SplitMix64 (Steele, Lea & Flood 2014): the same requests everywhere.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : state_(seed) {}
  double unit() {
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
    return static_cast<double>((z ^ (z >> 31U)) >> 11U) * 0x1p-53;
  }
  double log_uniform(double low, double high) { return low * std::pow(high / low, unit()); }
  bool chance(double probability) { return unit() < probability; }

 private:
  std::uint64_t state_;
};

const std::vector<std::string>& scene_names() {
  static const std::vector<std::string> names = {"charts",         "fence",   "night",
                                                 "pinhole-series", "spheres", "still-life"};
  return names;
}

std::string random_request(Draw& draw, const std::string& scene, double pinholes) {
  const int columns = static_cast<int>(std::lround(draw.log_uniform(32.0, 640.0)));
  const double f_number = draw.log_uniform(1.4, 22.0);
  const double focus_m = draw.log_uniform(1.0, 8.0);
  char camera[160];
  if (draw.chance(pinholes)) {
    std::snprintf(camera, sizeof camera, R"({"pinhole": {"diameter_mm": %.3f}})",
                  draw.log_uniform(0.2, 1.0));
  } else {
    std::snprintf(
        camera, sizeof camera,
        R"({"lens": {"focal_length_mm": 50, "f_number": %.3f, "focus_distance_m": %.3f}})",
        f_number, focus_m);
  }
  char quality[64];
  if (draw.chance(0.25)) {
    std::snprintf(quality, sizeof quality, R"({"samples": %d})",
                  static_cast<int>(std::lround(draw.log_uniform(1.0, 64.0))));
  } else {
    std::snprintf(quality, sizeof quality, R"({"max_error": %.5f})", draw.log_uniform(0.003, 0.1));
  }
  // 3 : 2, as the sensor is.
  char text[512];
  std::snprintf(
      text, sizeof text,
      R"({"scene": "%s", "camera": %s, "image": {"width": %d, "height": %d}, "quality": %s})",
      scene.c_str(), camera, 3 * (2 * columns / 3), 2 * (2 * columns / 3), quality);
  return text;
}

struct Ready {
  std::shared_ptr<const RayScene> scene = {};
  std::string hash = {};
};

double share_within_2(const std::vector<double>& ratios, std::size_t first) {
  const auto is_near = [](double ratio) { return ratio >= 0.5 && ratio <= 2.0; };
  const auto begin = ratios.begin() + static_cast<std::ptrdiff_t>(std::min(first, ratios.size()));
  const auto all = static_cast<double>(ratios.end() - begin);
  return all > 0.0 ? static_cast<double>(std::count_if(begin, ratios.end(), is_near)) / all : 0.0;
}

// A row of server/measured_costs.cpp.
void write_row(std::ostream& out, const server::CostObservation& row) {
  const server::CostFeatures& f = row.asked;
  char text[200];
  std::snprintf(text, sizeof text,
                "    {%.2f, %.2f, %.2f, %.2f, %.2f, %.2f, %.2f, %d, %d, %d, %.2f, %.2f, 0x%llx},\n",
                f.pixels, f.error, f.samples, f.f_number, f.diffraction, f.blur, f.transform,
                int{f.is_pinhole}, int{f.is_forced}, int{row.is_wave}, row.log_samples,
                row.log_nanoseconds, static_cast<unsigned long long>(f.scene));
  out << text;
}

double load() {
  double average = 0.0;
  return getloadavg(&average, 1) == 1 ? average : -1.0;
}

struct Wanted {
  int requests = 300;
  std::uint64_t seed = 1;
  std::string csv = "/dev/null";
  std::string rows = "/dev/null";
  double pinholes = 0.15;
};

void run(const Wanted& wanted) {
  const api::Limits limits;
  const api::SceneStore store({std::string(FSTOP_SOURCE_DIR) + "/core/scenes"}, limits);
  WorkerPool workers(0);
  server::CostModel model(workers.threads());
  std::map<std::string, Ready> scenes;
  std::ofstream csv(wanted.csv);
  std::ofstream table(wanted.rows);
  csv << "scene,width,height,pinhole,f_number,focus_m,max_error,samples,n_w,method,samples_mean,"
         "rays,"
         "predicted_ms,cpu_ms\n";
  Draw draw(wanted.seed);
  std::vector<double> ratios;
  std::printf("load %.1f at the start\n", load());
  for (int i = 0; i < wanted.requests; ++i) {
    const auto number = static_cast<std::size_t>(draw.unit() * double(scene_names().size()));
    const std::string& name = scene_names()[number];
    const api::RenderRequest request = api::parse_render_request(
        random_request(draw, name, wanted.pinholes), limits, api::SceneNames::stored_only);
    Ready& ready = scenes[name];
    if (!ready.scene) {
      api::LoadedScene loaded = store.load(request);
      ready = {std::make_shared<const RayScene>(std::move(loaded.scene)), loaded.hash};
    }
    SimulationSpec spec = request.spec;
    spec.outputs = {Output::color, Output::depth, Output::coc};  // what the server keeps
    const double predicted_ms = 1e3 * model.predict(spec, ready.hash).cpu_s;
    const double start = processor_ms();
    const Photograph photograph = simulate(spec, *ready.scene, {.workers = &workers});
    const double actual_ms = processor_ms() - start;
    const RenderReport& report = photograph.report;
    const server::CostModel::Done done = {
        .method = report.method, .samples_mean = report.cost.samples_mean, .cpu_ms = actual_ms};
    model.learn(spec, ready.hash, done);
    write_row(table, server::observed_cost(spec, ready.hash, done));
    ratios.push_back(predicted_ms / actual_ms);
    const auto* lens = std::get_if<LensSpec>(&spec.camera.optics);
    csv << name << ',' << spec.width << ',' << spec.height << ',' << (lens == nullptr) << ','
        << (lens == nullptr ? 0.0 : lens->lens.f_number) << ','
        << (lens == nullptr ? 0.0 : lens->focus_distance.si()) << ',' << spec.quality.max_error
        << ',' << spec.quality.samples.value_or(0) << ',' << working_f_number(spec.camera) << ','
        << report.method << ',' << report.cost.samples_mean << ',' << report.cost.rays << ','
        << predicted_ms << ',' << actual_ms << '\n'
        << std::flush;
  }
  std::vector<double> sorted = ratios;
  std::ranges::sort(sorted);
  const auto quantile = [&](double q) {
    return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
  };
  std::printf(
      "%d requests: predicted within a factor of 2 of the processor time: %.1f %%; after "
      "the first %d: %.1f %%\n",
      wanted.requests, 100.0 * share_within_2(ratios, 0), kWarmUp,
      100.0 * share_within_2(ratios, kWarmUp));
  std::printf(
      "predicted over actual, quantiles 2.5, 25, 50, 75, 97.5 %%: %.2f %.2f %.2f %.2f %.2f\n",
      quantile(0.025), quantile(0.25), quantile(0.5), quantile(0.75), quantile(0.975));
  std::printf("load %.1f at the end\n", load());
}

}  // namespace
}  // namespace fstop

int main(int argc, char** argv) {
  fstop::Wanted wanted;
  if (argc > 1) wanted.requests = std::max(1, std::atoi(argv[1]));
  if (argc > 2) wanted.seed = std::strtoull(argv[2], nullptr, 10);
  if (argc > 3) wanted.csv = argv[3];
  if (argc > 4) wanted.rows = argv[4];
  if (argc > 5) wanted.pinholes = std::atof(argv[5]);
  fstop::run(wanted);
}
