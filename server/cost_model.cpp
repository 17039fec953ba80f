#include "server/cost_model.h"

#include <algorithm>
#include <cmath>

namespace fstop::server {
namespace {

constexpr std::size_t kMostMemories = 4096;
constexpr double kSmoothing = 0.3;  // weight of the newest render
// Noise falls with samples as N^-0.6: scrambled nets on mixed scenes (core/render/progressive.h).
constexpr double kSamplesPerError = 1.0 / 0.6;
constexpr double kUsualError = 0.01;
// Of the bundled scenes at max_error 0.01, on one core at 2.6 GHz.
constexpr double kFirstSamples = 48.0;
constexpr double kFirstSample_ns = 250.0;
constexpr double kOnce_s = 0.004;  // planning, whatever the size
// Resident memory at 2400 x 1600 over that at 600 x 400, measured: 341 bytes a pixel for `wave`,
// which `auto` may choose, at most 150 for the others; 380 MiB once for a bundled scene and its
// planning.
constexpr double kBytesPerPixelOfWaves = 350.0;
constexpr double kBytesPerPixel = 150.0;
constexpr double kBytesOnce = 384.0 * (1 << 20);

double pixels_of(const SimulationSpec& spec) {
  return static_cast<double>(spec.width) * static_cast<double>(spec.height);
}

// Renders of one key cost about the same per pixel: method and aperture, by factors of two.
std::string key_of(const SimulationSpec& spec, const std::string& scene_hash) {
  const double aperture_m = pupil_diameter(spec.camera).si();
  const int octave = static_cast<int>(std::lround(std::log2(std::max(aperture_m, 1e-9))));
  return scene_hash + '/' + spec.quality.method + '/' + std::to_string(octave);
}

double error_factor(const SimulationSpec& spec) {
  return kSamplesPerError * std::log(kUsualError / std::max(spec.quality.max_error, 1e-6));
}

}  // namespace

CostModel::Memory CostModel::recalled(const SimulationSpec& spec,
                                      const std::string& scene_hash) const {
  Memory memory{.log_samples = std::log(kFirstSamples), .log_sample_ns = std::log(kFirstSample_ns)};
  for (const std::string& key : {std::string(), scene_hash, key_of(spec, scene_hash)}) {
    const auto found = memories_.find(key);
    if (found == memories_.end()) continue;
    if (found->second.renders > 0) memory.log_sample_ns = found->second.log_sample_ns;
    if (found->second.chosen > 0) memory.log_samples = found->second.log_samples;
  }
  return memory;
}

api::CostPrediction CostModel::predict(const SimulationSpec& spec,
                                       const std::string& scene_hash) const {
  Memory memory;
  {
    const std::lock_guard lock(mutex_);
    memory = recalled(spec, scene_hash);
  }
  const double pixels = pixels_of(spec);
  const QualitySpec& quality = spec.quality;
  double samples = quality.samples ? static_cast<double>(*quality.samples)
                                   : std::exp(memory.log_samples + error_factor(spec));
  if (!quality.samples)
    samples = std::clamp(samples, 1.0, static_cast<double>(quality.most_samples) / pixels);
  api::CostPrediction cost;
  cost.samples = pixels * samples;
  cost.cpu_s = kOnce_s + 1e-9 * cost.samples * std::exp(memory.log_sample_ns);
  if (quality.max_time_ms && !quality.samples)  // a forced count takes its time
    cost.cpu_s = std::min(cost.cpu_s, 1e-3 * *quality.max_time_ms * threads_);
  cost.wall_s = cost.cpu_s / threads_;
  const bool may_be_waves = quality.method == "auto" || quality.method == "wave";
  cost.memory_bytes = kBytesOnce + (may_be_waves ? kBytesPerPixelOfWaves : kBytesPerPixel) * pixels;
  return cost;
}

void CostModel::learn(const SimulationSpec& spec, const std::string& scene_hash,
                      double samples_mean, double cpu_ms) {
  if (!(samples_mean > 0.0) || !(cpu_ms > 0.0)) return;
  const double cpu_ns = std::max(1e6 * cpu_ms - 1e9 * kOnce_s, 1e3);
  const double log_sample_ns = std::log(cpu_ns / (samples_mean * pixels_of(spec)));
  const double log_samples = std::log(samples_mean) - error_factor(spec);
  const bool is_forced = spec.quality.samples || spec.quality.max_time_ms;
  const std::lock_guard lock(mutex_);
  for (const std::string& key : {std::string(), scene_hash, key_of(spec, scene_hash)})
    learn_as(key, is_forced, log_samples, log_sample_ns);
}

void CostModel::learn_as(const std::string& key, bool is_forced, double log_samples,
                         double log_sample_ns) {
  const auto [place, is_new] = memories_.try_emplace(key);
  if (is_new && !key.empty()) order_.push_back(key);
  Memory& memory = place->second;
  const auto blend = [](double& mean, double value, int count) {
    mean += (count == 0 ? 1.0 : kSmoothing) * (value - mean);
  };
  blend(memory.log_sample_ns, log_sample_ns, memory.renders++);
  if (!is_forced) blend(memory.log_samples, log_samples, memory.chosen++);
  if (order_.size() <= kMostMemories) return;
  memories_.erase(order_.front());
  order_.pop_front();
}

}  // namespace fstop::server
