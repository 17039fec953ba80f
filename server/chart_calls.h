#pragma once

#include <atomic>
#include <memory>
#include <string>

#include <boost/asio/awaitable.hpp>

#include "api/chart_request.h"
#include "api/limits.h"
#include "server/log.h"
#include "server/render_queue.h"
#include "server/routes.h"
#include "server/scene_cache.h"
#include "server/workers.h"

namespace fstop::server {

/// What POST /v1/charts works with.
struct ChartServices {
  const api::Limits& limits;
  Log& log;
  Workers& readers;    // read requests and scenes
  RenderQueue& queue;  // of its own: one chart at a time, on that thread alone
  SceneCache& scenes;
  const std::atomic<bool>& draining;  // no new work
};

/// POST /v1/charts. A chart renders on the one thread of its queue, so that it takes no turn of the
/// renders' threads and its processor times are its own.
class ChartCalls {
 public:
  explicit ChartCalls(ChartServices services) : services_(services) {}
  void add_to(Routes& routes);

 private:
  enum class Form { json, svg, events };
  struct Prepared {
    std::shared_ptr<const api::ChartRequest> request = {};
    std::string scene_hash = {};
    std::string id = {};
    Form form = Form::json;
  };
  struct Run;
  struct Finished;

  boost::asio::awaitable<Reply> create(Call& call);
  Prepared prepare(const Request& request);
  std::shared_ptr<Finished> chart(const Prepared& prepared, const RenderQueue::Turn& turn);
  AccuracyChart chart_in_time(const Prepared& prepared, const RenderQueue::Turn& turn);
  static Reply event_reply(Call& call, const std::shared_ptr<Run>& run);
  static boost::asio::awaitable<std::string> next_event(Connection& client, RequestRecord& record,
                                                        Run& run);

  ChartServices services_;
  int preparing_ = 0;  // requests on the readers now
};

}  // namespace fstop::server
