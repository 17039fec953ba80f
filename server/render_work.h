#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "api/limits.h"
#include "api/render_request.h"
#include "server/cost_model.h"
#include "server/cpu_meter.h"
#include "server/log.h"
#include "server/metrics.h"
#include "server/render_cache.h"
#include "server/render_queue.h"
#include "server/scene_cache.h"
#include "server/worker_crew.h"
#include "server/worker_messages.h"

namespace fstop::server {

/// The light path, or what a test puts in its place.
using Simulate =
    std::function<Photograph(const SimulationSpec&, const RayScene&, const RunControl&)>;

/// What renders work with.
struct WorkServices {
  const api::Limits& limits;
  Log& log;
  Metrics& metrics;
  RenderCache& renders;
  SceneCache& scenes;
  CostModel& costs;
  WorkerCrew* crew;   // null: renders run in this process
  Simulate simulate;  // then: the light path, on
  WorkerPool& pool;
};

/// A request with its scene identified and its cost predicted.
struct RenderTask {
  std::shared_ptr<const api::RenderRequest> request = {};
  std::string scene_hash = {};
  std::string id = {};
  ImageFormat format = ImageFormat::png;  // which file is made with the render
  api::CostPrediction cost = {};
  bool is_small = false;  // goes before large ones

  /// Whether the result may be given to others: a render bound in time depends on the load.
  bool is_kept() const { return !request->spec.quality.max_time_ms; }
};

/// Makes renders: each thread of the queue leads one worker process through one at a time.
class RenderWork {
 public:
  explicit RenderWork(WorkServices services) : services_(std::move(services)) {}

  /// Renders, encodes the first file, keeps both. A render whose worker process died is tried once
  /// more. Throws: as simulate(); Refusal 500 where it died twice, 504 for a render past its time,
  /// 507 for one that cannot be kept.
  std::shared_ptr<StoredRender> render(const RenderTask& task, const RenderQueue::Turn& turn);

 private:
  WorkerResult made(const RenderTask& task, const RenderQueue::Turn& turn);
  WorkerResult made_apart(const RenderTask& task, const SimulationSpec& spec,
                          const RenderQueue::Turn& turn);
  WorkerResult made_here(const RenderTask& task, const SimulationSpec& spec,
                         const RenderQueue::Turn& turn);
  Photograph simulate_in_time(const SimulationSpec& spec, const RayScene& scene,
                              const RenderQueue::Turn& turn);
  void finish(const RenderTask& task, const std::shared_ptr<StoredRender>& stored, double build_ms);

  WorkServices services_;
  CpuMeter cpu_;  // of renders in this process
};

}  // namespace fstop::server
