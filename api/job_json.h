#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "api/limits.h"
#include "api/problem.h"

namespace fstop::api {

/// What a client is told of a job.
struct JobView {
  std::string job = {};                     // its own name, random
  std::string state = {};                   // "queued", "running", "done", "failed" or "cancelled"
  std::string render = {};                  // content hash
  bool is_sweep = false;                    // then `render` is the sweep's id
  std::string waiting_for = {};             // of a sweep: "disk space"; empty: nothing
  int queue_place = 0;                      // 1: next; 0 once it runs
  double fraction = 0.0;                    // done, 0 to 1
  std::optional<double> upper_95 = {};      // RMSE of the newest preview
  std::optional<double> remaining_ms = {};  // estimated; absent where nothing tells
  std::uint64_t previews = 0;               // shown so far
  bool is_kept = true;                      // its result stands under /v1/renders too
  std::string problem = {};                 // of a failed one: the document
};

/// One line of JSON: the members above and "links", paths of what there is now.
std::string job_json(const JobView& view);

/// What a client is told of a sweep.
struct SweepView {
  std::string sweep = {};
  std::string state = {};  // "queued", "running", "done", or "stopped": nobody wants it
  bool is_done = false;
  std::size_t cells = 0;
  std::size_t done = 0;
  std::size_t failed = 0;
  std::string waiting_for = {};
};

/// One line of JSON: the members above and "links".
std::string sweep_json(const SweepView& view);

/// GET /v1/limits: what one request may ask for and what the server holds.
/// `backlog_s`: seconds until what waits now is done.
std::string limits_json(const Limits& limits, double backlog_s);

}  // namespace fstop::api
