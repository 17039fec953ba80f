// Small bright emitters of the bundled night scene at 960 x 640, f/1.4: what a million splats cost,
// what share of the light reaches the film, and the error that camera rays are left with by how
// many more of them. One thread.

#include <cmath>
#include <cstdio>
#include <span>
#include <vector>

#include "api/limits.h"
#include "api/scene_assets.h"
#include "api/scene_json.h"
#include "api/scene_store.h"
#include "core/render/bokeh_splatting.h"
#include "core/render/sample_loop.h"
#include "tests/bench/thread_timer.h"

namespace {

using namespace fstop;

constexpr int kRuns = 5;
constexpr std::uint32_t kReference = 1U << 18;

Scene night() {
  const api::Limits limits;
  const api::SceneStore store({FSTOP_SOURCE_DIR "/core/scenes"}, limits);
  return api::load_scene(api::parse_scene_text(store.text("night"), limits),
                         folder_assets(store.folder_of("night"), limits.assets), "#", limits)
      .scene;
}

// relMSE as the literature counts it: squared error over the squared reference and 0.01.
double relative_mse(const std::vector<double>& image, const std::vector<double>& reference) {
  double sum = 0.0;
  for (std::size_t i = 0; i < image.size(); ++i) {
    sum += std::pow(image[i] - reference[i], 2) / (std::pow(reference[i], 2) + 0.01);
  }
  return sum / static_cast<double>(image.size());
}

double total(const std::vector<double>& image) {
  double sum = 0.0;
  for (const double value : image) sum += value;
  return sum;
}

struct Splats {
  SplatImage light;
  std::vector<SplatTotals> totals = {};
  std::uint64_t rays = 0;
  double points = 0.0;
  double seconds = 0.0;
};

Splats splats_of(const SplatSource& source, std::uint32_t replicate, std::uint32_t count) {
  const FilmProjection film(source.camera);
  Splats splats{.light = SplatImage(film.width, film.height)};
  std::vector<SplatRange> ranges;
  for (std::uint32_t i = 0; i < source.choice.emitters.size(); ++i) {
    ranges.push_back({.emitter = i, .count = count});
  }
  splats.totals.resize(ranges.size());
  splats.points = static_cast<double>(count) * static_cast<double>(ranges.size());
  const double start = thread_seconds();
  splats.rays = splat(source, replicate, ranges, splats.light, splats.totals, {});
  splats.seconds = thread_seconds() - start;
  return splats;
}

void report_costs(const SplatSource& source) {
  Splats last = splats_of(source, 0, 4096);
  const Timing timing = seconds_of([&] { last = splats_of(source, 0, 4096); }, kRuns);
  const double millions = last.points / 1e6;
  std::printf("%.3f M points, %.2f rays each: %.1f ms per million (median %.1f), %.1f ns a ray\n",
              millions, static_cast<double>(last.rays) / last.points,
              1e3 * timing.minimum / millions, 1e3 * timing.median / millions,
              1e9 * timing.minimum / static_cast<double>(last.rays));
  double seen = 0.0;
  double reached = 0.0;
  for (const SplatTotals& t : last.totals) {
    seen += t.seen_px;
    reached += t.reached_px;
  }
  std::printf("share of the emitters' light that reaches the film: %.4f\n", reached / seen);
}

void report_errors(const SplatSource& source, const SampleSource& rays) {
  const std::vector<double> truth = splats_of(source, 7, kReference).light.values();
  for (const std::uint32_t count : {1024U, 4096U, 16384U, 65536U}) {
    const Splats splats = splats_of(source, 1, count);
    std::printf("%8u points each: %8.3f CPU s, relMSE %.2e, light %.6f of the reference's\n", count,
                splats.seconds, relative_mse(splats.light.values(), truth),
                total(splats.light.values()) / total(truth));
  }
  for (const std::uint32_t count : {16U, 64U}) {
    Film all(rays.sensor.width, rays.sensor.height);
    Film masked(rays.sensor.width, rays.sensor.height);
    const double start = thread_seconds();
    trace_pass(rays, {.count = count}, all, {});
    const double seconds = thread_seconds() - start;
    all.end_pass(static_cast<int>(count));
    SampleSource without = rays;
    without.mask = source.choice.camera_mask;
    trace_pass(without, {.count = count}, masked, {});
    masked.end_pass(static_cast<int>(count));
    // The same rays with and without emitters: their difference is the emitters' light.
    const Image a = all.mean();
    const Image b = masked.mean();
    std::vector<double> light;
    for (std::size_t i = 0; i < a.pixels().size(); ++i) {
      light.push_back(double{a.pixels()[i]} - double{b.pixels()[i]});
    }
    std::printf("%8u camera rays: %10.3f CPU s, relMSE %.2e, light %.6f of the reference's\n",
                count, seconds, relative_mse(light, truth), total(light) / total(truth));
  }
}

}  // namespace

int main() {
  const double loading = thread_seconds();
  const RayScene scene(night());
  std::printf("scene ready after %.2f CPU s; %zu emitters\n", thread_seconds() - loading,
              scene.emitters().size());
  CameraSpec spec;
  spec.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 1.4}, .focus_distance = 2.0_m};
  const Sensor sensor = sensor_of(spec, 960, 640);
  const Camera camera = camera_of(spec, sensor);
  const EmitterChoice choice = emitter_choice(scene, camera, 1.0);
  int hidden = 0;
  double widest = 0.0;
  for (const SplattedEmitter& e : choice.emitters) {
    hidden += e.may_be_hidden ? 1 : 0;
    widest = std::max(widest, e.sharp_px);
  }
  std::printf(
      "%u found, %u bright, %zu splatted (sharp images up to %.1f px; %d may be hidden), "
      "%u beyond\n",
      choice.found, choice.bright, choice.emitters.size(), widest, hidden, choice.beyond);
  const SplatSource source{.scene = scene,
                           .camera = camera,
                           .choice = choice,
                           .pupil = PupilWarp({}),
                           .texture_width_px = 0.25F};
  const SampleSource rays{.scene = scene,
                          .camera = camera,
                          .sensor = sensor,
                          .pupil = PupilWarp({}),
                          .sequence = SampleSequence(0),
                          .texture_width_px = 0.25F};
  report_costs(source);
  report_errors(source, rays);
}
