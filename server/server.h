#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/io_context.hpp>

#include "api/scene_store.h"
#include "core/parallel.h"
#include "server/access.h"
#include "server/chart_calls.h"
#include "server/composite_calls.h"
#include "server/config.h"
#include "server/content_folder.h"
#include "server/cost_model.h"
#include "server/file_calls.h"
#include "server/job_calls.h"
#include "server/jobs.h"
#include "server/listener.h"
#include "server/log.h"
#include "server/measurement_calls.h"
#include "server/metrics.h"
#include "server/nats_queue.h"
#include "server/render_cache.h"
#include "server/render_calls.h"
#include "server/render_queue.h"
#include "server/render_work.h"
#include "server/result_store.h"
#include "server/routes.h"
#include "server/scene_cache.h"
#include "server/scene_calls.h"
#include "server/static_files.h"
#include "server/sweep_calls.h"
#include "server/worker_crew.h"
#include "server/workers.h"

namespace fstop::server {

/// fstop over HTTP: one thread for all sockets, others for all work.
class Server {
 public:
  /// Listens when it returns; answers once run() is called.
  /// Renders run in worker processes, or, where `simulate` is given, in this one, by it.
  /// Throws: Error{io_failure} if the address cannot be listened on or the worker program is not
  ///         there.
  Server(const ServerConfig& config, Log& log, Simulate simulate = {});
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const { return listener_.port(); }
  /// Answers requests on the calling thread until stopped.
  void run();
  /// From any thread: stops accepting, answers what was admitted, cancels what is left after the
  /// drain deadline; then run() returns.
  void stop();
  /// SIGTERM and SIGINT stop; a second one ends the process at once.
  void stop_on_signals();

  /// 0 where probes have no port of their own.
  std::uint16_t probe_port() const { return probe_listener_ ? probe_listener_->port() : 0; }

  RenderQueue::Counts render_counts() const { return queue_.counts(); }
  RenderQueue::Counts sweep_counts() const { return sweeps_.counts(); }
  RenderQueue::Counts chart_counts() const { return charts_.counts(); }
  SceneCache::Counts scene_counts() const { return scenes_.counts(); }
  WorkerCrew::Counts worker_counts() const {
    return crew_ ? crew_->counts() : WorkerCrew::Counts();
  }
  ResultStore::Counts file_counts() const { return files_of_renders_.counts(); }

 private:
  void add_routes();
  void add_probes(Routes& routes);
  void add_docs();
  std::string metrics_text() const;
  RenderQueue::Shape queue_shape() const;
  std::function<std::unique_ptr<CellMaker>(ContentFolder&)> elsewhere();
  WorkerCrew::Shape crew_shape() const;
  boost::asio::awaitable<void> stop_when_idle();
  void drain();
  boost::asio::awaitable<void> drain_deadline();
  boost::asio::awaitable<void> watch_signals();
  boost::asio::awaitable<Reply> optics(Call& call);
  boost::asio::awaitable<Reply> psf(Call& call);
  Reply psf_reply(const Request& request);

  ServerConfig config_;
  Log& log_;
  boost::asio::io_context io_;
  api::SceneStore store_;
  StaticFiles files_;
  Metrics metrics_;
  WorkerPool pool_;  // of this process: point spreads, and renders where there is no crew
  std::unique_ptr<WorkerCrew> crew_;
  CostModel costs_;
  Workers readers_;
  Workers encoders_;
  Workers expanders_;
  ResultStore files_of_renders_;
  RenderCache renders_;
  SceneCache scenes_;
  RenderWork work_;
  JobNotes notes_;
  Jobs jobs_;
  RenderCalls render_calls_;
  JobCalls job_calls_;
  ChartCalls chart_calls_;
  CompositeCalls composite_calls_;
  SceneCalls scene_calls_;
  MeasurementCalls measurement_calls_;
  std::unique_ptr<ContentFolder> contents_;  // none without a data directory
  std::unique_ptr<FileCalls> file_calls_;
  std::unique_ptr<NatsQueue> cell_queue_;  // none: cells of sweeps are made here
  SweepCalls sweep_calls_;
  RenderQueue queue_;  // its threads end before what they use
  RenderQueue charts_;
  RenderQueue sweeps_;  // ends before the queue of the renders that it leads
  AccessRules access_;
  Routes routes_;
  Listener listener_;
  // Probes on a thread and a port of their own, whatever the other one has to do.
  boost::asio::io_context probe_io_;
  AccessRules probe_access_;
  Routes probe_routes_;
  std::optional<Listener> probe_listener_ = {};
  std::atomic<bool> draining_ = false;
  bool has_drained_on_signal_ = false;
  int waiting_psfs_ = 0;
};

}  // namespace fstop::server
