#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "core/encode/image_codec.h"
#include "core/error.h"

namespace fstop {
namespace {

// Two gigabytes of float: the largest image fstop renders, with all its layers, stays below.
constexpr std::uint64_t kMaxSamples = std::uint64_t{1} << 29;

bool starts_with(std::span<const std::byte> bytes, std::size_t offset, std::string_view text) {
  return bytes.size() >= offset + text.size() &&
         std::equal(text.begin(), text.end(), bytes.begin() + static_cast<std::ptrdiff_t>(offset),
                    [](char c, std::byte b) { return std::byte(c) == b; });
}

std::optional<ImageFormat> format_of(std::span<const std::byte> bytes) {
  using namespace std::string_view_literals;
  if (starts_with(bytes, 0, "\x89PNG\r\n\x1a\n"sv)) return ImageFormat::png;
  if (starts_with(bytes, 0, "\xff\xd8\xff"sv)) return ImageFormat::jpeg;
  if (starts_with(bytes, 0, "RIFF"sv) && starts_with(bytes, 8, "WEBP"sv)) return ImageFormat::webp;
  for (const std::string_view magic : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv}) {
    if (starts_with(bytes, 0, magic)) return ImageFormat::tiff;
  }
  if (starts_with(bytes, 0, "\x76\x2f\x31\x01"sv)) return ImageFormat::exr;
  return std::nullopt;
}

[[noreturn]] void refuse(const std::string& reason) { throw Error(ErrorCode::bad_image, reason); }

// OpenImageIO leaks where libpng jumps out of it at the end of the bytes.
bool has_all_png_chunks(std::span<const std::byte> bytes) {
  for (std::size_t at = 8; bytes.size() - at >= 12;) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      length = length << 8U | std::to_integer<std::size_t>(bytes[at + i]);
    }
    if (length > bytes.size() - at - 12) return false;
    if (starts_with(bytes, at + 4, "IEND")) return true;
    at += length + 12;
  }
  return false;
}

// "N" of "N.X"; the colour channels of a file share the empty stem; others are their own.
std::string stem_of(const std::string& channel) {
  if (const std::size_t dot = channel.rfind('.'); dot != std::string::npos) {
    return channel.substr(0, dot);
  }
  constexpr std::array kColor = {"R", "G", "B", "A", "Y"};
  const bool color = std::find(kColor.begin(), kColor.end(), channel) != kColor.end();
  return color ? "" : channel + '.';
}

std::string own_name(const std::string& name) {  // OpenImageIO renames two of OpenEXR's
  if (name == "FNumber") return "aperture";
  if (name == "ExposureTime") return "expTime";
  return name;
}

std::vector<ImageAttribute> exr_attributes(const OIIO::ImageSpec& spec) {
  constexpr std::array kOfTheFile = {"compression", "DateTime", "PixelAspectRatio",
                                     "screenWindowWidth"};
  std::vector<ImageAttribute> attributes;
  for (const OIIO::ParamValue& param : spec.extra_attribs) {
    const std::string name = param.name().string();
    if (std::find(kOfTheFile.begin(), kOfTheFile.end(), name) != kOfTheFile.end() ||
        name.starts_with("oiio:") || name.starts_with("openexr:")) {
      continue;
    }
    if (param.type() == OIIO::TypeDesc::STRING) {
      attributes.push_back({own_name(name), param.get_string()});
    } else if (param.type() == OIIO::TypeDesc::INT) {
      attributes.push_back({own_name(name), param.get<int>()});
    } else if (param.type() == OIIO::TypeDesc::FLOAT) {
      attributes.push_back({own_name(name), double{param.get<float>()}});
    } else if (param.type() == OIIO::TypeDesc::DOUBLE) {
      attributes.push_back({own_name(name), param.get<double>()});
    }
  }
  return attributes;
}

template <typename Number>
std::optional<Number> whole_number(std::string_view text) {
  Number value = {};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// The `name=value` lines that encode wrote.
std::vector<ImageAttribute> tiff_attributes(std::string_view description) {
  std::vector<ImageAttribute> attributes;
  while (!description.empty()) {
    const std::size_t end = std::min(description.find('\n'), description.size());
    const std::string_view line = description.substr(0, end);
    description.remove_prefix(std::min(end + 1, description.size()));
    const std::size_t sign = line.find('=');
    if (sign == std::string_view::npos) continue;
    const std::string name(line.substr(0, sign));
    const std::string_view value = line.substr(sign + 1);
    if (const auto integer = whole_number<int>(value)) {
      attributes.push_back({name, *integer});
    } else if (const auto number = whole_number<double>(value)) {
      attributes.push_back({name, *number});
    } else {
      attributes.push_back({name, std::string(value)});
    }
  }
  return attributes;
}

// Neighbours of one stem make a layer: OpenImageIO hands out the channels of a stem together.
void read_layers(OIIO::ImageInput& input, const OIIO::ImageSpec& spec, Picture& picture) {
  const std::vector<std::string>& channels = spec.channelnames;
  for (std::size_t begin = 0, end = 0; begin < channels.size(); begin = end) {
    const std::string stem = stem_of(channels[begin]);
    for (end = begin + 1; end < channels.size() && stem_of(channels[end]) == stem; ++end) {
    }
    ImageLayer layer{.channel_names = {channels.data() + begin, channels.data() + end},
                     .image = Image(spec.width, spec.height, static_cast<int>(end - begin))};
    if (!input.read_image(0, 0, static_cast<int>(begin), static_cast<int>(end),
                          OIIO::TypeDesc::FLOAT, layer.image.pixels().data())) {
      input.geterror();  // taken, or it would be printed
      refuse("the image's data are damaged or truncated");
    }
    picture.layers.push_back(std::move(layer));
  }
}

}  // namespace

Picture decode(std::span<const std::byte> bytes) {
  const std::optional<ImageFormat> format = format_of(bytes);
  if (!format) refuse("the bytes are no PNG, JPEG, WebP, TIFF or EXR file");
  if (*format == ImageFormat::png && !has_all_png_chunks(bytes)) refuse("the PNG is truncated");
  OIIO::attribute("exr_threads", -1);  // OpenEXR's pool stays out of it
  // The reader of this format alone: left to itself, OpenImageIO tries them all.
  const std::string name(format_name(*format));
  OIIO::Filesystem::IOMemReader memory(bytes.data(), bytes.size());
  const auto input = OIIO::ImageInput::create(name, false);
  if (input == nullptr) throw Error(ErrorCode::io_failure, OIIO::geterror());
  input->threads(1);
  OIIO::ImageSpec spec;
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);  // colours as they are stored
  if (!input->set_ioproxy(&memory) || !input->open("memory." + name, spec, config)) {
    input->geterror();
    refuse("the image's header is damaged or truncated");
  }
  const std::uint64_t pixels = std::uint64_t{static_cast<std::uint32_t>(spec.width)} *
                               static_cast<std::uint32_t>(spec.height);
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.deep || spec.nchannels < 1 ||
      pixels > kMaxSamples / static_cast<std::uint64_t>(spec.nchannels)) {
    refuse("the image is empty, deep or too large");
  }
  Picture picture;
  read_layers(*input, spec, picture);
  if (*format == ImageFormat::exr) picture.attributes = exr_attributes(spec);
  if (*format == ImageFormat::tiff) {
    picture.attributes = tiff_attributes(spec.get_string_attribute("ImageDescription"));
  }
  return picture;
}

}  // namespace fstop
