#include "server/server.h"

#include <chrono>
#include <csignal>
#include <string>
#include <thread>
#include <unistd.h>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "api/job_json.h"
#include "api/openapi.h"
#include "api/optics_request.h"
#include "api/psf_request.h"
#include "api/render_id.h"
#include "server/counted.h"
#include "server/negotiation.h"
#include "server/remote_cells.h"
#include "server/reply_head.h"
#include "server/thread_priority.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
constexpr auto kNoThrow = asio::as_tuple(asio::use_awaitable);

constexpr int kRenderNiceness = 10;
constexpr int kChartNiceness = 15;   // behind the renders
constexpr int kExpressNiceness = 4;  // small ones before them
constexpr const char* kProbeAddress = "127.0.0.1";
constexpr auto kLookAgain = std::chrono::milliseconds(5);
constexpr int kReaderNiceness = 5;
constexpr int kSweepsElsewhere = 8;  // that wait for workers at once
constexpr int kReaderThreads = 2;
constexpr int kEncoderThreads = 2;
constexpr int kExpanderThreads = 1;
// Cancelled renders end within 50 ms; their clients are told before the sockets are closed.
constexpr auto kLastReplies = std::chrono::seconds(1);

Reply json_reply(std::string text) {
  Reply reply{.body = std::move(text)};
  reply.set("Content-Type", "application/json");
  reply.set("Cache-Control", "no-store");
  return reply;
}

Handler immediate(std::function<Reply(const Call&)> answer) {
  return [answer = std::move(answer)](Call& call) -> asio::awaitable<Reply> {
    co_return answer(call);
  };
}

std::string tag_of(std::string_view text) { return etag_of(api::sha256_hex(text)); }

}  // namespace

Server::Server(const ServerConfig& config, Log& log, Simulate simulate)
    : config_(config),
      log_(log),
      store_(config.scene_folders, config.limits),
      files_(config.web_root),
      pool_(config.threads, kRenderNiceness),
      crew_(simulate ? nullptr : std::make_unique<WorkerCrew>(crew_shape(), log)),
      costs_(pool_.threads(), 1e-3 * static_cast<double>(config.limits.render_time.count())),
      readers_(kReaderThreads, kReaderNiceness),
      encoders_(kEncoderThreads, kRenderNiceness),
      expanders_(kExpanderThreads, kRenderNiceness),
      files_of_renders_(config.result_folder, config.limits.kept_file_bytes, config_.limits, log),
      renders_(config.limits.kept_result_bytes, &files_of_renders_),
      scenes_(store_, config.limits.kept_scene_bytes),
      work_({.limits = config_.limits,
             .log = log_,
             .metrics = metrics_,
             .renders = renders_,
             .scenes = scenes_,
             .costs = costs_,
             .crew = crew_.get(),
             .simulate = std::move(simulate),
             .pool = pool_}),
      notes_(config.job_folder, log),
      jobs_(io_, config_.limits, log_, notes_),
      render_calls_({.limits = config_.limits,
                     .readers = readers_,
                     .encoders = encoders_,
                     .work = work_,
                     .queue = queue_,
                     .renders = renders_,
                     .scenes = scenes_,
                     .costs = costs_,
                     .jobs = jobs_,
                     .notes = notes_,
                     .log = log_,
                     .draining = draining_}),
      job_calls_({.limits = config_.limits,
                  .metrics = metrics_,
                  .readers = readers_,
                  .encoders = encoders_,
                  .renders = renders_,
                  .jobs = jobs_}),
      chart_calls_({.limits = config_.limits,
                    .log = log_,
                    .readers = readers_,
                    .queue = charts_,
                    .scenes = scenes_,
                    .draining = draining_}),
      composite_calls_({.limits = config_.limits,
                        .log = log_,
                        .readers = readers_,
                        .encoders = encoders_,
                        .work = work_,
                        .queue = queue_,
                        .renders = renders_,
                        .scenes = scenes_,
                        .costs = costs_,
                        .store = store_,
                        .program = config.program,
                        .draining = draining_}),
      scene_calls_({.limits = config_.limits,
                    .log = log_,
                    .readers = readers_,
                    .store = store_,
                    .folder = config.upload_folder,
                    .program = config.program}),
      measurement_calls_(
          {.limits = config_.limits, .log = log_, .renders = renders_, .program = config.program}),
      contents_(config.file_folder.empty() ? nullptr
                                           : std::make_unique<ContentFolder>(config.file_folder)),
      file_calls_(contents_ ? std::make_unique<FileCalls>(*contents_) : nullptr),
      cell_queue_(config.queue.empty() ? nullptr
                                       : std::make_unique<NatsQueue>(
                                             NatsQueue::Settings{.url = config.queue,
                                                                 .name = "fstop serve",
                                                                 .ack_wait = config.ack_wait},
                                             log)),
      sweep_calls_({.limits = config_.limits,
                    .log = log_,
                    .readers = readers_,
                    .expanders = expanders_,
                    .queue = sweeps_,
                    .jobs = jobs_,
                    .cells = {.limits = config_.limits,
                              .queue = queue_,
                              .work = work_,
                              .renders = renders_,
                              .scenes = scenes_,
                              .costs = costs_},
                    .maker = elsewhere(),
                    .folder = config.sweep_folder,
                    .file_folder = config.file_folder,
                    .draining = draining_}),
      queue_(queue_shape()),
      charts_({.slots = 1,
               .most_queued = config.limits.queued_charts,
               .most_queued_per_client = config.limits.queued_charts,
               .niceness = kChartNiceness}),
      sweeps_({.slots = cell_queue_ ? kSweepsElsewhere : 1,
               .most_queued = config.limits.queued_sweeps,
               .most_queued_per_client = config.limits.queued_sweeps,
               .niceness = kReaderNiceness}),
      access_({.address = config.address,
               .token = config.token,
               .url_key = config.url_key,
               .hosts = config.hosts,
               .origins = config.origins}),
      listener_(io_, config.address, config.port,
                {.limits = config_.limits,
                 .routes = routes_,
                 .access = access_,
                 .log = log_,
                 .metrics = metrics_}),
      probe_access_({.address = kProbeAddress}) {
  add_routes();
  if (!config.probe_port) return;
  add_probes(probe_routes_);
  probe_listener_.emplace(probe_io_, kProbeAddress, *config.probe_port,
                          SessionContext{.limits = config_.limits,
                                         .routes = probe_routes_,
                                         .access = probe_access_,
                                         .log = log_,
                                         .metrics = metrics_});
}

