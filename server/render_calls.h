#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include <boost/asio/awaitable.hpp>

#include "api/limits.h"
#include "api/render_request.h"
#include "api/scene_store.h"
#include "server/cpu_meter.h"
#include "server/log.h"
#include "server/negotiation.h"
#include "server/render_cache.h"
#include "server/render_queue.h"
#include "server/routes.h"
#include "server/scene_cache.h"
#include "server/workers.h"

namespace fstop::server {

/// The light path, or what a test puts in its place.
using Simulate =
    std::function<Photograph(const SimulationSpec&, const RayScene&, const RunControl&)>;

/// What the calls under /v1/renders work with.
struct RenderServices {
  const api::Limits& limits;
  Log& log;
  Workers& readers;   // read requests and scenes
  Workers& encoders;  // make files
  WorkerPool& pool;   // renders
  RenderQueue& queue;
  RenderCache& renders;
  SceneCache& scenes;
  const bool& draining;  // no new work; changes on the I/O thread
  Simulate simulate;
};

/// POST /v1/renders and what it leaves under /v1/renders/{id}.
class RenderCalls {
 public:
  explicit RenderCalls(RenderServices services) : services_(std::move(services)) {}
  void add_to(Routes& routes);

 private:
  // A request with its scene identified.
  struct Prepared {
    std::shared_ptr<const api::RenderRequest> request = {};
    std::string scene_hash = {};
    std::string id = {};
    Representation wanted = {};
  };

  boost::asio::awaitable<Reply> create(Call& call);
  boost::asio::awaitable<Reply> report(Call& call);
  boost::asio::awaitable<Reply> image(Call& call);
  boost::asio::awaitable<Reply> output(Call& call);

  Prepared prepare(const Request& request);
  boost::asio::awaitable<std::shared_ptr<StoredRender>> rendered(Call& call,
                                                                 const Prepared& prepared);
  std::shared_ptr<StoredRender> render(const Prepared& prepared, const std::stop_token& stop,
                                       double queued_ms);
  Photograph simulate_in_time(const SimulationSpec& spec, const RayScene& scene,
                              const std::stop_token& stop);
  boost::asio::awaitable<Reply> file_reply(Call& call, FileKey key);
  boost::asio::awaitable<EncodedFile> file(std::shared_ptr<StoredRender> render, FileKey key);
  std::shared_ptr<StoredRender> stored(const Call& call);

  RenderServices services_;
  CpuMeter cpu_;
  int preparing_ = 0;  // requests on the readers now
};

}  // namespace fstop::server
