#include "server/render_calls.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <utility>

#include <boost/asio/experimental/awaitable_operators.hpp>

#include "api/picture.h"
#include "api/render_id.h"
#include "core/error.h"
#include "server/counted.h"
#include "server/reply_head.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
using asio::experimental::awaitable_operators::operator||;
using SteadyClock = std::chrono::steady_clock;

// Requests being read for each place in the queue: most may ask for what is there already.
constexpr int kPreparedPerPlace = 8;

// The id says all that the bytes depend on, so they never change.
constexpr const char* kUnchanging = "private, max-age=31536000, immutable";

double milliseconds_since(SteadyClock::time_point start) {
  return std::chrono::duration<double, std::milli>(SteadyClock::now() - start).count();
}

std::string digits(double number, int precision) {
  std::array<char, 64> text = {};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number,
                                 std::chars_format::general, precision)
                       .ptr;
  return {text.data(), end};
}

// https://www.w3.org/TR/server-timing/: milliseconds. A render found finished says so.
std::string server_timing(const api::Timing& timing, double encode_ms, bool was_there) {
  const std::string encode = "encode;dur=" + digits(encode_ms, 6);
  if (was_there) return "cache;desc=hit, " + encode;
  return "queue;dur=" + digits(timing.queue_ms, 6) + ", render;dur=" + digits(timing.render_ms, 6) +
         ", " + encode;
}

void describe(Reply& reply, const StoredRender& render) {
  const ImageError& error = render.photograph.report.error;
  reply.set("Fstop-Render-Id", render.id);
  reply.set("Fstop-Method", render.photograph.report.method);
  reply.set("Fstop-Error",
            "estimate=" + digits(error.estimate, 6) + ", upper_95=" + digits(error.upper_95, 6));
}

bool is_kept(const api::RenderRequest& request) { return !request.spec.quality.max_time_ms; }

}  // namespace

void RenderCalls::add_to(Routes& routes) {
  using Method = asio::awaitable<Reply> (RenderCalls::*)(Call&);
  const auto add = [&](http::verb verb, const char* pattern, Method method) {
    routes.add(verb, pattern, [this, method](Call& call) { return (this->*method)(call); });
  };
  add(http::verb::post, "/v1/renders", &RenderCalls::create);
  add(http::verb::get, "/v1/renders/{id}", &RenderCalls::report);
  add(http::verb::get, "/v1/renders/{id}/image", &RenderCalls::image);
  add(http::verb::get, "/v1/renders/{id}/outputs/{name}", &RenderCalls::output);
}

asio::awaitable<Reply> RenderCalls::create(Call& call) {
  if (services_.draining) {
    throw Refusal(http::status::service_unavailable, "draining", "the server is about to stop")
        .with("Retry-After", "5");
  }
  if (preparing_ >= kPreparedPerPlace * services_.limits.queued_renders) {
    throw Refusal(http::status::service_unavailable, "overloaded", "too many requests at once")
        .with("Retry-After", "1");
  }
  Prepared prepared;
  {
    const Counted counted(preparing_);
    prepared = co_await services_.readers.run([this, &call] { return prepare(call.request); });
  }
  call.record.render = prepared.id;
  std::shared_ptr<StoredRender> render = services_.renders.find(prepared.id);
  const bool was_there = render != nullptr;
  if (!was_there) render = co_await rendered(call, prepared);

  Reply reply;
  describe(reply, *render);
  reply.set("Vary", "Accept");
  reply.set("Cache-Control", "no-store");
  if (is_kept(*prepared.request)) reply.set("Location", "/v1/renders/" + render->id);
  double encode_ms = 0.0;
  if (prepared.wanted) {
    const EncodedFile encoded = co_await file(
        render, {.format = *prepared.wanted, .precision = prepared.request->precision});
    encode_ms = encoded.encode_ms;
    reply.set("Content-Type", std::string(media_type(*prepared.wanted)));
    reply.set("ETag", encoded.etag);
    reply.body = encoded.bytes;
  } else {
    reply.set("Content-Type", "application/json");
    reply.body = render->report_json();
  }
  reply.set("Server-Timing", server_timing(render->timing, encode_ms, was_there));
  co_return reply;
}

RenderCalls::Prepared RenderCalls::prepare(const Request& request) {
  Prepared prepared;
  auto parsed = std::make_shared<const api::RenderRequest>(
      api::parse_render_request(request.body, services_.limits, api::SceneNames::stored_only));
  prepared.wanted = negotiated(request.header("Accept"), parsed->format, true);
  prepared.scene_hash = services_.scenes.hash(*parsed);
  prepared.id = api::render_id(parsed->canonical, prepared.scene_hash, api::engine_version());
  prepared.request = std::move(parsed);
  return prepared;
}

// Waits for the render with the client; it is withdrawn when the client goes.
asio::awaitable<std::shared_ptr<StoredRender>> RenderCalls::rendered(Call& call,
                                                                     const Prepared& prepared) {
  const RenderQueue::Ticket ticket = services_.queue.submit(
      prepared.id, [this, prepared](const std::stop_token& stop, double queued_ms) {
        return render(prepared, stop, queued_ms);
      });
  const auto first = co_await (ticket.ended() || call.client.peer_gone());
  if (first.index() == 1) throw ClientGone();
  co_return std::static_pointer_cast<StoredRender>(ticket.result());
}

