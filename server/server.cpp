#include "server/server.h"

#include <chrono>
#include <csignal>
#include <string>
#include <unistd.h>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "api/openapi.h"
#include "api/optics_request.h"
#include "api/psf_request.h"
#include "api/render_id.h"
#include "server/counted.h"
#include "server/negotiation.h"
#include "server/reply_head.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
constexpr auto kNoThrow = asio::as_tuple(asio::use_awaitable);

constexpr int kRenderNiceness = 10;
constexpr int kChartNiceness = 15;  // behind the renders
constexpr int kReaderNiceness = 5;
constexpr int kReaderThreads = 2;
constexpr int kEncoderThreads = 2;
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
      readers_(kReaderThreads, kReaderNiceness),
      encoders_(kEncoderThreads, kRenderNiceness),
      renders_(config.limits.kept_result_bytes),
      scenes_(store_, config.limits.kept_scene_bytes),
      render_calls_({.limits = config_.limits,
                     .log = log_,
                     .readers = readers_,
                     .encoders = encoders_,
                     .pool = pool_,
                     .queue = queue_,
                     .renders = renders_,
                     .scenes = scenes_,
                     .draining = draining_,
                     .simulate = std::move(simulate)}),
      chart_calls_({.limits = config_.limits,
                    .log = log_,
                    .readers = readers_,
                    .queue = charts_,
                    .scenes = scenes_,
                    .draining = draining_}),
      queue_(config.limits.concurrent_renders, config.limits.queued_renders, kRenderNiceness),
      charts_(1, config.limits.queued_charts, kChartNiceness),
      access_(config.address, config.token),
      listener_(io_, config.address, config.port,
                {.limits = config_.limits, .routes = routes_, .access = access_, .log = log_}) {
  add_routes();
}

void Server::add_routes() {
  using http::verb;
  render_calls_.add_to(routes_);
  chart_calls_.add_to(routes_);
  const auto add = [this](verb method, const char* pattern,
                          asio::awaitable<Reply> (Server::*answer)(Call&)) {
    routes_.add(method, pattern, [this, answer](Call& call) { return (this->*answer)(call); });
  };
  add(verb::get, "/v1/scenes", &Server::list_scenes);
  add(verb::get, "/v1/scenes/{name}", &Server::show_scene);
  add(verb::post, "/v1/optics", &Server::optics);
  add(verb::post, "/v1/psf", &Server::psf);
  routes_.add(verb::get, "/livez",
              immediate([](const Call&) { return json_reply(R"({"status":"alive"})"); }));
  routes_.add(verb::get, "/readyz", immediate([this](const Call&) {
                if (!draining_) return json_reply(R"({"status":"ready"})");
                Reply reply = problem_reply(503, "draining", "the server is about to stop");
                reply.set("Retry-After", "5");
                return reply;
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

asio::awaitable<Reply> Server::list_scenes(Call&) {
  co_return json_reply(
      co_await readers_.run([this] { return api::scene_list_json(store_.list()); }));
}

asio::awaitable<Reply> Server::show_scene(Call& call) {
  co_return co_await readers_.run([this, &call] {
    std::string text = store_.text(call.parameters[0]);
    const std::string tag = tag_of(text);
    Reply reply = tagged_reply(call.request, "application/json", tag, std::move(text));
    reply.set("Cache-Control", "no-cache");
    return reply;
  });
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
  listener_.start();
  const bool is_v6 = config_.address.find(':') != std::string::npos;
  log_.event("serving",
             {{"url", "http://" + (is_v6 ? "[" + config_.address + "]" : config_.address) + ":" +
                          std::to_string(port()) + "/"},
              {"threads", pool_.threads()}});
  io_.run();
  log_.event("stopped");
}

void Server::stop() {
  asio::post(io_, [this] { drain(); });
}

void Server::drain() {
  if (std::exchange(draining_, true)) return;
  const RenderQueue::Counts counts = queue_.counts();
  log_.event("draining", {{"connections", static_cast<int>(listener_.sessions())},
                          {"running", counts.running},
                          {"queued", counts.queued}});
  asio::co_spawn(io_, drain_deadline(), asio::detached);
  listener_.finish([this] { io_.stop(); });
}

asio::awaitable<void> Server::drain_deadline() {
  asio::steady_timer timer(io_, config_.limits.drain_deadline);
  co_await timer.async_wait(kNoThrow);
  log_.warning("drain_deadline", {{"connections", static_cast<int>(listener_.sessions())}});
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
  drain();
  const auto [ec, number] = co_await signals.async_wait(kNoThrow);
  if (!ec) ::_exit(128 + number);
}

}  // namespace fstop::server
