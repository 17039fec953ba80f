#include "server/render_calls.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "api/picture.h"
#include "api/render_id.h"
#include "core/error.h"
#include "server/counted.h"
#include "server/reply_head.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
using asio::experimental::awaitable_operators::operator||;

// Requests being read for each place in the queue: most may ask for what is there already.
constexpr int kPreparedPerPlace = 8;

constexpr auto kAskAgain = std::chrono::milliseconds(500);
constexpr auto kUntilNoted =
    std::chrono::milliseconds(1);  // between looks whether a note lies on the disk

// The id says all that the bytes depend on, so they never change.
constexpr const char* kUnchanging = "private, max-age=31536000, immutable";

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

asio::awaitable<void> sleep_until(Clock::time_point time) {
  asio::steady_timer timer(co_await asio::this_coro::executor, time);
  co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
}

// 0: something else than an error ends the render.
double error_that_ends(const RenderTask& task) {
  const QualitySpec& quality = task.request->spec.quality;
  return quality.samples || quality.max_time_ms ? 0.0 : quality.max_error;
}

Refusal too_late() {
  return {http::status::gateway_timeout, "deadline",
          "the render was not done when the client's time had run out"};
}

}  // namespace

// Samples that the planner chooses are bounded while they are
// taken; those that are asked for are certain.
void refuse_what_costs_too_much(const RenderTask& task, const api::Limits& limits) {
  const auto most_s = std::chrono::duration<double>(limits.render_time).count();
  const auto most_bytes = static_cast<double>(limits.render_bytes);
  const QualitySpec& quality = task.request->spec.quality;
  const bool takes_too_long = quality.samples && task.cost.wall_s > most_s;
  if (!takes_too_long && task.cost.memory_bytes <= most_bytes) return;
  const std::string detail =
      takes_too_long
          ? "the render is predicted to take " + digits(task.cost.wall_s, 3) + " s, more than " +
                digits(most_s, 6) + " s: fewer #/quality/samples take less"
          : "the render is predicted to take " + digits(task.cost.memory_bytes / (1 << 20), 6) +
                " MiB, more than " + digits(most_bytes / (1 << 20), 6) +
                " MiB: a smaller #/image takes less";
  throw Refusal(http::status::unprocessable_entity, "over-budget", detail).predicting(task.cost);
}

std::string short_number(double number) { return digits(number, 6); }

void require_room_for_alpha(const SimulationSpec& spec, ImageFormat format) {
  if (format != ImageFormat::jpeg || std::ranges::count(spec.outputs, Output::alpha) == 0) return;
  throw Refusal(http::status::not_acceptable, "not-acceptable",
                "this render has alpha, and jpeg holds none: ask for png, webp, tiff or exr");
}

void describe(Reply& reply, const StoredRender& render) {
  const ImageError& error = render.photograph.report.error;
  reply.set("Fstop-Render-Id", render.id);
  reply.set("Fstop-Method", render.photograph.report.method);
  reply.set("Fstop-Error",
            "estimate=" + digits(error.estimate, 6) + ", upper_95=" + digits(error.upper_95, 6));
}

ImageFormat wanted_format(const Request& request, ImageFormat usual) {
  constexpr std::array<std::string_view, 1> kKnown = {"format"};
  const auto query = query_parameters(request, kKnown);
  if (query.contains("format")) return format_of(query.at("format"));
  return *negotiated(request.header("Accept"), usual, false);
}

asio::awaitable<EncodedFile> encoded_file(Workers& encoders, RenderCache& renders,
                                          std::shared_ptr<StoredRender> render, FileKey key) {
  const bool is_float = key.format == ImageFormat::exr || key.format == ImageFormat::tiff;
  if (!is_float) key.precision = Precision::single;
  if (auto known = render->known_file(key)) co_return *known;
  const auto encode_now = [&] {
    EncodedFile made = render->file(key);
    renders.recount(render->id);
    return made;
  };
  co_return co_await encoders.run(encode_now);
}

