#include "server/cost_model.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <deque>
#include <mutex>
#include <span>
#include <vector>

#include "server/gaussian_process.h"
#include "server/measured_costs.h"

namespace fstop::server {
namespace {

constexpr std::size_t kRemembered = 1024;  // renders of this server
constexpr std::size_t kNearest = 64;       // renders that a prediction is made from
const double kLogFewest = std::log(4.0);   // samples of a pixel, whatever error is asked for
// Resident memory at 2400 x 1600 over that at 600 x 400, measured: 341 bytes a pixel for `wave`,
// which `auto` may choose, at most 150 for the others; 380 MiB once for a bundled scene and its
// planning.
constexpr double kBytesPerPixelOfWaves = 350.0;
constexpr double kBytesPerPixel = 150.0;
constexpr double kBytesOnce = 384.0 * (1 << 20);

double bytes_of_waves(const SimulationSpec& spec, double log_diffraction_px) {
  const double pixels = static_cast<double>(spec.width) * spec.height;
  return std::max(kBytesPerPixelOfWaves * pixels,
                  transform_bytes(std::exp(log_diffraction_px), spec.width, spec.height));
}

double square(double x) { return x * x; }

// The figures below are those that told 1900 renders of the bundled scenes best, each from the ones
// before it and the measured ones; a third more or less changes little.

// First guesses, in logarithms: samples of a pixel, and nanoseconds of one.
double guessed_samples(const CostFeatures& f) {
  if (f.is_forced) return f.samples + std::log(8.0);
  return std::max(kLogFewest, 3.4 - 1.45 * f.error - 0.25 * f.pixels - 0.05 * f.f_number);
}
double guessed_time(const CostFeatures& f, bool is_wave) {
  const double twice = f.is_twice ? 0.8 : 0.0;
  if (!is_wave)
    return 5.9 + 0.88 * std::log(std::exp(guessed_samples(f)) + 3.0) - 0.27 * f.pixels + twice;
  // Waves take samples where edges hide them: of many they take all their time.
  const double forced = f.is_forced ? f.samples - std::log(4.0) : 0.0;
  const double many = f.is_forced ? std::max(0.0, f.samples - std::log(8.0)) : 0.0;
  return 8.0 + 0.4 * forced + 0.6 * many + 0.6 * f.transform - 0.15 * f.pixels + twice;
}

// Whether waves are chosen: 1 for sure, -1 surely not.
double guessed_waves(const CostFeatures& f) {
  const double enough = f.is_pinhole ? -1.0 : -0.8;
  return std::tanh(10.0 * (f.diffraction + 0.35 * f.error - enough));
}

// How much of what one kind of request shows holds of another kind.
double alike(const CostFeatures& a, const CostFeatures& b) {
  if (a.kind != b.kind) return 0.5;
  return a.is_twice == b.is_twice ? 1.0 : 0.9;
}

// Covariances of what two renders differ by from the first guesses.
double time_covariance(const CostFeatures& a, const CostFeatures& b, bool is_wave) {
  const double far = square((a.pixels - b.pixels) / 4.5) + square((a.error - b.error) / 1.5) +
                     square((a.f_number - b.f_number) / 1.7) + square((a.blur - b.blur) / 2.9) +
                     (is_wave ? square((a.transform - b.transform) / 0.7) : 0.0);
  const bool same_scene = a.scene == b.scene;
  const bool same_quality = a.is_forced == b.is_forced;
  double covariance =
      0.81 * (same_quality ? 1.0 : 0.7) * (same_scene ? 1.0 : 0.85) * std::exp(-0.5 * far);
  if (same_scene)
    covariance +=
        (same_quality ? 4.0 : 3.8) + 0.03 * a.samples * b.samples + 0.02 * a.error * b.error;
  return alike(a, b) * covariance;
}
constexpr double kTimeNoise = 0.11;  // variances

double choice_covariance(const CostFeatures& a, const CostFeatures& b) {
  if (a.is_pinhole != b.is_pinhole) return 0.0;
  const double far = square((a.error - b.error) / 0.85) + square((a.f_number - b.f_number) / 0.4) +
                     square((a.pixels - b.pixels) / 1.25);
  return 0.72 * alike(a, b) * (a.scene == b.scene ? 1.0 : 0.65) * std::exp(-0.5 * far);
}
constexpr double kChoiceNoise = 0.12;

struct Known {
  CostObservation render = {};
  bool is_own = true;  // made by this server
};

// What is expected at `asked` beyond the first guess, from those of `known` that `counts` and that
// correlate most with it; of equals the newest.
template <typename Counts, typename Covariance, typename Beyond>
double expected_beyond(const std::deque<Known>& known, const CostFeatures& asked, double noise,
                       const Counts& counts, const Covariance& covariance, const Beyond& beyond) {
  struct Near {
    const Known* known = nullptr;
    double covariance = 0.0;
    std::size_t age = 0;
  };
  std::vector<Near> near;
  near.reserve(known.size());
  for (auto one = known.rbegin(); one != known.rend(); ++one) {
    if (!counts(*one)) continue;
    const double with = covariance(one->render.asked, asked);
    if (with > 0.0) near.push_back({&*one, with, near.size()});
  }
  const std::size_t n = std::min(kNearest, near.size());
  const auto comes_first = [](const Near& a, const Near& b) {
    return a.covariance != b.covariance ? a.covariance > b.covariance : a.age < b.age;
  };
  std::ranges::partial_sort(near, near.begin() + static_cast<std::ptrdiff_t>(n), comes_first);
  std::vector<double> observed(n);
  std::vector<double> with(n);
  std::vector<double> between(n * n);
  for (std::size_t i = 0; i < n; ++i) {
    observed[i] = beyond(*near[i].known);
    with[i] = near[i].covariance;
    for (std::size_t j = 0; j <= i; ++j) {
      between[i * n + j] = covariance(near[i].known->render.asked, near[j].known->render.asked);
      between[j * n + i] = between[i * n + j];
    }
    between[i * n + i] += noise;
  }
  return conditional_mean(observed, between, with);
}

}  // namespace

struct CostModel::Memory {
  Memory() {
    for (const CostObservation& render : measured_costs()) known.push_back({render, false});
  }

