#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "core/scene/image_header.h"
#include "core/scene/scene_file.h"

namespace fstop {
namespace {

// OpenImageIO's reader of one format, on memory.
class MemoryReader {
 public:
  MemoryReader(const std::string& name, TextureFormat format, std::span<const std::byte> bytes)
      : name_(name), memory_(bytes.data(), bytes.size()) {
    OIIO::attribute("exr_threads", -1);  // OpenEXR's pool would ignore the limits of fstop's
    const char* reader = format == TextureFormat::png    ? "png"
                         : format == TextureFormat::jpeg ? "jpeg"
                                                         : "openexr";
    // This reader alone: left to itself, OpenImageIO tries them all. PNG's colours are not to be
    // multiplied with their alpha, which is dropped.
    input_ = OIIO::ImageInput::create(reader, false);
    if (input_ == nullptr) fail();
    input_->threads(1);
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    if (!input_->set_ioproxy(&memory_) || !input_->open("memory", spec_, config)) fail();
  }

  const OIIO::ImageSpec& spec() const { return spec_; }

  /// Samples of channels [begin, end), row by row.
  template <typename Sample>
  void read(int begin, int end, OIIO::TypeDesc type, std::vector<Sample>& samples) {
    const auto pixels =
        static_cast<std::size_t>(spec_.width) * static_cast<std::size_t>(spec_.height);
    samples.resize(pixels * static_cast<std::size_t>(end - begin));
    if (!input_->read_image(0, 0, begin, end, type, samples.data())) fail();
  }

 private:
  [[noreturn]] void fail() const {
    if (input_ != nullptr) input_->geterror();  // taken, or it would be printed
    OIIO::geterror();
    refuse_image(name_, "is damaged or truncated");
  }