Reply accepted_reply(const Job& job, const Preferences& wishes) {
  const api::JobView view = view_of(job);
  Reply reply{.status = http::status::accepted, .body = api::job_json(view)};
  reply.set("Content-Type", "application/json");
  reply.set("Location", "/v1/jobs/" + job.name);
  reply.set("Cache-Control", "no-store");
  reply.set("Fstop-Render-Id", job.order.render);
  const double seconds = view.remaining_ms ? 1e-3 * *view.remaining_ms : 1.0;
  reply.set("Retry-After",
            std::to_string(static_cast<int>(std::ceil(std::clamp(seconds, 1.0, 60.0)))));
  if (!wishes.applied.empty()) reply.set("Preference-Applied", wishes.applied);
  return reply;
}

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
  const auto start = Clock::now();
  if (services_.draining) {
    throw Refusal(http::status::service_unavailable, "draining", "the server is about to stop")
        .with("Retry-After", "5");
  }
  if (preparing_ >= kPreparedPerPlace * services_.limits.queued_renders) {
    throw Refusal(http::status::service_unavailable, "overloaded", "too many requests at once")
        .with("Retry-After", "1");
  }
  const Preferences wishes = preferences_of(call.request, services_.limits);
  Prepared prepared;
  {
    const Counted counted(preparing_);
    prepared = co_await services_.readers.run([this, &call] { return prepare(call.request); });
  }
  call.record.render = prepared.task.id;
  const std::shared_ptr<Job> earlier =
      wishes.idempotency_key.empty()
          ? nullptr
          : services_.jobs.repeated(call.client.peer() + ' ' + wishes.idempotency_key,
                                    prepared.fingerprint);
  while (earlier && !earlier->is_noted && earlier->state == Job::State::active)
    co_await sleep_until(Clock::now() + kUntilNoted);
  if (earlier && earlier->state == Job::State::active) co_return accepted_reply(*earlier, wishes);
  std::shared_ptr<StoredRender> render = prepared.there;
  if (!render && earlier) render = earlier->result;
  if (render) co_return co_await created(call, prepared, render, true);

  RenderQueue::Ticket ticket = submit(call.client.peer(), prepared);
  const auto last = wishes.deadline ? start + *wishes.deadline : Clock::time_point::max();
  const auto patience = start + wishes.wait;
  bool has_ended = wishes.wait.count() == 0 ? ticket.has_ended() : false;
  // While the server drains nobody could ask for a job: then the wait goes on.
  for (auto until = std::min(patience, last); !has_ended && Clock::now() < until;
       until = services_.draining ? last : until) {
    const auto first = co_await (ticket.ended() || call.client.peer_gone() || sleep_until(until));
    if (first.index() == 1) throw ClientGone();
    has_ended = first.index() == 0;
  }
  if (!has_ended && Clock::now() >= last) throw too_late();
  if (!has_ended) co_return co_await promoted(call, prepared, wishes, std::move(ticket), start);
  render = std::static_pointer_cast<StoredRender>(ticket.result());
  co_return co_await created(call, prepared, render, false);
}

RenderCalls::Prepared RenderCalls::prepare(const Request& request) {
  Prepared prepared;
  auto parsed = std::make_shared<const api::RenderRequest>(
      api::parse_render_request(request.body, services_.limits, api::SceneNames::stored_only));
  prepared.wanted = negotiated(request.header("Accept"), parsed->format, true);
  RenderTask& task = prepared.task;
  task.format = prepared.wanted.value_or(parsed->format);
  require_room_for_alpha(parsed->spec, task.format);
  task.scene_hash = services_.scenes.hash(*parsed);
  task.id = api::render_id(parsed->canonical, task.scene_hash, api::engine_version());
  task.request = std::move(parsed);
  if (request.has_header("Idempotency-Key"))
    prepared.fingerprint = api::sha256_hex(std::string_view(request.body));
  if (task.is_kept()) prepared.there = services_.renders.load(task.id);
  if (prepared.there) return prepared;
  task.cost = services_.costs.predict(task.request->spec, task.scene_hash);
  refuse_what_costs_too_much(task, services_.limits);
  task.is_small = is_small(task);
  return prepared;
}

