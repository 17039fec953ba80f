#pragma once

#include <string>

#include "api/limits.h"
#include "server/cost_model.h"
#include "server/render_cache.h"
#include "server/render_queue.h"
#include "server/render_work.h"
#include "server/scene_cache.h"
#include "server/sweep_cells.h"

namespace fstop::server {

/// What a server's renders are made with.
struct CellServices {
  const api::Limits& limits;
  RenderQueue& queue;
  RenderWork& work;
  RenderCache& renders;
  SceneCache& scenes;
  CostModel& costs;
};

/// Makes cells as the renders of one client among others: by the server's queue and its worker
/// processes, as many at once as there are slots, sharing renders that are under way or kept.
class QueueCellMaker : public CellMaker {
 public:
  /// `client`: whose turns they take.
  QueueCellMaker(CellServices services, std::string client, ContentStore& store)
      : services_(services), client_(std::move(client)), store_(store) {}
  void make(const std::vector<SweepCell>& cells, const Listener& listener,
            std::stop_token stop) override;

 private:
  class Telling;
  CellOutcome made(const SweepCell& cell, ContentStore& store, const Telling& telling,
                   const std::stop_token& stop);
  std::shared_ptr<StoredRender> rendered(const RenderTask& task, const Telling& telling,
                                         const std::stop_token& stop);
  std::shared_ptr<StoredRender> awaited(const RenderTask& task, const std::stop_token& stop);

  CellServices services_;
  std::string client_;
  ContentStore& store_;
};

}  // namespace fstop::server
