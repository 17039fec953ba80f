#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/awaitable.hpp>

#include "api/composite.h"
#include "api/limits.h"
#include "api/scene_store.h"
#include "server/cost_model.h"
#include "server/log.h"
#include "server/negotiation.h"
#include "server/render_cache.h"
#include "server/render_queue.h"
#include "server/render_work.h"
#include "server/routes.h"
#include "server/scene_cache.h"
#include "server/sent_image.h"
#include "server/workers.h"

namespace fstop::server {

/// What POST /v1/composites works with.
struct CompositeServices {
  const api::Limits& limits;
  Log& log;
  Workers& readers;   // read requests and scenes
  Workers& encoders;  // make files
  RenderWork& work;
  RenderQueue& queue;  // that of the renders
  RenderCache& renders;
  SceneCache& scenes;
  CostModel& costs;
  const api::SceneStore& store;
  std::string program;                // fstop itself, which reads pictures that are sent
  const std::atomic<bool>& draining;  // no new work
};

/// POST /v1/composites. A composite takes one turn in the queue of the renders: there its layers
/// are rendered one after the other, each kept under its own id, and put together. Equal composites
/// that meet share that work; it stops when the last client has gone.
class CompositeCalls {
 public:
  explicit CompositeCalls(CompositeServices services)
      : services_(std::move(services)),
        images_(services_.program, services_.log, services_.limits) {}
  void add_to(Routes& routes);

 private:
  struct Prepared {
    std::shared_ptr<const api::CompositeRequest> request = {};
    std::vector<std::optional<RenderTask>> renders = {};  // by layer, where one is to be rendered
    std::string id = {};
    Representation wanted = {};  // a format, or the report
    double cost_s = 0.0;
    double memory_bytes = 0.0;
  };
  struct Finished;

  boost::asio::awaitable<Reply> create(Call& call);
  Prepared prepare(const Request& request);
  RenderTask task_of(const api::RenderRequest& request) const;
  std::vector<std::byte> stored_file(const api::LayerImage& image, std::size_t layer) const;
  std::shared_ptr<Finished> composed(const Prepared& prepared, const RenderQueue::Turn& turn);
  api::LayerPicture picture_of(const Prepared& prepared, std::size_t layer,
                               const RenderQueue::Turn& turn);
  api::LayerPicture rendered(const RenderTask& task, std::size_t layer,
                             const RenderQueue::Turn& turn);
  api::LayerPicture sent(const api::LayerImage& image, std::size_t layer);

  CompositeServices services_;
  SentImageReader images_;
  int preparing_ = 0;  // requests on the readers now
};

}  // namespace fstop::server
