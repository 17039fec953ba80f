#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "api/problem.h"
#include "api/render_request.h"

namespace fstop::server {

/// Predicts what a render will take before anything is allocated for it, from what renders took
/// before: how many samples an error takes, what a pixel costs at so many, and which requests the
/// planner gives to `wave`, by scene, kind of camera and effects. Of a scene that it has not met it
/// believes what it learnt of the others, at first what was measured for the bundled ones.
class CostModel {
 public:
  explicit CostModel(int threads);
  ~CostModel();

  api::CostPrediction predict(const SimulationSpec& spec, const std::string& scene_hash) const;

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
  std::unique_ptr<Memory> memory_;
};

}  // namespace fstop::server
