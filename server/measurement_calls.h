#pragma once

#include <string>

#include <boost/asio/awaitable.hpp>

#include "api/limits.h"
#include "api/measurement_request.h"
#include "server/log.h"
#include "server/render_cache.h"
#include "server/routes.h"
#include "server/sent_image.h"
#include "server/workers.h"

namespace fstop::server {

/// What POST /v1/measurements works with.
struct MeasurementServices {
  const api::Limits& limits;
  Log& log;
  RenderCache& renders;
  std::string program;  // fstop itself, which reads pictures that are sent
};

/// POST /v1/measurements: blur and sharpness in a finished render or in a picture that is sent.
class MeasurementCalls {
 public:
  explicit MeasurementCalls(MeasurementServices services);
  void add_to(Routes& routes);

 private:
  boost::asio::awaitable<Reply> measure(Call& call);
  std::string answer(const std::string& body);

  MeasurementServices services_;
  SentImageReader images_;
  Workers workers_;  // of its own: a picture that is sent may take long to read
  int waiting_ = 0;
};

}  // namespace fstop::server