// A scene of which nothing was rendered yet may cost far more than others: lights and forking
// branches tell how much more.
bool RenderCalls::is_small(const RenderTask& task) const {
  constexpr double kUsualRays = 4.0;  // of a point, in the bundled scenes
  double wall_s = task.cost.wall_s;
  if (!services_.costs.knows(task.request->spec, task.scene_hash))
    wall_s *= std::max(1.0, services_.scenes.rays_of_a_point(task.scene_hash) / kUsualRays);
  return wall_s <= services_.limits.small_render_s;
}

RenderQueue::Ticket RenderCalls::submit(const std::string& client, const Prepared& prepared) {
  const RenderTask& task = prepared.task;
  return services_.queue.submit({.id = task.id,
                                 .client = client,
                                 .cost_s = task.cost.wall_s,
                                 .memory_bytes = task.cost.memory_bytes,
                                 .is_small = task.is_small,
                                 .work = [this, task](const RenderQueue::Turn& turn) {
                                   return services_.work.render(task, turn);
                                 }});
}

// What was accepted outlives this process: its note lies on the disk before the client knows.
asio::awaitable<Reply> RenderCalls::promoted(Call& call, const Prepared& prepared,
                                             const Preferences& wishes, RenderQueue::Ticket ticket,
                                             Clock::time_point start) {
  JobOrder order{.render = prepared.task.id,
                 .is_kept = prepared.task.is_kept(),
                 .format = prepared.task.format,
                 .precision = prepared.task.request->precision,
                 .max_error = error_that_ends(prepared.task)};
  api::JobNote note{.turn = services_.notes.next_turn(),
                    .render = order.render,
                    .format = std::string(format_name(order.format)),
                    .client = call.client.peer(),
                    .body = call.request.body};
  if (wishes.deadline) {
    order.deadline = start + *wishes.deadline;
    note.deadline =
        std::chrono::system_clock::now() +
        std::chrono::duration_cast<std::chrono::milliseconds>(*order.deadline - Clock::now());
  }
  const auto job = services_.jobs.add(std::move(order), std::move(ticket));
  note.job = job->name;
  if (!wishes.idempotency_key.empty()) {
    note.idempotency_key = call.client.peer() + ' ' + wishes.idempotency_key;
    note.fingerprint = prepared.fingerprint;
    services_.jobs.remember(note.idempotency_key, note.fingerprint, job->name);
  }
  if (services_.notes.are_kept()) {
    job->is_noted = false;
    std::exception_ptr failure;
    try {
      co_await services_.readers.run([this, &note] { services_.notes.write(note); });
    } catch (...) {
      failure = std::current_exception();
    }
    job->is_noted = true;
    if (failure) {
      services_.jobs.withdraw(job);
      std::rethrow_exception(failure);
    }
  }
  co_return accepted_reply(*job, wishes);
}

void RenderCalls::restore(const std::vector<api::JobNote>& notes) {
  for (const api::JobNote& note : notes) {
    JobOrder order{.render = note.render, .name = note.job};
    if (note.deadline)
      order.deadline = Clock::now() + (*note.deadline - std::chrono::system_clock::now());
    services_.jobs.restore(std::move(order));
    if (!note.idempotency_key.empty())
      services_.jobs.remember(note.idempotency_key, note.fingerprint, note.job);
  }
}

asio::awaitable<void> RenderCalls::resume(std::vector<api::JobNote> notes) {
  for (const api::JobNote& note : notes) {
    if (services_.draining) co_return;
    co_await resume(note);
  }
}

asio::awaitable<void> RenderCalls::resume(const api::JobNote& note) {
  const std::shared_ptr<Job> job = services_.jobs.look_up(note.job);
  if (!job || job->state != Job::State::active) co_return;  // withdrawn meanwhile
  std::exception_ptr failure;
  try {
    if (job->order.deadline && Clock::now() >= *job->order.deadline) throw too_late();
    Request request{.body = note.body};
    const Prepared prepared =
        co_await services_.readers.run([this, &request] { return prepare(request); });
    if (prepared.task.id != note.render) {
      throw Refusal(http::status::conflict, "scene-changed",
                    "the scene's files or the program changed while the job waited for the server "
                    "to begin anew");
    }
    job->order.is_kept = prepared.task.is_kept();
    job->order.format = format_of(note.format);
    job->order.precision = prepared.task.request->precision;
    job->order.max_error = error_that_ends(prepared.task);
    if (!prepared.there) {
      co_await submit_patiently(job, note, prepared);
      co_return;
    }
  } catch (...) {
    failure = std::current_exception();
  }
  services_.jobs.settle(job, failure);
}

