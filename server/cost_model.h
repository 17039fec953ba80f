#pragma once

#include <cstddef>
#include <deque>
#include <mutex>
#include <string>
#include <unordered_map>

#include "api/problem.h"
#include "api/render_request.h"

namespace fstop::server {

/// Predicts what a render will take before anything is allocated for it, from what renders took
/// before: pixels x samples x time of a sample. Knows the scene and, coarsely, camera and method;
/// where it has met neither it goes by all renders, at first by constants measured for the bundled
/// scenes.
class CostModel {
 public:
  explicit CostModel(int threads) : threads_(threads) {}

  api::CostPrediction predict(const SimulationSpec& spec, const std::string& scene_hash) const;
  /// After a render: its samples per pixel on average, and milliseconds of processor time.
  void learn(const SimulationSpec& spec, const std::string& scene_hash, double samples_mean,
             double cpu_ms);

 private:
  // Means over the latest renders, of logarithms: renders differ by factors.
  struct Memory {
    double log_samples = 0.0;    // a pixel, brought to max_error 0.01
    double log_sample_ns = 0.0;  // processor time of one
    int renders = 0;
    int chosen = 0;  // renders whose samples were not forced
  };
  Memory recalled(const SimulationSpec& spec, const std::string& scene_hash) const;
  void learn_as(const std::string& key, bool is_forced, double log_samples, double log_sample_ns);

  int threads_;
  mutable std::mutex mutex_;
  std::unordered_map<std::string, Memory> memories_ = {};
  std::deque<std::string> order_ = {};  // the keys, oldest first: the bound on them
};

}  // namespace fstop::server
