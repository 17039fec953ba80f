#include "server/sent_image.h"

#include <iostream>
#include <utility>

#include "api/measurement_request.h"
#include "api/problem.h"
#include "api/scene_upload.h"
#include "core/error.h"
#include "server/commands.h"
#include "server/sandbox.h"

namespace fstop::server {
namespace {

constexpr const char* kLinear = "linear";
constexpr const char* kSrgb = "srgb";
constexpr const char* kWithAlpha = "with-alpha";
constexpr const char* kColorAlone = "color-alone";

// The answer: four floats a pixel, and its head.
constexpr SandboxLimits kReaderLimits = {.memory_bytes = std::size_t{1} << 30,
                                         .cpu_s = 10,
                                         .wall = std::chrono::milliseconds(20'000),
                                         .answer_bytes = (std::size_t{64} << 20) + 64};

}  // namespace

Image SentImageReader::read(const std::string& bytes, ColorSpace color_space, bool with_alpha,
                            const std::string& pointer) {
  const char* encoding = color_space == ColorSpace::linear ? kLinear : kSrgb;
  const char* channels = with_alpha ? kWithAlpha : kColorAlone;
  const SandboxAnswer answer =
      run_apart(program_, {"read-image", encoding, channels}, bytes, kReaderLimits);
  if (answer.exit_code == 0) return api::unpacked_image(answer.output, limits_);
  std::string why = "cannot be read within " + std::to_string(kReaderLimits.cpu_s) + " s and " +
                    std::to_string(kReaderLimits.memory_bytes >> 20U) + " MiB";
  if (answer.exit_code == 2) {
    why = api::problem_of_upload(answer.output).detail;
  } else {
    log_.warning("image_reader_ended",
                 {{"exit_code", answer.exit_code}, {"timed_out", answer.timed_out ? 1 : 0}});
  }
  throw api::InvalidRequest(api::FieldFault{pointer, std::move(why)}, ErrorCode::bad_image);
}

int read_image(const std::string& color_space, const std::string& channels) {
  enter_sandbox(kReaderLimits);
  const api::Limits limits;
  const std::string bytes = text_of("-", limits.assets.max_file_bytes);
  const ColorSpace encoding = color_space == kLinear ? ColorSpace::linear : ColorSpace::srgb;
  const Image image = channels == kWithAlpha ? api::read_sent_layer(bytes, encoding, limits)
                                             : api::read_sent_image(bytes, encoding, limits);
  std::cout << api::packed_image(image) << std::flush;
  return std::cout ? 0 : 1;
}

}  // namespace fstop::server
