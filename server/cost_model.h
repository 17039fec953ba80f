#pragma once

#include <limits>
#include <memory>
#include <string>
#include <string_view>

#include "api/problem.h"
#include "api/render_request.h"
#include "server/measured_costs.h"

namespace fstop::server {

/// Predicts what a render will take before anything is allocated for it, from what renders near it
/// took: of the same scene, of others, and, until this server has made its own, of those that were
/// measured once (server/measured_costs.h), whose processor's speed is told by the first few here.
/// Source: Gaussian process regression about a first guess (Rasmussen & Williams 2006, section
/// 2.7), of the renders that correlate most with the one asked for.
class CostModel {
 public:
  /// `most_wall_s`: what a render is stopped after, and so takes at most.
  explicit CostModel(int threads, double most_wall_s = std::numeric_limits<double>::infinity());
  ~CostModel();

  api::CostPrediction predict(const SimulationSpec& spec, const std::string& scene_hash) const;

  /// Whether renders of the scene, of a request's kind, were measured.
  bool knows(const SimulationSpec& spec, const std::string& scene_hash) const;

  /// A render that is done.
  struct Done {
    std::string_view method = {};
    double samples_mean = 0.0;  // a pixel
    double cpu_ms = 0.0;        // processor time of the light path
  };
  void learn(const SimulationSpec& spec, const std::string& scene_hash, const Done& done);

 private:
  struct Memory;
  int threads_;
  double most_wall_s_;
  std::unique_ptr<Memory> memory_;
};

/// What `done` tells of its request.
CostObservation observed_cost(const SimulationSpec& spec, const std::string& scene_hash,
                              const CostModel::Done& done);

}  // namespace fstop::server
