#include "server/composite_calls.h"

#include <algorithm>
#include <chrono>
#include <utility>
#include <variant>

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "api/problem.h"
#include "api/render_id.h"
#include "core/error.h"
#include "server/counted.h"
#include "server/render_calls.h"
#include "server/reply_head.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
using asio::experimental::awaitable_operators::operator||;
using SteadyClock = std::chrono::steady_clock;

constexpr int kMostPreparing = 16;

std::string error_text(const LayerError& error) {
  return "upper=" + short_number(error.color) + ", alpha_upper=" + short_number(error.alpha);
}

// What a render has against its layer, at the layer's place.
[[noreturn]] void refuse_layer(const Error& error, std::size_t layer) {
  const std::string pointer = api::layer_pointer(layer) + "/render";
  if (const auto* refused = dynamic_cast<const api::InvalidRequest*>(&error)) {
    throw api::InvalidRequest(api::moved_faults(*refused, pointer));
  }
  throw api::InvalidRequest(api::FieldFault{pointer, error.what()}, error.code());
}

bool is_the_clients(ErrorCode code) {
  return code != ErrorCode::cancelled && code != ErrorCode::io_failure &&
         code != ErrorCode::internal;
}

std::size_t color_bytes(int width, int height) {
  return sizeof(float) * 4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

}  // namespace

struct CompositeCalls::Finished {
  api::Composite composite = {};
};

void CompositeCalls::add_to(Routes& routes) {
  routes.add(http::verb::post, "/v1/composites", [this](Call& call) { return create(call); });
}

asio::awaitable<Reply> CompositeCalls::create(Call& call) {
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
  const RenderQueue::Work work = [this, prepared](const RenderQueue::Turn& turn) {
    return composed(prepared, turn);
  };
  RenderQueue::Ticket ticket =
      services_.queue.submit({.id = prepared.id,
                              .client = call.client.peer(),
                              .cost_s = prepared.cost_s,
                              .memory_bytes = prepared.memory_bytes,
                              .is_small = prepared.cost_s <= services_.limits.small_render_s,
                              .work = work});
  const auto first = co_await (ticket.ended() || call.client.peer_gone());
  if (first.index() == 1) throw ClientGone();
  const auto finished = std::static_pointer_cast<Finished>(ticket.result());
  const api::Composite& composite = finished->composite;

  Reply reply;
  reply.set("Vary", "Accept");
  reply.set("Cache-Control", "no-store");
  reply.set("Fstop-Composite-Id", prepared.id);
  reply.set("Fstop-Error", error_text(composite.error));
  if (!prepared.wanted) {
    reply.set("Content-Type", "application/json");
    reply.body = composite.report;
    co_return reply;
  }
  const ImageFormat format = *prepared.wanted;
  const bool is_float = format == ImageFormat::exr || format == ImageFormat::tiff;
  const Precision precision = is_float ? prepared.request->precision : Precision::single;
  const auto encode_now = [&] {
    return std::make_shared<const std::vector<std::byte>>(
        encode(api::composite_picture(composite, prepared.id, format), format, precision));
  };
  const SharedBytes bytes = co_await services_.encoders.run(encode_now);
  reply.set("Content-Type", std::string(media_type(format)));
  reply.set("ETag", etag_of(api::sha256_hex(*bytes)));
  reply.body = bytes;
  co_return reply;
}

CompositeCalls::Prepared CompositeCalls::prepare(const Request& request) {
  Prepared prepared;
  auto parsed = std::make_shared<const api::CompositeRequest>(
      api::parse_composite_request(request.body, services_.limits, api::SceneNames::stored_only));
  prepared.wanted = negotiated(request.header("Accept"), parsed->format, true);
  if (parsed->wants_alpha && prepared.wanted == ImageFormat::jpeg) {
    throw Refusal(http::status::not_acceptable, "not-acceptable",
                  "this composite has alpha, and jpeg holds none: ask for png, webp, tiff or exr");
  }
  std::vector<std::string> contents;
  for (std::size_t i = 0; i < parsed->layers.size(); ++i) {
    const auto& source = parsed->layers[i].source;
    std::optional<RenderTask> task;
    if (const auto* render = std::get_if<api::RenderRequest>(&source)) {
      try {
        task = task_of(*render);
      } catch (const Error& error) {
        if (!is_the_clients(error.code())) throw;
        refuse_layer(error, i);
      }
      contents.push_back(task->id);
      prepared.cost_s += task->cost.wall_s;
      // The canvas and two layers beside the largest render.
      prepared.memory_bytes = std::max(
          prepared.memory_bytes,
          task->cost.memory_bytes +
              3.0 * static_cast<double>(color_bytes(render->spec.width, render->spec.height)));
    } else if (const auto* image = std::get_if<api::LayerImage>(&source)) {
      contents.push_back(image->file.empty() ? std::string()
                                             : api::sha256_hex(stored_file(*image, i)));
    } else {
      contents.push_back(std::get<std::string>(source));
    }
    prepared.renders.push_back(std::move(task));
  }
  prepared.id = api::composite_id(*parsed, contents);
  prepared.request = std::move(parsed);
  return prepared;
}