// On a thread of the queue.
std::shared_ptr<StoredRender> RenderCalls::render(const Prepared& prepared,
                                                  const std::stop_token& stop, double queued_ms) {
  if (auto there = services_.renders.find(prepared.id)) return there;  // ended just now
  const api::RenderRequest& request = *prepared.request;
  const auto start = SteadyClock::now();
  services_.log.event("render_start", {{"render", prepared.id}, {"queue_ms", queued_ms}});
  SimulationSpec spec = request.spec;
  spec.outputs = api::layers_needed(ImageFormat::exr, spec.outputs);
  std::atomic<SteadyClock::time_point> stopped_at = SteadyClock::time_point::max();
  const std::stop_callback note(stop, [&] { stopped_at = SteadyClock::now(); });
  const double cpu_start = cpu_.start();
  auto stored = std::make_shared<StoredRender>();
  try {
    const auto scene = services_.scenes.scene(request, prepared.scene_hash);
    stored->photograph = simulate_in_time(spec, *scene, stop);
  } catch (const std::exception& exception) {
    cpu_.stop(cpu_start);
    std::vector<LogField> fields = {
        {"render", prepared.id}, {"ms", milliseconds_since(start)}, {"why", exception.what()}};
    if (stop.stop_requested()) fields.emplace_back("stop_ms", milliseconds_since(stopped_at));
    services_.log.event("render_ended_early", fields);
    throw;
  }
  stored->id = prepared.id;
  stored->normalised = request.normalised;
  stored->spec = request.spec;
  stored->timing = {.render_ms = milliseconds_since(start),
                    .queue_ms = queued_ms,
                    .cpu_ms = cpu_.stop(cpu_start)};
  services_.log.event("render", {{"render", prepared.id},
                                 {"method", stored->photograph.report.method},
                                 {"ms", stored->timing.render_ms},
                                 {"queue_ms", queued_ms},
                                 {"cpu_ms", stored->timing.cpu_ms}});
  if (is_kept(request)) services_.renders.insert(stored);
  return stored;
}

Photograph RenderCalls::simulate_in_time(const SimulationSpec& spec, const RayScene& scene,
                                         const std::stop_token& stop) {
  const auto deadline = SteadyClock::now() + services_.limits.render_time;
  std::stop_source ended;
  const std::stop_callback pass_on(stop, [&] { ended.request_stop(); });
  std::atomic<bool> too_late = false;
  const RunControl run{.stop = ended.get_token(),
                       .progress =
                           [&](double) {
                             if (SteadyClock::now() < deadline || too_late.exchange(true)) return;
                             ended.request_stop();
                           },
                       .workers = &services_.pool};
  try {
    return services_.simulate(spec, scene, run);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::cancelled || !too_late || stop.stop_requested()) throw;
    throw Refusal(http::status::gateway_timeout, "deadline",
                  "the render was stopped after " +
                      std::to_string(services_.limits.render_time.count()) + " ms");
  }
}

asio::awaitable<EncodedFile> RenderCalls::file(std::shared_ptr<StoredRender> render, FileKey key) {
  const bool is_float = key.format == ImageFormat::exr || key.format == ImageFormat::tiff;
  if (!is_float) key.precision = Precision::single;
  const auto encoded = [&] {
    EncodedFile made = render->file(key);
    services_.renders.recount(render->id);
    return made;
  };
  co_return co_await services_.encoders.run(encoded);
}

std::shared_ptr<StoredRender> RenderCalls::stored(const Call& call) {
  auto render = services_.renders.find(call.parameters[0]);
  if (!render) {
    throw Refusal(http::status::not_found, "not-found",
                  "there is no such render, or it is no longer kept: ask for it again with POST");
  }
  call.record.render = render->id;
  return render;
}

asio::awaitable<Reply> RenderCalls::report(Call& call) {
  const auto render = stored(call);
  std::string json = render->report_json();
  const std::string etag = etag_of(api::sha256_hex(std::string_view(json)));
  Reply reply = tagged_reply(call.request, "application/json", etag, std::move(json));
  describe(reply, *render);
  reply.set("Cache-Control", "private, no-cache");  // encode_ms may still come
  co_return reply;
}

asio::awaitable<Reply> RenderCalls::image(Call& call) { return file_reply(call, {}); }

asio::awaitable<Reply> RenderCalls::output(Call& call) {
  const auto output = output_of(call.parameters[1]);
  if (!output) throw Refusal(http::status::not_found, "not-found", "no output has this name");
  // Depths and diameters are numbers: floating point unless asked otherwise.
  return file_reply(call, {.output = *output, .format = ImageFormat::exr, .alone = true});
}

// The file of the stored render in the format of ?format=, else by Accept, else `key`'s.
asio::awaitable<Reply> RenderCalls::file_reply(Call& call, FileKey key) {
  constexpr std::array<std::string_view, 1> kKnown = {"format"};
  const auto query = query_parameters(call.request, kKnown);
  key.format = query.contains("format")
                   ? format_of(query.at("format"))
                   : *negotiated(call.request.header("Accept"), key.format, false);
  const auto render = stored(call);
  const EncodedFile encoded = co_await file(render, key);
  Reply reply =
      tagged_reply(call.request, std::string(media_type(key.format)), encoded.etag, encoded.bytes);
  describe(reply, *render);
  reply.set("Vary", "Accept");
  reply.set("Cache-Control", kUnchanging);
  co_return reply;
}

}  // namespace fstop::server
