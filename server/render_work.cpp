#include "server/render_work.h"

#include <atomic>
#include <chrono>
#include <utility>
#include <vector>

#include "api/picture.h"
#include "api/report_json.h"
#include "core/error.h"

namespace fstop::server {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr int kAttempts = 2;  // of a render whose worker process dies

double milliseconds_since(SteadyClock::time_point start) {
  return std::chrono::duration<double, std::milli>(SteadyClock::now() - start).count();
}

}  // namespace

std::shared_ptr<StoredRender> RenderWork::render(const RenderTask& task,
                                                 const RenderQueue::Turn& turn) {
  if (task.is_kept()) {
    if (auto there = services_.renders.find(task.id)) return there;  // ended just now
  }
  const api::RenderRequest& request = *task.request;
  const auto start = SteadyClock::now();
  services_.log.event("render_start", {{"render", task.id},
                                       {"queue_ms", turn.queued_ms},
                                       {"express", turn.is_express ? 1 : 0},
                                       {"predicted_cpu_s", task.cost.cpu_s}});
  std::atomic<SteadyClock::time_point> stopped_at = SteadyClock::time_point::max();
  const std::stop_callback note(turn.stop, [&] { stopped_at = SteadyClock::now(); });
  auto stored = std::make_shared<StoredRender>();
  WorkerResult result;
  try {
    result = made(task, turn);
  } catch (const std::exception& exception) {
    services_.metrics.render_failed();
    std::vector<LogField> fields = {
        {"render", task.id}, {"ms", milliseconds_since(start)}, {"why", exception.what()}};
    if (turn.stop.stop_requested()) fields.emplace_back("stop_ms", milliseconds_since(stopped_at));
    services_.log.event("render_ended_early", fields);
    throw;
  }
  stored->photograph = std::move(result.photograph);
  stored->id = task.id;
  stored->normalised = request.normalised;
  stored->spec = request.spec;
  stored->timing = {
      .render_ms = milliseconds_since(start), .queue_ms = turn.queued_ms, .cpu_ms = result.cpu_ms};
  finish(task, stored, result.build_ms);
  return stored;
}

WorkerResult RenderWork::made(const RenderTask& task, const RenderQueue::Turn& turn) {
  SimulationSpec spec = task.request->spec;
  // What is kept may be asked for as EXR later; what is made against the clock is not kept.
  spec.outputs = api::layers_needed(task.is_kept() ? ImageFormat::exr : task.format, spec.outputs);
  return services_.crew != nullptr ? made_apart(task, spec, turn) : made_here(task, spec, turn);
}

// By a worker process: one that dies takes one attempt of this render with it, and nothing else.
WorkerResult RenderWork::made_apart(const RenderTask& task, const SimulationSpec& spec,
                                    const RenderQueue::Turn& turn) {
  const auto scene = services_.scenes.shared(*task.request, task.scene_hash);
  // Looking at the picture takes time: no previews where that is short.
  const WorkerJob job{
      .spec = spec, .scene_hash = task.scene_hash, .wants_previews = !spec.quality.max_time_ms};
  for (int attempt = 1; attempt <= kAttempts; ++attempt) {
    try {
      return services_.crew->render(job, *scene, turn, services_.limits.render_time);
    } catch (const WorkerLost&) {
      if (turn.stop.stop_requested())
        throw Error(ErrorCode::cancelled, "stopped before it was done");
      services_.log.warning("render_lost", {{"render", task.id}, {"attempt", attempt}});
    }
  }
  throw Refusal(http::status::internal_server_error, "worker-died",
                "the process that rendered this ended twice before it was done");
}

WorkerResult RenderWork::made_here(const RenderTask& task, const SimulationSpec& spec,
                                   const RenderQueue::Turn& turn) {
  const double start = cpu_.start();
  WorkerResult result;
  try {
    const auto scene = services_.scenes.scene(*task.request, task.scene_hash);
    result.photograph = simulate_in_time(spec, *scene, turn);
  } catch (...) {
    cpu_.stop(start);
    throw;
  }
  result.cpu_ms = cpu_.stop(start);
  return result;
}

// The file that is wanted first, the report with its time, then all of it where it is kept.
void RenderWork::finish(const RenderTask& task, const std::shared_ptr<StoredRender>& stored,
                        double build_ms) {
  const RenderReport& report = stored->photograph.report;
  services_.costs.learn(stored->spec, task.scene_hash,
                        {.method = report.method,
                         .samples_mean = report.cost.samples_mean,
                         .cpu_ms = stored->timing.cpu_ms});
  services_.metrics.render(report.method, report.cost.rays, task.cost.cpu_s,
                           1e-3 * stored->timing.cpu_ms);
  const bool is_float = task.format == ImageFormat::exr || task.format == ImageFormat::tiff;
  const EncodedFile file = stored->file(
      {.format = task.format, .precision = is_float ? task.request->precision : Precision::single});
  stored->timing.encode_ms = file.encode_ms;
  stored->report = api::report_json(task.id, report, stored->timing, stored->normalised);
  services_.log.event("render", {{"render", task.id},
                                 {"method", report.method},
                                 {"ms", stored->timing.render_ms},
                                 {"queue_ms", stored->timing.queue_ms},
                                 {"cpu_ms", stored->timing.cpu_ms},
                                 {"build_ms", build_ms},
                                 {"encode_ms", stored->timing.encode_ms}});
  if (task.is_kept()) services_.renders.insert(stored);
}

Photograph RenderWork::simulate_in_time(const SimulationSpec& spec, const RayScene& scene,
                                        const RenderQueue::Turn& turn) {
  const auto deadline = SteadyClock::now() + services_.limits.render_time;
  std::stop_source ended;
  const std::stop_callback pass_on(turn.stop, [&] { ended.request_stop(); });
  std::atomic<bool> too_late = false;
  RunControl run{.stop = ended.get_token(),
                 .progress =
                     [&](double fraction) {
                       turn.progress->advance(fraction);
                       if (SteadyClock::now() < deadline || too_late.exchange(true)) return;
                       ended.request_stop();
                     },
                 .workers = &services_.pool};
  if (!spec.quality.max_time_ms) {
    run.preview = [&](const Image& picture, double upper_95) {
      turn.progress->show(picture, upper_95);
    };
  }
  try {
    return services_.simulate(spec, scene, run);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::cancelled || !too_late || turn.stop.stop_requested()) throw;
    throw Refusal(http::status::gateway_timeout, "deadline",
                  "the render was stopped after " +
                      std::to_string(services_.limits.render_time.count()) + " ms");
  }
}

}  // namespace fstop::server
