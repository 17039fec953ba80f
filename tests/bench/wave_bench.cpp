// Time of a picture with diffraction, 1280 x 853 pixels of six cards at six depths, next to the
// Fourier transforms that it cannot do without, bare, in the same run: one of every layer and
// channel and three back, by OpenCV on one thread.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <vector>

#include <opencv2/core.hpp>

#include "core/render/simulation.h"

namespace {

using namespace fstop;

constexpr int kWidth = 1280;
constexpr int kHeight = 853;
constexpr int kRuns = 5;

Object card(double left, double bottom, double width, double height, double depth, int material) {
  // In units of the depth, so that cards keep their place in the frame.
  return {.shape = QuadObject{.corner = {left * depth, bottom * depth, -depth},
                              .edge_u = {width * depth, 0, 0},
                              .edge_v = {0, height * depth, 0}},
          .material = material};
}

Scene six_cards() {
  Scene scene;
  const std::vector<double> depths = {1.2, 1.5, 2.0, 3.0, 5.0, 10.0};
  for (int i = 0; i < 6; ++i) {
    const auto tone = static_cast<float>(0.2 + 0.12 * i);
    scene.materials.push_back({.emission = {.value = {tone, 1.0F - tone, 0.5F}}});
    const double depth = depths[static_cast<std::size_t>(i)];
    scene.objects.push_back(i == 5 ? card(-0.72, -0.48, 1.44, 0.96, depth, i)
                                   : card(-0.34 + 0.13 * i, -0.2 + 0.03 * i, 0.12, 0.25, depth, i));
  }
  return scene;
}

SimulationSpec shot_at(double f_number) {
  SimulationSpec spec;
  spec.camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = f_number}, .focus_distance = 2.0_m};
  spec.camera.sensor_height = spec.camera.sensor_width * (double(kHeight) / kWidth);
  spec.width = kWidth;
  spec.height = kHeight;
  spec.effects.diffraction = EffectChoice::on;
  return spec;
}

struct Times {
  double wall = 0.0;       // seconds, median
  double processor = 0.0;  // of all threads
};

template <typename Work>
Times timed(Work work) {
  std::vector<double> wall;
  std::vector<double> processor;
  for (int run = 0; run < kRuns; ++run) {
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t clock = std::clock();
    work();
    processor.push_back(double(std::clock() - clock) / CLOCKS_PER_SEC);
    wall.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::ranges::sort(wall);
  std::ranges::sort(processor);
  return {wall[kRuns / 2], processor[kRuns / 2]};
}

// Real transforms of the picture's padded plane with two cells along a pixel.
Times bare_transforms() {
  cv::setNumThreads(1);
  const cv::Mat plane(cv::getOptimalDFTSize(kHeight + 48) * 2,
                      cv::getOptimalDFTSize(kWidth + 48) * 2, CV_32F, cv::Scalar(0.5));
  cv::Mat spectrum;
  return timed([&] {
    for (int i = 0; i < 18; ++i) cv::dft(plane, spectrum);
    cv::Mat back;
    for (int i = 0; i < 3; ++i) {
      cv::idft(spectrum, back, cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
    }
  });
}

}  // namespace

int main() {
  const RayScene scene(six_cards());
  const Times transforms = bare_transforms();
  std::printf("%d x %d, six cards, max_error 0.01; 21 bare transforms take %.2f s\n\n", kWidth,
              kHeight, transforms.processor);
  std::printf("%-10s %8s %8s %10s %12s\n", "f-number", "threads", "wall s", "processor",
              "over bare");
  for (const double f_number : {16.0, 22.0, 32.0}) {
    for (const int threads : {1, 2, 4}) {
      WorkerPool workers(threads);
      const SimulationSpec spec = shot_at(f_number);
      const Times times = timed([&] { simulate(spec, scene, {.workers = &workers}); });
      std::printf("f/%-8.0f %8d %8.2f %8.2f s %11.2f\n", f_number, threads, times.wall,
                  times.processor, times.processor / transforms.processor);
    }
  }
  return 0;
}