// Who makes the cells of sweeps, where that is not this server.
std::function<std::unique_ptr<CellMaker>(ContentFolder&)> Server::elsewhere() {
  if (!cell_queue_) return {};
  return [this](ContentFolder& files) {
    return std::make_unique<ServedCells>(ServedCells::Services{.queue = *cell_queue_,
                                                               .files = files,
                                                               .scenes = store_,
                                                               .limits = config_.limits,
                                                               .log = log_,
                                                               .workers = pool_,
                                                               .costs = costs_,
                                                               .split_cpu_s = config_.split_cpu_s,
                                                               .draining = draining_});
  };
}

RenderQueue::Shape Server::queue_shape() const {
  return {.slots = config_.limits.concurrent_renders,
          .express_slots = config_.limits.express_renders,
          .most_queued = config_.limits.queued_renders,
          .most_queued_per_client = config_.limits.queued_per_client,
          .memory_bytes = static_cast<double>(config_.limits.render_bytes),
          .niceness = kRenderNiceness,
          .express_niceness = kExpressNiceness};
}

WorkerCrew::Shape Server::crew_shape() const {
  return {.program = config_.worker_program,
          .workers = config_.limits.concurrent_renders,
          .express_workers = config_.limits.express_renders,
          .threads = pool_.threads(),
          .niceness = kRenderNiceness,
          .express_niceness = kExpressNiceness,
          .scene_bytes = config_.limits.kept_scene_bytes / 2};
}

void Server::add_routes() {
  using http::verb;
  render_calls_.add_to(routes_);
  job_calls_.add_to(routes_);
  chart_calls_.add_to(routes_);
  composite_calls_.add_to(routes_);
  scene_calls_.add_to(routes_);
  measurement_calls_.add_to(routes_);
  if (file_calls_) {
    file_calls_->add_to(routes_);
  } else {
    for (const verb method : {verb::get, verb::put}) {
      routes_.add(method, "/v1/files/{sha256}",
                  immediate([](const Call&) -> Reply { throw no_data_folder("files"); }));
    }
  }
  sweep_calls_.add_to(routes_);
  add_probes(routes_);
  add_docs();
  const auto add = [this](verb method, const char* pattern,
                          asio::awaitable<Reply> (Server::*answer)(Call&)) {
    routes_.add(method, pattern, [this, answer](Call& call) { return (this->*answer)(call); });
  };
  add(verb::post, "/v1/optics", &Server::optics);
  add(verb::post, "/v1/psf", &Server::psf);
  routes_.add(verb::get, "/v1/limits", immediate([this](const Call&) {
                return json_reply(api::limits_json(config_.limits, queue_.counts().backlog_s));
              }));
  routes_.add(
      verb::get, "/openapi.json", immediate([tag = tag_of(api::openapi_json())](const Call& call) {
        Reply reply =
            tagged_reply(call.request, "application/json", tag, std::string(api::openapi_json()));
        reply.set("Cache-Control", "no-cache");
        return reply;
      }));
  const Handler file = [this](Call& call) -> asio::awaitable<Reply> {
    co_return co_await readers_.run(
        [this, &call] { return files_.reply(call.request, call.request.path); });
  };
  routes_.add(verb::get, "/", file);
  routes_.set_files(file);
}

