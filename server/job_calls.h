#pragma once

#include <memory>
#include <optional>
#include <string>

#include <boost/asio/awaitable.hpp>

#include "api/limits.h"
#include "server/jobs.h"
#include "server/metrics.h"
#include "server/render_cache.h"
#include "server/routes.h"
#include "server/workers.h"

namespace fstop::server {

/// What the calls under /v1/jobs work with.
struct JobServices {
  const api::Limits& limits;
  Metrics& metrics;
  Workers& readers;
  Workers& encoders;
  RenderCache& renders;
  Jobs& jobs;
};

/// What a job tells while it is under way, and its result.
class JobCalls {
 public:
  explicit JobCalls(JobServices services) : services_(services) {}
  void add_to(Routes& routes);

 private:
  struct Stream;

  boost::asio::awaitable<Reply> show(Call& call);
  boost::asio::awaitable<Reply> withdraw(Call& call);
  boost::asio::awaitable<Reply> events(Call& call);
  boost::asio::awaitable<Reply> preview(Call& call);
  boost::asio::awaitable<Reply> image(Call& call);
  static boost::asio::awaitable<std::string> next_event(const api::Limits& limits,
                                                        Connection& client, Stream& stream);

  JobServices services_;
};

}  // namespace fstop::server