  const std::string& name_;
  OIIO::Filesystem::IOMemReader memory_;
  OIIO::ImageSpec spec_;
  std::unique_ptr<OIIO::ImageInput> input_;  // after the memory: it is destroyed first
};

// The linear value of every code of an unsigned integer type: c/max, by IEC 61966-2-1 if sRGB.
template <typename Code>
std::vector<float> linear_values(ColorSpace color_space) {
  constexpr std::size_t kMax = std::numeric_limits<Code>::max();
  std::vector<float> values(kMax + 1);
  for (std::size_t code = 0; code <= kMax; ++code) {
    const double encoded = static_cast<double>(code) / static_cast<double>(kMax);
    double linear = encoded;
    if (color_space == ColorSpace::srgb) {
      linear = encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
    }
    values[code] = static_cast<float>(linear);
  }
  return values;
}

// Grey and RGB, with or without alpha.
template <typename Code>
Image decoded_codes(MemoryReader& reader, ColorSpace color_space, OIIO::TypeDesc type) {
  const std::vector<float> linear = linear_values<Code>(color_space);
  const int channels = reader.spec().nchannels >= 3 ? 3 : 1;
  std::vector<Code> codes;
  reader.read(0, channels, type, codes);
  Image image(reader.spec().width, reader.spec().height, 3);
  float* to = image.pixels().data();
  const auto step = static_cast<std::size_t>(channels);
  for (std::size_t i = 0; i < codes.size(); i += step, to += 3) {
    for (std::size_t c = 0; c < 3; ++c) to[c] = linear[codes[i + (step == 3 ? c : 0)]];
  }
  return image;
}

// Where R, G, B stand, or three times the only channel of colour, Y.
std::array<int, 3> color_channels(const std::string& name, const OIIO::ImageSpec& spec) {
  const auto find = [&](const char* channel) {
    const auto& names = spec.channelnames;
    return static_cast<int>(std::find(names.begin(), names.end(), channel) - names.begin());
  };
  const std::array<int, 3> rgb = {find("R"), find("G"), find("B")};
  if (*std::max_element(rgb.begin(), rgb.end()) < spec.nchannels) return rgb;
  const int grey = spec.nchannels == 1 ? 0 : find("Y");
  if (grey == spec.nchannels) refuse_image(name, "has neither R, G, B nor Y channels");
  return {grey, grey, grey};
}

Image decoded_exr(const std::string& name, MemoryReader& reader) {
  const std::array<int, 3> channels = color_channels(name, reader.spec());
  Image image(reader.spec().width, reader.spec().height, 3);
  if (channels[1] == channels[0] + 1 && channels[2] == channels[0] + 2) {
    reader.read(channels[0], channels[0] + 3, OIIO::TypeDesc::FLOAT, image.pixels());
  } else {
    std::vector<float> plane;
    for (std::size_t c = 0; c < 3; ++c) {
      if (c == 0 || channels[c] != channels[c - 1]) {
        reader.read(channels[c], channels[c] + 1, OIIO::TypeDesc::FLOAT, plane);
      }
      for (std::size_t i = 0; i < plane.size(); ++i) image.pixels()[3 * i + c] = plane[i];
    }
  }
  for (std::size_t i = 0; i < image.pixels().size(); ++i) {
    if (!std::isfinite(image.pixels()[i])) {
      const auto pixel = i / 3;
      const auto width = static_cast<std::size_t>(image.width());
      refuse_image(name, "is not finite at column " + std::to_string(pixel % width) + ", row " +
                             std::to_string(pixel / width));
    }
  }
  return image;
}

ImageHeader checked_header(const std::string& name, std::span<const std::byte> bytes,
                           const AssetLimits& limits) {
  if (bytes.size() > limits.max_file_bytes) {
    refuse_image(name, "more than " + std::to_string(limits.max_file_bytes) + " bytes");
  }
  return image_header(name, bytes, limits.max_texture_pixels);
}

void require_size(const std::string& name, const ImageHeader& header, const OIIO::ImageSpec& spec) {
  if (spec.width != header.width || spec.height != header.height || spec.depth > 1 || spec.deep ||
      spec.nchannels < 1) {
    refuse_image(name, "is damaged: its decoder finds another size than its header");
  }
}

// None: -1. Grey with alpha and RGB with alpha have it last.
int alpha_channel(const ImageHeader& header, const OIIO::ImageSpec& spec) {
  if (header.format == TextureFormat::exr) {
    const auto& names = spec.channelnames;
    const auto found = std::find(names.begin(), names.end(), "A");
    return found == names.end() ? -1 : static_cast<int>(found - names.begin());
  }
  return spec.nchannels == 2 || spec.nchannels == 4 ? spec.nchannels - 1 : -1;
}

}  // namespace

Image decode_alpha(const std::string& name, std::span<const std::byte> bytes,
                   const AssetLimits& limits) {
  const ImageHeader header = checked_header(name, bytes, limits);
  if (header.format == TextureFormat::jpeg) return {};
  const std::vector<std::byte> pixels = without_metadata(header, bytes);
  MemoryReader reader(name, header.format, pixels);
  require_size(name, header, reader.spec());
  const int channel = alpha_channel(header, reader.spec());
  if (channel < 0) return {};
  Image alpha(header.width, header.height, 1);
  reader.read(channel, channel + 1, OIIO::TypeDesc::FLOAT, alpha.pixels());
  const bool is_finite = std::all_of(alpha.pixels().begin(), alpha.pixels().end(),
                                     [](float a) { return std::isfinite(a); });
  if (!is_finite) refuse_image(name, "has an alpha that is not finite");
  return alpha;
}

Image decode_texture(const std::string& name, std::span<const std::byte> bytes,
                     ColorSpace color_space, const AssetLimits& limits) {
  const ImageHeader header = checked_header(name, bytes, limits);
  const std::vector<std::byte> pixels = without_metadata(header, bytes);
  MemoryReader reader(name, header.format, pixels);
  const OIIO::ImageSpec& spec = reader.spec();
  require_size(name, header, spec);
  if (header.format == TextureFormat::exr) return decoded_exr(name, reader);
  if (spec.format == OIIO::TypeDesc::UINT16) {
    return decoded_codes<std::uint16_t>(reader, color_space, OIIO::TypeDesc::UINT16);
  }
  return decoded_codes<std::uint8_t>(reader, color_space, OIIO::TypeDesc::UINT8);
}

}  // namespace fstop