// Others may have filled the queue: then the job waits for a place in it.
asio::awaitable<void> RenderCalls::submit_patiently(const std::shared_ptr<Job>& job,
                                                    const api::JobNote& note,
                                                    const Prepared& prepared) {
  while (!services_.draining && job->state == Job::State::active) {
    try {
      services_.jobs.begin(job, submit(note.client, prepared));
      services_.log.event("job_resumed", {{"job", note.job.substr(0, 8)}});
      co_return;
    } catch (const Refusal&) {
      // No place yet, or the server is about to stop: then the next process begins it.
    }
    co_await sleep_until(Clock::now() + kAskAgain);
  }
}

// The reply that has the picture, or the report.
asio::awaitable<Reply> RenderCalls::created(Call& call, const Prepared& prepared,
                                            std::shared_ptr<StoredRender> render, bool was_there) {
  Reply reply;
  describe(reply, *render);
  reply.set("Vary", "Accept");
  reply.set("Cache-Control", "no-store");
  if (prepared.task.is_kept()) reply.set("Location", "/v1/renders/" + render->id);
  double encode_ms = 0.0;
  if (prepared.wanted) {
    const FileKey key = {.format = *prepared.wanted, .precision = prepared.task.request->precision};
    const EncodedFile encoded =
        co_await encoded_file(services_.encoders, services_.renders, render, key);
    encode_ms = encoded.encode_ms;
    reply.set("Content-Type", std::string(media_type(*prepared.wanted)));
    reply.set("ETag", encoded.etag);
    reply.body = encoded.bytes;
  } else {
    reply.set("Content-Type", "application/json");
    reply.body = render->report;
  }
  reply.set("Server-Timing", server_timing(render->timing, encode_ms, was_there));
  (void)call;
  co_return reply;
}

asio::awaitable<std::shared_ptr<StoredRender>> RenderCalls::stored(Call& call) {
  const std::string id = call.parameters[0];
  std::shared_ptr<StoredRender> render = services_.renders.find(id);
  if (!render) {
    const auto load = [this, &id] { return services_.renders.load(id); };
    render = co_await services_.readers.run(load);
  }
  if (!render) {
    throw Refusal(http::status::not_found, "not-found",
                  "there is no such render, or it is no longer kept: ask for it again with POST");
  }
  call.record.render = render->id;
  co_return render;
}

asio::awaitable<Reply> RenderCalls::report(Call& call) {
  const std::shared_ptr<StoredRender> render = co_await stored(call);
  const std::string etag = etag_of(api::sha256_hex(std::string_view(render->report)));
  Reply reply = tagged_reply(call.request, "application/json", etag, render->report);
  describe(reply, *render);
  reply.set("Cache-Control", kUnchanging);
  co_return reply;
}

asio::awaitable<Reply> RenderCalls::image(Call& call) { return file_reply(call, {}); }

asio::awaitable<Reply> RenderCalls::output(Call& call) {
  const auto output = output_of(call.parameters[1]);
  if (!output) throw Refusal(http::status::not_found, "not-found", "no output has this name");
  // Depths and diameters are numbers: floating point unless asked otherwise.
  return file_reply(call, {.output = *output, .format = ImageFormat::exr, .alone = true});
}

asio::awaitable<Reply> RenderCalls::file_reply(Call& call, FileKey key) {
  key.format = wanted_format(call.request, key.format);
  const std::shared_ptr<StoredRender> render = co_await stored(call);
  if (!key.alone) require_room_for_alpha(render->spec, key.format);
  const EncodedFile encoded =
      co_await encoded_file(services_.encoders, services_.renders, render, key);
  Reply reply =
      tagged_reply(call.request, std::string(media_type(key.format)), encoded.etag, encoded.bytes);
  describe(reply, *render);
  reply.set("Vary", "Accept");
  reply.set("Cache-Control", kUnchanging);
  co_return reply;
}

}  // namespace fstop::server
