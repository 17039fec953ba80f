// What is sent as a scene, and what the process that reads it answers.
#include <string>

#include "api/scene_upload.h"
#include "core/error.h"
#include "tests/fuzz/fuzz_target.h"

namespace fstop::test {
namespace {

api::Limits small_limits() {
  api::Limits limits;
  limits.assets.max_triangles = 20'000;
  limits.assets.max_texture_pixels = std::size_t{1} << 16;
  limits.scene_bytes = std::size_t{1} << 16;
  return limits;
}

void check_names(const api::UploadedScene& scene) {
  for (const api::ArchiveEntry& file : scene.files)
    require(api::is_plain_name(file.name), "files that are stored have plain names");
}

void read_upload(std::span<const std::byte> bytes) {
  static const api::Limits limits = small_limits();
  const api::UploadedScene scene = api::read_upload("a", bytes, limits);
  check_names(scene);
  const api::UploadedScene again = api::unpacked_upload(api::packed_upload(scene));
  require(again.reply == scene.reply && again.files.size() == scene.files.size(),
          "what is packed is unpacked");
}

// The reader is not trusted either: its answer may be anything.
void read_answer(std::string_view text) { check_names(api::unpacked_upload(text)); }

void read_problem(std::string_view text) {
  const api::Problem problem = api::problem_of_upload(text);
  require(problem.status >= 400 && problem.status < 500, "a reader can only refuse");
}

}  // namespace
}  // namespace fstop::test

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fstop::test;
  Input input(data, size);
  const unsigned kind = input.choice() % 3;
  try {
    if (kind == 0) read_upload(input.bytes());
    if (kind == 1) read_answer(input.text());
    if (kind == 2) read_problem(input.text());
  } catch (const fstop::Error& error) {
    const bool is_ours = error.code() == fstop::ErrorCode::internal;
    require(kind == 0 ? !is_ours : is_ours,
            "an upload is refused, a reader that errs is our fault");
  }
  return 0;
}
