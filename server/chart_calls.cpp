#include "server/chart_calls.h"

#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <optional>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "api/problem.h"
#include "api/render_id.h"
#include "core/error.h"
#include "server/counted.h"
#include "server/negotiation.h"
#include "server/session.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
using asio::experimental::awaitable_operators::operator||;
using SteadyClock = std::chrono::steady_clock;

constexpr int kMostPreparing = 16;
constexpr auto kBetweenEvents = std::chrono::milliseconds(250);
constexpr int kLoggedSteps = 10;  // of a chart's progress

constexpr std::array<std::string_view, 3> kTypes = {"application/json", "image/svg+xml",
                                                    "text/event-stream"};

double milliseconds_since(SteadyClock::time_point start) {
  return std::chrono::duration<double, std::milli>(SteadyClock::now() - start).count();
}

asio::awaitable<void> pause() {
  asio::steady_timer timer(co_await asio::this_coro::executor, kBetweenEvents);
  co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
}

// Our JSON has no line breaks, so that its text is one line of data.
std::string event(std::string_view name, std::string_view data) {
  return "event: " + std::string(name) + "\ndata: " + std::string(data) + "\n\n";
}

std::string progress_event(double share) {
  char data[48];
  std::snprintf(data, sizeof data, "{\"progress\":%.4g}", share);
  return event("progress", data);
}

}  // namespace

/// A chart that is done.
struct ChartCalls::Finished {
  AccuracyChart chart = {};
};

/// One client's wait for a chart.
struct ChartCalls::Run {
  std::shared_ptr<const api::ChartRequest> request = {};
  std::optional<RenderQueue::Ticket> ticket = {};
  double told = -1.0;
  bool ended = false;

  const AccuracyChart& chart() const {
    return std::static_pointer_cast<Finished>(ticket->result())->chart;
  }
};

void ChartCalls::add_to(Routes& routes) {
  routes.add(http::verb::post, "/v1/charts", [this](Call& call) { return create(call); });
}

asio::awaitable<Reply> ChartCalls::create(Call& call) {
  if (services_.draining) {
    throw Refusal(http::status::service_unavailable, "draining", "the server is about to stop")
        .with("Retry-After", "5");
  }
  if (preparing_ >= kMostPreparing) {
    throw Refusal(http::status::service_unavailable, "overloaded", "too many requests at once")
        .with("Retry-After", "1");
  }
  Prepared prepared;
  {
    const Counted counted(preparing_);
    prepared = co_await services_.readers.run([this, &call] { return prepare(call.request); });
  }
  call.record.render = prepared.id;
  const auto run = std::make_shared<Run>();
  run->request = prepared.request;
  const RenderQueue::Work work = [this, prepared](const RenderQueue::Turn& turn) {
    return chart(prepared, turn);
  };
  run->ticket.emplace(
      services_.queue.submit({.id = prepared.id, .client = call.client.peer(), .work = work}));
  if (prepared.form == Form::events) co_return event_reply(call, run);

  const auto first = co_await (run->ticket->ended() || call.client.peer_gone());
  if (first.index() == 1) throw ClientGone();
  Reply reply;
  reply.set("Content-Type", std::string(kTypes[static_cast<std::size_t>(prepared.form)]));
  reply.set("Cache-Control", "no-store");
  reply.set("Vary", "Accept");
  reply.body = prepared.form == Form::svg ? api::chart_svg(*run->request, run->chart())
                                          : api::chart_json(*run->request, run->chart());
  co_return reply;
}

ChartCalls::Prepared ChartCalls::prepare(const Request& request) {
  Prepared prepared;
  auto parsed = std::make_shared<const api::ChartRequest>(
      api::parse_chart_request(request.body, services_.limits, api::SceneNames::stored_only));
  prepared.form = static_cast<Form>(negotiated_type(request.header("Accept"), kTypes));
  prepared.scene_hash = services_.scenes.hash(parsed->picture);
  prepared.id =
      api::render_id(parsed->picture.canonical, prepared.scene_hash, api::engine_version());
  prepared.request = std::move(parsed);
  return prepared;
}

