// Sampling patterns: their spectra, and how the error of one picture falls with their samples.
#include <cmath>
#include <complex>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

#include "core/measure/image_difference.h"
#include "core/render/simulation.h"
#include "core/sampling/patterns.h"
#include "core/sampling/sequence.h"
#include "tests/bench/bench_scenes.h"

namespace fstop {
namespace {

struct NamedPattern {
  const char* name = "";
  SamplePattern pattern = SamplePattern::low_discrepancy;
};
constexpr std::array<NamedPattern, 5> kPatterns = {
    {{"regular", SamplePattern::regular},
     {"jittered", SamplePattern::jittered},
     {"poisson", SamplePattern::poisson},
     {"poisson-disc", SamplePattern::poisson_disc},
     {"low-discrepancy", SamplePattern::low_discrepancy}}};

constexpr int kPoints = 256;
constexpr std::uint32_t kSets = 32;
constexpr int kHighest = 48;  // waves across the square

using Points = std::vector<std::array<double, 2>>;

Points points_of(SamplePattern pattern, std::uint32_t seed) {
  if (pattern != SamplePattern::low_discrepancy) return pattern_points(pattern, kPoints, seed);
  const SampleSequence sequence(seed);
  Points points;
  for (std::uint32_t first = 0; first < kPoints; first += kLanes) {
    SampleKeys keys;
    for (std::uint32_t i = 0; i < kLanes; ++i) keys.index[i] = first + i;
    LaneValues x, y;
    sequence.fill(keys, Dimension::pixel_x, x);
    sequence.fill(keys, Dimension::pixel_y, y);
    for (std::size_t i = 0; i < kLanes; ++i) points.push_back({x[i], y[i]});
  }
  return points;
}

// Mean power of the waves of each whole frequency, 1 for independent points.
std::vector<double> radial_power(SamplePattern pattern) {
  std::vector<double> sum(kHighest + 1);
  std::vector<double> waves(kHighest + 1);
  for (std::uint32_t seed = 0; seed < kSets; ++seed) {
    const Points points = points_of(pattern, seed);
    for (int fx = -kHighest; fx <= kHighest; ++fx) {
      for (int fy = 0; fy <= kHighest; ++fy) {
        const int ring = static_cast<int>(std::lround(std::hypot(fx, fy)));
        if (ring < 1 || ring > kHighest) continue;
        std::complex<double> wave = 0.0;
        for (const auto& [x, y] : points) {
          wave += std::polar(1.0, -2.0 * std::numbers::pi * (fx * x + fy * y));
        }
        sum[static_cast<std::size_t>(ring)] += std::norm(wave) / kPoints;
        waves[static_cast<std::size_t>(ring)] += 1.0;
      }
    }
  }
  for (std::size_t i = 1; i < sum.size(); ++i) sum[i] /= waves[i];
  return sum;
}

SimulationSpec picture(int samples, std::uint32_t seed) {
  SimulationSpec spec;
  spec.camera.optics = LensSpec{.lens = {.focal_length = Length::si(0.05), .f_number = 1.4},
                                .focus_distance = Length::si(2.0)};
  spec.width = 192;
  spec.height = 128;
  spec.effects.diffraction = EffectChoice::off;
  spec.quality.method = "lens-sampling";
  spec.quality.samples = samples;
  spec.seed = seed;
  return spec;
}

void write_spectra(std::ofstream& csv) {
  csv << "frequency";
  std::vector<std::vector<double>> spectra;
  for (const NamedPattern& p : kPatterns) {
    csv << ';' << p.name;
    spectra.push_back(radial_power(p.pattern));
  }
  csv << '\n';
  for (std::size_t f = 1; f <= kHighest; ++f) {
    csv << f;
    for (const auto& spectrum : spectra) csv << ';' << spectrum[f];
    csv << '\n';
  }
}

// The same pattern for pixel and lens; the mean of four seeds' squared errors.
void write_convergence(std::ofstream& csv) {
  const RayScene scene(bench_slats());
  WorkerPool pool(0);
  const RunControl run{.workers = &pool};
  const Image truth = simulate(picture(16384, 999), scene, run).color;
  csv << "samples";
  for (const NamedPattern& p : kPatterns) csv << ';' << p.name;
  csv << '\n';
  for (const int samples : {2, 8, 32, 128, 512}) {  // halves are squares: square cells
    csv << samples;
    for (const NamedPattern& p : kPatterns) {
      double squares = 0.0;
      constexpr std::uint32_t kSeeds = 4;
      for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
        SimulationSpec spec = picture(samples, seed);
        spec.quality.sampling = {.pixel = p.pattern, .lens = p.pattern};
        const Photograph made = simulate(spec, scene, run);
        const double rmse = image_difference(made.color.view(), truth.view()).rmse;
        squares += rmse * rmse / kSeeds;
      }
      const double rmse = std::sqrt(squares);
      csv << ';' << rmse;
      std::printf("%4d samples  %-16s RMSE %.5f\n", samples, p.name, rmse);
    }
    csv << '\n';
  }
}

}  // namespace
}  // namespace fstop

// pattern_bench FOLDER: FOLDER/spectra.csv and convergence.csv.
int main(int count, char** words) {
  const std::filesystem::path folder = count > 1 ? words[1] : "build/bench";
  std::filesystem::create_directories(folder);
  std::ofstream spectra(folder / "spectra.csv");
  fstop::write_spectra(spectra);
  std::ofstream convergence(folder / "convergence.csv");
  fstop::write_convergence(convergence);
  return spectra && convergence ? 0 : 1;
}
