#include "server/measurement_calls.h"

#include <iostream>
#include <utility>

#include "api/scene_upload.h"
#include "core/error.h"
#include "server/commands.h"
#include "server/counted.h"
#include "server/sandbox.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;

constexpr int kThreads = 2;
constexpr int kNiceness = 5;
constexpr const char* kLinear = "linear";
constexpr const char* kSrgb = "srgb";

constexpr SandboxLimits kReaderLimits = {.memory_bytes = std::size_t{1} << 30,
                                         .cpu_s = 10,
                                         .wall = std::chrono::milliseconds(20'000),
                                         .answer_bytes = std::size_t{64} << 20};

}  // namespace

MeasurementCalls::MeasurementCalls(MeasurementServices services)
    : services_(std::move(services)), workers_(kThreads, kNiceness) {}

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
    const Image image = decoded(*sent);
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

// By a process of its own, locked in.
Image MeasurementCalls::decoded(const api::SentImage& sent) {
  const char* encoding = sent.color_space == ColorSpace::linear ? kLinear : kSrgb;
  const SandboxAnswer answer =
      run_apart(services_.program, {"read-image", encoding}, sent.bytes, kReaderLimits);
  if (answer.exit_code == 0) return api::unpacked_image(answer.output, services_.limits);
  std::string why = "cannot be read within " + std::to_string(kReaderLimits.cpu_s) + " s and " +
                    std::to_string(kReaderLimits.memory_bytes >> 20U) + " MiB";
  if (answer.exit_code == 2) {
    why = api::problem_of_upload(answer.output).detail;
  } else {
    services_.log.warning("image_reader_ended", {{"exit_code", answer.exit_code},
                                                 {"timed_out", answer.timed_out ? 1 : 0}});
  }
  throw api::InvalidRequest(api::FieldFault{"#/image/base64", std::move(why)},
                            ErrorCode::bad_image);
}

int read_image(const std::string& color_space) {
  enter_sandbox(kReaderLimits);
  const api::Limits limits;
  const std::string bytes = text_of("-", limits.assets.max_file_bytes);
  const ColorSpace encoding = color_space == kLinear ? ColorSpace::linear : ColorSpace::srgb;
  std::cout << api::packed_image(api::read_sent_image(bytes, encoding, limits)) << std::flush;
  return std::cout ? 0 : 1;
}

}  // namespace fstop::server
