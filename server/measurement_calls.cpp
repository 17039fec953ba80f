#include "server/measurement_calls.h"

#include <utility>

#include "server/counted.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;

constexpr int kThreads = 2;
constexpr int kNiceness = 5;

}  // namespace

MeasurementCalls::MeasurementCalls(MeasurementServices services)
    : services_(std::move(services)),
      images_(services_.program, services_.log, services_.limits),
      workers_(kThreads, kNiceness) {}

void MeasurementCalls::add_to(Routes& routes) {
  routes.add(http::verb::post, "/v1/measurements", [this](Call& call) { return measure(call); });
}

asio::awaitable<Reply> MeasurementCalls::measure(Call& call) {
  if (waiting_ >= services_.limits.waiting_measurements) {
    throw Refusal(http::status::service_unavailable, "overloaded", "too many requests at once")
        .with("Retry-After", "1");
  }
  const Counted counted(waiting_);
  const auto work = [this, &call] { return answer(call.request.body); };
  std::string text = co_await workers_.run(work);
  Reply reply{.body = std::move(text)};
  reply.set("Content-Type", "application/json");
  reply.set("Cache-Control", "no-store");
  co_return reply;
}

std::string MeasurementCalls::answer(const std::string& body) {
  const api::MeasurementRequest request = api::parse_measurement_request(body, services_.limits);
  if (const auto* sent = std::get_if<api::SentImage>(&request.picture)) {
    const Image image = images_.read(sent->bytes, sent->color_space, false, "#/image/base64");
    return api::measurement_json(request, image.view(), sent->pixel_pitch, services_.limits);
  }
  const auto render = services_.renders.load(std::get<std::string>(request.picture));
  if (!render) {
    throw Refusal(http::status::not_found, "not-found",
                  "there is no such render, or it is no longer kept: ask for it again with POST");
  }
  const Length pitch = render->spec.camera.sensor_width / render->spec.width;
  const Image& image = render->photograph.color;
  return api::measurement_json(request, image.view(), pitch, services_.limits);
}

}  // namespace fstop::server