asio::awaitable<Reply> Server::optics(Call& call) {
  co_return json_reply(co_await readers_.run([this, &call] {
    return api::optics_json(api::parse_optics_request(call.request.body, config_.limits));
  }));
}

asio::awaitable<Reply> Server::psf(Call& call) {
  if (waiting_psfs_ >= config_.limits.waiting_psfs) {
    throw Refusal(http::status::service_unavailable, "overloaded", "too many requests at once")
        .with("Retry-After", "1");
  }
  const Counted counted(waiting_psfs_);
  co_return co_await encoders_.run([this, &call] { return psf_reply(call.request); });
}

// On a thread of the encoders, with the renders' threads for help.
Reply Server::psf_reply(const Request& request) {
  const api::PsfRequest asked = api::parse_psf_request(request.body, config_.limits);
  const Representation wanted = negotiated_numbers(request.header("Accept"), asked.image.format);
  const RunControl run{.workers = &pool_};
  Reply reply;
  if (!wanted) {
    reply = json_reply(api::psf_json(asked, config_.limits, run));
  } else {
    const api::PsfPicture made = api::psf_picture(asked, *wanted, config_.limits, run);
    reply.body = std::make_shared<const std::vector<std::byte>>(encode(made.picture, *wanted));
    reply.set("Content-Type", std::string(media_type(*wanted)));
    reply.set("Cache-Control", "no-store");
    reply.set("Fstop-Stretch", made.stretch);
  }
  reply.set("Vary", "Accept");
  return reply;
}

void Server::run() {
  std::vector<api::JobNote> unfinished = notes_.all();
  render_calls_.restore(unfinished);
  listener_.start();
  asio::co_spawn(io_, render_calls_.resume(std::move(unfinished)), asio::detached);
  asio::co_spawn(io_, sweep_calls_.resume(), asio::detached);
  std::jthread probes;
  if (probe_listener_) {
    probe_listener_->start();
    probes = std::jthread([this] {
      make_this_thread_quick();
      probe_io_.run();
    });
  }
  const bool is_v6 = config_.address.find(':') != std::string::npos;
  log_.event("serving",
             {{"url", "http://" + (is_v6 ? "[" + config_.address + "]" : config_.address) + ":" +
                          std::to_string(port()) + "/"},
              {"threads", pool_.threads()}});
  make_this_thread_quick();
  io_.run();
  probe_io_.stop();
  log_.event("stopped");
  // Nobody waits for signals now: a second one ends the process, whatever its threads still do.
  if (has_drained_on_signal_) {
    std::signal(SIGTERM, SIG_DFL);
    std::signal(SIGINT, SIG_DFL);
  }
}

void Server::stop() {
  asio::post(io_, [this] { drain(); });
}

void Server::drain() {
  if (draining_.exchange(true)) return;
  const RenderQueue::Counts counts = queue_.counts();
  log_.event("draining", {{"connections", listener_.sessions()},
                          {"jobs", jobs_.active()},
                          {"running", counts.running},
                          {"queued", counts.queued}});
  // What a sweep has done is kept: the next process goes on with it.
  sweeps_.close();
  sweeps_.cancel_all();
  asio::co_spawn(io_, drain_deadline(), asio::detached);
  listener_.finish([this] { asio::co_spawn(io_, stop_when_idle(), asio::detached); });
}

// Jobs go on without a connection: what was accepted is made and kept.
asio::awaitable<void> Server::stop_when_idle() {
  asio::steady_timer timer(io_);
  const auto is_busy = [this] {
    const RenderQueue::Counts renders = queue_.counts();
    return renders.running + renders.queued + jobs_.active() > 0;
  };
  while (is_busy()) {
    timer.expires_after(kLookAgain);
    co_await timer.async_wait(kNoThrow);
  }
  io_.stop();
}

asio::awaitable<void> Server::drain_deadline() {
  asio::steady_timer timer(io_, config_.limits.drain_deadline);
  co_await timer.async_wait(kNoThrow);
  log_.warning("drain_deadline", {{"connections", listener_.sessions()}});
  for (RenderQueue* queue : {&queue_, &charts_}) {
    queue->close();
    queue->cancel_all();
  }
  timer.expires_after(kLastReplies);
  co_await timer.async_wait(kNoThrow);
  listener_.abort_sessions();
}

void Server::stop_on_signals() { asio::co_spawn(io_, watch_signals(), asio::detached); }

asio::awaitable<void> Server::watch_signals() {
  asio::signal_set signals(io_, SIGTERM, SIGINT);
  co_await signals.async_wait(kNoThrow);
  has_drained_on_signal_ = true;
  drain();
  const auto [ec, number] = co_await signals.async_wait(kNoThrow);
  if (!ec) ::_exit(128 + number);
}

}  // namespace fstop::server
