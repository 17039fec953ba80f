#include "server/job_calls.h"

#include <array>
#include <charconv>
#include <cstdint>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "api/job_json.h"
#include "api/picture.h"
#include "api/render_id.h"
#include "server/negotiation.h"
#include "server/render_calls.h"
#include "server/reply_head.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
using asio::experimental::awaitable_operators::operator||;

asio::awaitable<void> pause(std::chrono::milliseconds time) {
  asio::steady_timer timer(co_await asio::this_coro::executor, time);
  co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
}

// Job JSON has no line breaks, so that its text is one line of data.
std::string event_text(const Job& job, std::uint64_t number) {
  const api::JobView view = view_of(job);
  const bool has_ended = job.state != Job::State::active;
  std::string text = "id: " + std::to_string(number) + "-" + job.life + "\nevent: ";
  text.append(has_ended ? view.state : "progress").append("\ndata: ");
  return text.append(api::job_json(view)).append("\n\n");
}

// Of the Last-Event-ID that a browser sends when it comes back. Numbers of another job, or of
// another life of the server, say nothing.
std::optional<std::uint64_t> last_event(const Request& request, const Job& job) {
  const std::string_view text = request.header("Last-Event-ID");
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string_view rest = text.substr(static_cast<std::size_t>(end - text.data()));
  if (error != std::errc() || rest != "-" + job.life) return {};
  return number;
}

}  // namespace

/// What one reader of a job's events has been told.
struct JobCalls::Stream {
  std::shared_ptr<Job> job = {};
  std::optional<std::uint64_t> told = {};  // the newest event's number
  int told_place = 0;
  bool ended = false;
};

void JobCalls::add_to(Routes& routes) {
  using Method = asio::awaitable<Reply> (JobCalls::*)(Call&);
  const auto add = [&](http::verb verb, const char* pattern, Method method) {
    routes.add(verb, pattern, [this, method](Call& call) { return (this->*method)(call); });
  };
  add(http::verb::get, "/v1/jobs/{job}", &JobCalls::show);
  add(http::verb::delete_, "/v1/jobs/{job}", &JobCalls::withdraw);
  add(http::verb::get, "/v1/jobs/{job}/events", &JobCalls::events);
  add(http::verb::get, "/v1/jobs/{job}/preview", &JobCalls::preview);
  add(http::verb::get, "/v1/jobs/{job}/image", &JobCalls::image);
}

asio::awaitable<Reply> JobCalls::show(Call& call) {
  const std::shared_ptr<Job> job = services_.jobs.find(call.parameters[0]);
  Reply reply{.body = api::job_json(view_of(*job))};
  reply.set("Content-Type", "application/json");
  reply.set("Cache-Control", "no-store");
  if (job->state == Job::State::active) reply.set("Retry-After", "1");
  co_return reply;
}

asio::awaitable<Reply> JobCalls::withdraw(Call& call) {
  services_.jobs.withdraw(services_.jobs.find(call.parameters[0]));
  Reply reply{.status = http::status::no_content};
  reply.set("Cache-Control", "no-store");
  co_return reply;
}

asio::awaitable<Reply> JobCalls::events(Call& call) {
  const auto stream = std::make_shared<Stream>();
  stream->job = services_.jobs.find(call.parameters[0]);
  stream->told = last_event(call.request, *stream->job);
  const bool knows_all = stream->told && stream->job->state != Job::State::active &&
                         *stream->told >= stream->job->version();
  Reply reply;
  reply.set("Cache-Control", "no-store");
  if (knows_all) {
    reply.status = http::status::no_content;  // tells a browser not to come back
    co_return reply;
  }
  if (stream->told && stream->job->ticket) stream->told_place = stream->job->ticket->place();
  reply.set("Content-Type", "text/event-stream");
  // The stream outlives the call, not the connection.
  reply.next_piece = [limits = &services_.limits, client = &call.client, stream] {
    return next_event(*limits, *client, *stream);
  };
  co_return reply;
}