  // Logarithm of a pixel's time over that on the processor of the measured ones.
  double slowness() const { return slowness_sum / (slowness_count + 2.0); }

  bool is_wave(const SimulationSpec& spec, const CostFeatures& asked) const {
    if (spec.quality.method != "auto") return spec.quality.method == "wave";
    if (spec.effects.diffraction == EffectChoice::off) return false;
    const double beyond = expected_beyond(
        known, asked, kChoiceNoise, [](const Known&) { return true; }, choice_covariance,
        [](const Known& one) {
          return (one.render.is_wave ? 1.0 : -1.0) - guessed_waves(one.render.asked);
        });
    return guessed_waves(asked) + beyond > 0.0;
  }

  double log_samples(const CostFeatures& asked, bool is_wave) const {
    if (asked.is_forced) return guessed_samples(asked);
    const double beyond = expected_beyond(
        known, asked, kTimeNoise,
        [&](const Known& one) {
          return one.render.is_wave == is_wave && !one.render.asked.is_forced;
        },
        [&](const auto& a, const auto& b) { return time_covariance(a, b, is_wave); },
        [](const Known& one) {
          return one.render.log_samples - guessed_samples(one.render.asked);
        });
    return std::max(kLogFewest, guessed_samples(asked) + beyond);
  }

  // On this processor; without own renders on that of the measured ones.
  double log_time(const CostFeatures& asked, bool is_wave, bool with_own) const {
    const double slower = with_own ? slowness() : 0.0;
    const double beyond = expected_beyond(
        known, asked, kTimeNoise,
        [&](const Known& one) {
          return one.render.is_wave == is_wave && (with_own || !one.is_own);
        },
        [&](const auto& a, const auto& b) { return time_covariance(a, b, is_wave); },
        [&](const Known& one) {
          return one.render.log_nanoseconds - guessed_time(one.render.asked, is_wave) +
                 (one.is_own ? 0.0 : slower);
        });
    return guessed_time(asked, is_wave) + beyond;
  }