// On the thread of the queue.
std::shared_ptr<ChartCalls::Finished> ChartCalls::chart(const Prepared& prepared,
                                                        const RenderQueue::Turn& turn) {
  const auto start = SteadyClock::now();
  const std::stop_token& stop = turn.stop;
  services_.log.event("chart_start", {{"chart", prepared.id}, {"queue_ms", turn.queued_ms}});
  std::atomic<SteadyClock::time_point> stopped_at = SteadyClock::time_point::max();
  const std::stop_callback note(stop, [&] { stopped_at = SteadyClock::now(); });
  try {
    auto finished = std::make_shared<Finished>();
    finished->chart = chart_in_time(prepared, turn);
    services_.log.event("chart", {{"chart", prepared.id}, {"ms", milliseconds_since(start)}});
    return finished;
  } catch (const std::exception& exception) {
    std::vector<LogField> fields = {
        {"chart", prepared.id}, {"ms", milliseconds_since(start)}, {"why", exception.what()}};
    if (stop.stop_requested()) fields.emplace_back("stop_ms", milliseconds_since(stopped_at));
    services_.log.event("chart_ended_early", fields);
    throw;
  }
}

AccuracyChart ChartCalls::chart_in_time(const Prepared& prepared, const RenderQueue::Turn& turn) {
  const auto scene = services_.scenes.scene(prepared.request->picture, prepared.scene_hash);
  const auto deadline = SteadyClock::now() + services_.limits.chart_time;
  std::stop_source ended;
  const std::stop_callback pass_on(turn.stop, [&] { ended.request_stop(); });
  bool too_late = false;  // the chart has no thread but this
  int logged = 0;
  const RunControl control{
      .stop = ended.get_token(), .progress = [&](double share) {
        turn.progress->advance(share);
        if (const int step = static_cast<int>(share * kLoggedSteps); step > logged) {
          logged = step;
          services_.log.event("chart_progress", {{"chart", prepared.id}, {"progress", share}});
        }
        if (SteadyClock::now() < deadline || std::exchange(too_late, true)) return;
        ended.request_stop();
      }};
  try {
    return accuracy_chart(prepared.request->chart, *scene, control);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::cancelled || !too_late || turn.stop.stop_requested()) throw;
    throw Refusal(http::status::gateway_timeout, "deadline",
                  "the chart was stopped after " +
                      std::to_string(services_.limits.chart_time.count()) + " ms");
  }
}

Reply ChartCalls::event_reply(Call& call, const std::shared_ptr<Run>& run) {
  Reply reply;
  reply.set("Content-Type", std::string(kTypes[static_cast<std::size_t>(Form::events)]));
  reply.set("Cache-Control", "no-store");
  reply.set("Vary", "Accept");
  // The stream outlives the call, not the connection and the record that it refers to.
  reply.next_piece = [client = &call.client, record = &call.record, run] {
    return next_event(*client, *record, *run);
  };
  return reply;
}

// What the stream says next; nothing after the chart or the problem.
asio::awaitable<std::string> ChartCalls::next_event(Connection& client, RequestRecord& record,
                                                    Run& run) {
  if (run.ended) co_return std::string();
  for (bool is_first = run.told < 0.0;; is_first = false) {
    if (!is_first) {
      const auto first = co_await (run.ticket->ended() || pause() || client.peer_gone());
      if (first.index() == 2) throw ClientGone();
      if (first.index() == 0) break;
    }
    const double share = run.ticket->progress().fraction;
    if (share <= run.told) continue;
    run.told = share;
    co_return progress_event(share);
  }
  run.ended = true;
  std::exception_ptr failure;
  try {
    co_return event("chart", api::chart_json(*run.request, run.chart()));
  } catch (...) {
    failure = std::current_exception();
  }
  const Reply problem = reply_of(failure, record);
  co_return event("problem", {problem.bytes().data(), problem.bytes().size()});
}

}  // namespace fstop::server