// The newest state once it differs from what was told; nothing after the end. What changes while
// the reader takes its time is never queued.
asio::awaitable<std::string> JobCalls::next_event(const api::Limits& limits, Connection& client,
                                                  Stream& stream) {
  if (stream.ended) co_return std::string();
  const auto silent_until = Clock::now() + limits.event_silence;
  for (bool is_first = true;; is_first = false) {
    if (!is_first || stream.told) {
      // With the pause between events, so that a render's thousand steps are a few events.
      if (stream.job->state == Job::State::active) {
        const auto first = co_await (pause(limits.between_events) || client.peer_gone());
        if (first.index() == 1) throw ClientGone();
      }
    }
    const Job& job = *stream.job;
    stream.ended = job.state != Job::State::active;
    const std::uint64_t number = job.version();
    const int place = job.ticket ? job.ticket->place() : 0;
    const bool is_new = !stream.told || number > *stream.told || place != stream.told_place;
    if (is_new || stream.ended) {
      stream.told = number;
      stream.told_place = place;
      co_return event_text(job, number);
    }
    if (Clock::now() >= silent_until) co_return std::string(": waiting\n\n");
  }
}

asio::awaitable<Reply> JobCalls::preview(Call& call) {
  const std::shared_ptr<Job> job = services_.jobs.find(call.parameters[0]);
  // The number only tells browsers that it is another picture: there is none but the newest.
  constexpr std::array<std::string_view, 2> kKnown = {"format", "number"};
  const auto query = query_parameters(call.request, kKnown);
  const ImageFormat format = query.contains("format") ? format_of(query.at("format"))
                                                      : *negotiated(call.request.header("Accept"),
                                                                    ImageFormat::png, false);
  if (job->state == Job::State::done &&
      !job->order.is_sweep) {  // since the reader was told of a preview, say
    Reply reply{.status = http::status::see_other};
    reply.set("Location",
              "/v1/jobs/" + job->name + "/image?format=" + std::string(format_name(format)));
    reply.set("Vary", "Accept");
    reply.set("Cache-Control", "no-store");
    co_return reply;
  }
  const Progress::State progress = job->progress();
  if (!progress.preview) {
    throw Refusal(http::status::not_found, "not-found",
                  "there is no preview: the render has not begun, has failed or shows none");
  }
  const auto encode_now = [&] {
    const Picture picture{.layers = {{{"R", "G", "B"}, *progress.preview}}};
    return std::make_shared<const std::vector<std::byte>>(encode(picture, format));
  };
  const SharedBytes bytes = co_await services_.encoders.run(encode_now);
  services_.metrics.previews(1);
  const std::string tag = etag_of(api::sha256_hex(*bytes));
  Reply reply = tagged_reply(call.request, std::string(media_type(format)), tag, bytes);
  reply.set("Vary", "Accept");
  reply.set("Cache-Control", "no-store");
  co_return reply;
}

asio::awaitable<Reply> JobCalls::image(Call& call) {
  const std::shared_ptr<Job> job = services_.jobs.find(call.parameters[0]);
  const FileKey key = {.format = wanted_format(call.request, job->order.format),
                       .precision = job->order.precision};
  if (job->state != Job::State::done || job->order.is_sweep) {
    throw Refusal(http::status::not_found, "not-found",
                  "the job has no picture: it is under way, failed or was withdrawn");
  }
  std::shared_ptr<StoredRender> render = job->result;
  if (!render && job->order.is_kept) {
    const auto load = [this, &job] { return services_.renders.load(job->order.render); };
    render = co_await services_.readers.run(load);
  }
  if (!render) {
    throw Refusal(http::status::gone, "gone", "the picture is no longer kept: ask for it again");
  }
  call.record.render = render->id;
  require_room_for_alpha(render->spec, key.format);
  const EncodedFile encoded =
      co_await encoded_file(services_.encoders, services_.renders, render, key);
  Reply reply =
      tagged_reply(call.request, std::string(media_type(key.format)), encoded.etag, encoded.bytes);
  describe(reply, *render);
  reply.set("Vary", "Accept");
  reply.set("Cache-Control", "private, no-cache");
  co_return reply;
}

}  // namespace fstop::server