  void learn(const CostObservation& done) {
    const std::span<const CostObservation> measured = measured_costs();
    const auto is_alike = [&](const CostObservation& one) {
      return one.asked.scene == done.asked.scene && one.asked.kind == done.asked.kind;
    };
    if (std::ranges::any_of(measured, is_alike)) {
      constexpr double kMost = 2.0;  // of one render: a chance, no processor
      const double told = log_time(done.asked, done.is_wave, false);
      slowness_sum += std::clamp(done.log_nanoseconds - told, -kMost, kMost);
      slowness_count += 1.0;
    }
    known.push_back({done});
    if (known.size() > measured.size() + kRemembered)
      known.erase(known.begin() + static_cast<std::ptrdiff_t>(measured.size()));
  }

  std::mutex mutex = {};
  std::deque<Known> known = {};  // the measured ones, then this server's, the oldest first
  double slowness_sum = 0.0;
  double slowness_count = 0.0;
};

CostModel::CostModel(int threads, double most_wall_s)
    : threads_(threads), most_wall_s_(most_wall_s), memory_(std::make_unique<Memory>()) {}
CostModel::~CostModel() = default;

api::CostPrediction CostModel::predict(const SimulationSpec& spec,
                                       const std::string& scene_hash) const {
  const double pixels = static_cast<double>(spec.width) * spec.height;
  const QualitySpec& quality = spec.quality;
  const CostFeatures asked = cost_features(spec, scene_hash);
  double samples = 0.0;
  double log_ns = 0.0;
  {
    const std::lock_guard lock(memory_->mutex);
    const bool is_wave = memory_->is_wave(spec, asked);
    samples = std::exp(memory_->log_samples(asked, is_wave));
    log_ns = memory_->log_time(asked, is_wave, true);
  }
  const double most = std::max(1.0, static_cast<double>(quality.most_samples) / pixels);
  if (quality.samples) {
    samples = static_cast<double>(*quality.samples);
  } else if (samples > most) {
    log_ns += std::log(most / samples);
    samples = most;
  }
  api::CostPrediction cost;
  cost.samples = pixels * samples;
  cost.cpu_s = 1e-9 * pixels * std::exp(log_ns);
  if (quality.max_time_ms && !quality.samples)  // a forced count takes its time
    cost.cpu_s = std::min(cost.cpu_s, 1e-3 * *quality.max_time_ms * threads_);
  // Too many forced samples are refused: their prediction says why.
  if (!quality.samples) cost.cpu_s = std::min(cost.cpu_s, most_wall_s_ * threads_);
  cost.wall_s = cost.cpu_s / threads_;
  const bool may_be_waves = quality.method == "auto" || quality.method == "wave";
  cost.memory_bytes = kBytesOnce + (may_be_waves ? bytes_of_waves(spec, asked.diffraction)
                                                 : kBytesPerPixel * pixels);
  return cost;
}

bool CostModel::knows(const SimulationSpec& spec, const std::string& scene_hash) const {
  const CostFeatures asked = cost_features(spec, scene_hash);
  const std::lock_guard lock(memory_->mutex);
  return std::ranges::any_of(memory_->known, [&](const Known& one) {
    return one.render.asked.scene == asked.scene && one.render.asked.kind == asked.kind;
  });
}

void CostModel::learn(const SimulationSpec& spec, const std::string& scene_hash, const Done& done) {
  if (!(done.samples_mean > 0.0) || !(done.cpu_ms > 0.0)) return;
  const CostObservation observation = observed_cost(spec, scene_hash, done);
  const std::lock_guard lock(memory_->mutex);
  memory_->learn(observation);
}

CostObservation observed_cost(const SimulationSpec& spec, const std::string& scene_hash,
                              const CostModel::Done& done) {
  CostFeatures asked = cost_features(spec, scene_hash);
  if (spec.quality.max_time_ms && !asked.is_forced)
    asked = with_forced_samples(asked, done.samples_mean);
  const double pixels = static_cast<double>(spec.width) * spec.height;
  return {.asked = asked,
          .is_wave = done.method == "wave",
          .log_samples = std::log(done.samples_mean),
          .log_nanoseconds = std::log(1e6 * done.cpu_ms / pixels)};
}

}  // namespace fstop::server
