// Image files: PNG, JPEG, EXR, from their first bytes to linear pixels.
#include <cmath>
#include <string>

#include "core/error.h"
#include "core/scene/image_header.h"
#include "core/scene/scene_file.h"
#include "tests/fuzz/fuzz_target.h"

namespace fstop::test {
namespace {

constexpr AssetLimits kLimits{.max_file_bytes = std::size_t{1} << 20,
                              .max_triangles = 1,
                              .max_texture_pixels = std::size_t{1} << 16,
                              .max_coordinate = 1.0};

void check(const Image& image) {
  require(image.width() > 0 && image.height() > 0 && image.channels() == 3, "an image has pixels");
  const auto pixels =
      static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
  require(pixels <= kLimits.max_texture_pixels, "no more than the limit");
  for (const float sample : image.pixels()) require(std::isfinite(sample), "samples are finite");
}

}  // namespace
}  // namespace fstop::test

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fstop::test;
  Input input(data, size);
  const auto space = input.choice() % 2 == 0 ? fstop::ColorSpace::srgb : fstop::ColorSpace::linear;
  try {
    check(fstop::decode_texture("image", input.bytes(), space, kLimits));
  } catch (const fstop::Error& error) {
    require(error.code() == fstop::ErrorCode::bad_image, "an image is refused as one");
  }
  return 0;
}