RenderTask CompositeCalls::task_of(const api::RenderRequest& request) const {
  RenderTask task;
  task.request = std::make_shared<const api::RenderRequest>(request);
  task.format = request.format;
  task.scene_hash = services_.scenes.hash(request);
  task.id = api::render_id(request.canonical, task.scene_hash, api::engine_version());
  if (services_.renders.find(task.id)) return task;  // costs nothing more
  task.cost = services_.costs.predict(request.spec, task.scene_hash);
  refuse_what_costs_too_much(task, services_.limits);
  return task;
}

std::vector<std::byte> CompositeCalls::stored_file(const api::LayerImage& image,
                                                   std::size_t layer) const {
  try {
    return services_.store.file(image.file);
  } catch (const Error& error) {
    if (!is_the_clients(error.code())) throw;
    // The request names what is not there: that is its fault, not the target's.
    const bool is_absent = error.code() == ErrorCode::not_found;
    throw api::InvalidRequest(
        api::FieldFault{api::layer_pointer(layer) + "/image/file", error.what()},
        is_absent ? ErrorCode::invalid_request : error.code());
  }
}

// On a thread of the queue.
std::shared_ptr<CompositeCalls::Finished> CompositeCalls::composed(const Prepared& prepared,
                                                                   const RenderQueue::Turn& turn) {
  const auto start = SteadyClock::now();
  const std::size_t count = prepared.renders.size();
  services_.log.event("composite_start", {{"composite", prepared.id},
                                          {"layers", static_cast<int>(count)},
                                          {"queue_ms", turn.queued_ms}});
  const auto milliseconds = [&] {
    return std::chrono::duration<double, std::milli>(SteadyClock::now() - start).count();
  };
  try {
    api::Compositor compositor(*prepared.request);
    for (std::size_t layer = 0; layer < count; ++layer) {
      if (turn.stop.stop_requested()) {
        throw Error(ErrorCode::cancelled, "stopped before it was done");
      }
      compositor.add(picture_of(prepared, layer, turn));
      turn.progress->advance(static_cast<double>(layer + 1) / static_cast<double>(count));
    }
    auto finished = std::make_shared<Finished>();
    finished->composite = compositor.finish(prepared.id);
    services_.log.event("composite", {{"composite", prepared.id}, {"ms", milliseconds()}});
    return finished;
  } catch (const std::exception& exception) {
    services_.log.event(
        "composite_ended_early",
        {{"composite", prepared.id}, {"ms", milliseconds()}, {"why", exception.what()}});
    throw;
  }
}

api::LayerPicture CompositeCalls::picture_of(const Prepared& prepared, std::size_t layer,
                                             const RenderQueue::Turn& turn) {
  if (prepared.renders[layer]) return rendered(*prepared.renders[layer], layer, turn);
  const auto& source = prepared.request->layers[layer].source;
  if (const auto* image = std::get_if<api::LayerImage>(&source)) return sent(*image, layer);
  const auto& id = std::get<std::string>(source);
  const auto render = services_.renders.load(id);
  if (!render) {
    throw api::InvalidRequest(api::FieldFault{
        api::layer_pointer(layer) + "/render",
        "there is no such render, or it is no longer kept: ask for it again with POST"});
  }
  return api::layer_picture(render->photograph, id);
}

api::LayerPicture CompositeCalls::rendered(const RenderTask& task, std::size_t layer,
                                           const RenderQueue::Turn& turn) {
  Progress of_layer;  // its previews are not the composite's
  const RenderQueue::Turn own{.stop = turn.stop,
                              .queued_ms = turn.queued_ms,
                              .is_express = turn.is_express,
                              .progress = &of_layer};
  try {
    if (const auto there = services_.renders.load(task.id)) {
      return api::layer_picture(there->photograph, task.id);
    }
    return api::layer_picture(services_.work.render(task, own)->photograph, task.id);
  } catch (const Error& error) {
    if (!is_the_clients(error.code())) throw;
    refuse_layer(error, layer);
  }
}

api::LayerPicture CompositeCalls::sent(const api::LayerImage& image, std::size_t layer) {
  const std::string pointer = api::layer_pointer(layer) + "/image";
  if (image.file.empty()) {
    const Image pixels = images_.read(image.bytes, image.color_space, true, pointer + "/base64");
    return api::layer_picture(pixels, image.is_premultiplied);
  }
  try {
    return api::layer_picture(stored_file(image, layer), image, services_.limits);
  } catch (const api::InvalidRequest&) {
    throw;
  } catch (const Error& error) {
    if (!is_the_clients(error.code())) throw;
    throw api::InvalidRequest(api::FieldFault{pointer + "/file", error.what()}, error.code());
  }
}

}  // namespace fstop::server
