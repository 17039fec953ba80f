#include "core/encode/image_codec.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <limits>
#include <memory>
#include <set>
#include <type_traits>
#include <utility>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <webp/encode.h>

#include "core/encode/srgb.h"
#include "core/error.h"

namespace fstop {
namespace {

// EXR (capDate) and TIFF files must say when they were made. Bytes that depend on the clock
// cannot be cached or compared, so they all say the same.
constexpr const char* kFixedDate = "1970:01:01 00:00:00";
constexpr int kMaxJpegSide = 65'500;  // JPEG_MAX_DIMENSION of libjpeg
constexpr int kMaxWebpSide = 16'383;  // WEBP_MAX_DIMENSION of libwebp

// One thread each: fstop runs several encoders beside its renders, and OpenEXR's own pool would
// ignore the limits of both. These two are process-wide settings of OpenImageIO.
void use_one_thread() {
  [[maybe_unused]] static const bool kDone =
      OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1);
}

const Image& checked_first_image(const Picture& picture) {
  if (picture.layers.empty() || picture.layers.front().image.empty()) {
    throw Error(ErrorCode::internal, "a picture needs pixels");
  }
  const Image& first = picture.layers.front().image;
  std::set<std::string> names;
  for (const ImageLayer& layer : picture.layers) {
    if (layer.image.width() != first.width() || layer.image.height() != first.height()) {
      throw Error(ErrorCode::internal, "the layers of a picture differ in size");
    }
    if (layer.channel_names.size() != static_cast<std::size_t>(layer.image.channels())) {
      throw Error(ErrorCode::internal, "a layer needs one name for each channel");
    }
    for (const std::string& name : layer.channel_names) {
      if (name.empty() || !names.insert(name).second) {
        throw Error(ErrorCode::internal, "the channel name '" + name + "' is empty or used twice");
      }
    }
  }
  return first;
}

void require_srgb_image(const Image& image, ImageFormat format, int max_side) {
  const std::string name(format_name(format));
  const bool has_alpha = image.channels() == 4 && format != ImageFormat::jpeg;
  if (image.channels() != 1 && image.channels() != 3 && !has_alpha) {
    throw Error(ErrorCode::unsupported,
                name +
                    (format == ImageFormat::jpeg ? " holds 1 or 3 channels, not "
                                                 : " holds 1, 3 or 4 channels, not ") +
                    std::to_string(image.channels()));
  }
  if (std::max(image.width(), image.height()) > max_side) {
    throw Error(ErrorCode::unsupported, name + " holds at most " + std::to_string(max_side) +
                                            " pixels a side, not " + std::to_string(image.width()) +
                                            " x " + std::to_string(image.height()));
  }
}

[[noreturn]] void fail(ImageFormat format, const std::string& reason) {
  throw Error(ErrorCode::io_failure, "the " + std::string(format_name(format)) + " encoder failed" +
                                         (reason.empty() ? "" : ": " + reason));
}

std::vector<std::byte> as_bytes(const std::vector<unsigned char>& buffer) {
  const auto* data = reinterpret_cast<const std::byte*>(buffer.data());
  return {data, data + buffer.size()};
}

// OpenImageIO's writer of one format, bound to a buffer. Never given a file: on a full disk its
// JPEG path ends the process.
class MemoryWriter {
 public:
  MemoryWriter(ImageFormat format, const OIIO::ImageSpec& spec) : format_(format) {
    use_one_thread();
    const std::string name(format_name(format));
    output_ = OIIO::ImageOutput::create(name);
    if (output_ == nullptr) fail(format_, OIIO::geterror());
    output_->threads(1);
    if (!output_->set_ioproxy(&buffer_) || !output_->open("memory." + name, spec)) {
      fail(format_, output_->geterror());
    }
  }

  void write_image(const std::uint8_t* samples) {
    if (!output_->write_image(OIIO::TypeDesc::UINT8, samples)) fail(format_, output_->geterror());
  }
  void write_rows(int begin, int end, const float* samples) {
    if (!output_->write_scanlines(begin, end, 0, OIIO::TypeDesc::FLOAT, samples)) {
      fail(format_, output_->geterror());
    }
  }
  std::vector<std::byte> finish() {
    if (!output_->close()) fail(format_, output_->geterror());
    return as_bytes(buffer_.buffer());
  }

 private:
  ImageFormat format_;
  OIIO::Filesystem::IOVecOutput buffer_;
  std::unique_ptr<OIIO::ImageOutput> output_;  // after the buffer: it is destroyed first
};

std::vector<std::byte> encode_png(const Image& image) {
  OIIO::ImageSpec spec(image.width(), image.height(), image.channels(), OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  spec.attribute("oiio:UnassociatedAlpha", 1);
  // Runs only: of a picture with noise, deflate's search for longer matches at level 6 takes four
  // times as long and gives a larger file (measured: 960 x 640, 29 ms and 0.87 MB against 108 ms
  // and 0.97 MB); without noise the file grows by 7 %.
  spec.attribute("compression", "rle");
  MemoryWriter writer(ImageFormat::png, spec);
  writer.write_image(srgb_bytes(image, image.channels()).data());
  return writer.finish();
}

std::vector<std::byte> encode_jpeg(const Image& image) {
  OIIO::ImageSpec spec(image.width(), image.height(), image.channels(), OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  spec.attribute("compression", "jpeg:92");
  spec.attribute("jpeg:subsampling", "4:4:4");
  MemoryWriter writer(ImageFormat::jpeg, spec);
  writer.write_image(srgb_bytes(image, image.channels()).data());
  return writer.finish();
}

// Straight to libwebp: OpenImageIO 2.4 asks it for the greatest effort, which takes 20 s for the
// 960 x 640 pixels of a noisy picture; level 1 takes 0.07 s for the same size.
std::vector<std::byte> encode_webp(const Image& image) {
  constexpr int kEffort = 1;  // of 0 to 9
  const bool has_alpha = image.channels() == 4;
  const int channels = has_alpha ? 4 : 3;
  const std::vector<std::uint8_t> samples = srgb_bytes(image, channels);
  const auto import = has_alpha ? WebPPictureImportRGBA : WebPPictureImportRGB;
  WebPConfig config;
  WebPPicture webp;
  if (WebPConfigInit(&config) == 0 || WebPConfigLosslessPreset(&config, kEffort) == 0 ||
      WebPPictureInit(&webp) == 0) {
    fail(ImageFormat::webp, "");
  }
  const std::unique_ptr<WebPPicture, void (*)(WebPPicture*)> picture_owner(&webp, WebPPictureFree);
  WebPMemoryWriter buffer;
  WebPMemoryWriterInit(&buffer);
  const std::unique_ptr<WebPMemoryWriter, void (*)(WebPMemoryWriter*)> buffer_owner(
      &buffer, WebPMemoryWriterClear);
  webp.use_argb = 1;
  webp.width = image.width();
  webp.height = image.height();
  webp.writer = WebPMemoryWrite;
  webp.custom_ptr = &buffer;
  if (import(&webp, samples.data(), channels * image.width()) == 0 ||
      WebPEncode(&config, &webp) == 0) {
    fail(ImageFormat::webp, "code " + std::to_string(webp.error_code));
  }
  const auto* data = reinterpret_cast<const std::byte*>(buffer.mem);
  return {data, data + buffer.size};
}

bool is_color(const std::string& channel) {
  return channel == "R" || channel == "G" || channel == "B";
}

bool is_color(const ImageLayer& layer) {
  return std::all_of(layer.channel_names.begin(), layer.channel_names.end(),
                     [](const std::string& name) { return is_color(name); });
}

// Numbers that OpenEXR (3.1 and later) defines as float: a reader that asks for one of another
// type is answered by an exception.
bool is_float_by_definition(const std::string& name) {
  static constexpr std::array kNames = {"aperture",
                                        "focus",
                                        "expTime",
                                        "isoSpeed",
                                        "nominalFocalLength",
                                        "effectiveFocalLength",
                                        "pinholeFocalLength",
                                        "entrancePupilOffset",
                                        "sensorPhotositePitch",
                                        "tStop",
                                        "shutterAngle",
                                        "utcOffset",
                                        "altitude",
                                        "longitude",
                                        "latitude"};
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end();
}

void add_exr_attribute(OIIO::ImageSpec& spec, const ImageAttribute& attribute) {
  if (const auto* text = std::get_if<std::string>(&attribute.value)) {
    spec.attribute(attribute.name, *text);
  } else if (const auto* integer = std::get_if<int>(&attribute.value)) {
    spec.attribute(attribute.name, *integer);
  } else {
    const double number = std::get<double>(attribute.value);
    if (is_float_by_definition(attribute.name)) {
      spec.attribute(attribute.name, static_cast<float>(number));
    } else {
      spec.attribute(attribute.name, OIIO::TypeDesc(OIIO::TypeDesc::DOUBLE), &number);
    }
  }
}

template <typename Number>
std::string shortest_text(Number value) {
  std::array<char, 32> text = {};  // the longest double takes 24
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string description_of(const std::vector<ImageAttribute>& attributes) {
  std::string lines;
  for (const auto& [name, value] : attributes) {
    lines += name + '=';
    std::visit(
        [&](const auto& v) {
          if constexpr (std::is_same_v<std::decay_t<decltype(v)>, std::string>) {
            lines += v;
          } else {
            lines += shortest_text(v);
          }
        },
        value);
    lines += '\n';
  }
  return lines;
}

// Rows begin to end of all layers, channels side by side.
void interleave(std::span<const ImageLayer> layers, int begin, int end, std::size_t channels,
                std::vector<float>& rows) {
  std::size_t first = 0;
  for (const ImageLayer& layer : layers) {
    const auto count = static_cast<std::size_t>(layer.image.channels());
    const float* from = layer.image.at(0, begin);
    float* to = rows.data() + first;
    const auto pixels =
        static_cast<std::size_t>(layer.image.width()) * static_cast<std::size_t>(end - begin);
    for (std::size_t i = 0; i < pixels; ++i, from += count, to += channels) {
      std::copy_n(from, count, to);
    }
    first += count;
  }
}

std::vector<std::byte> encode_float(std::span<const ImageLayer> layers, ImageFormat format,
                                    const OIIO::ImageSpec& spec) {
  constexpr int kRows = 64;  // at a time: a multiple of the 16 rows of an EXR ZIP block
  const auto channels = static_cast<std::size_t>(spec.nchannels);
  std::vector<float> rows(static_cast<std::size_t>(spec.width) *
                          static_cast<std::size_t>(std::min(kRows, spec.height)) * channels);
  MemoryWriter writer(format, spec);
  for (int begin = 0; begin < spec.height; begin += kRows) {
    const int end = std::min(begin + kRows, spec.height);
    interleave(layers, begin, end, channels, rows);
    writer.write_rows(begin, end, rows.data());
  }
  return writer.finish();
}

std::vector<std::byte> encode_tiff(const Picture& picture, Precision precision) {
  const ImageLayer& layer = picture.layers.front();
  OIIO::ImageSpec spec(layer.image.width(), layer.image.height(), layer.image.channels(),
                       OIIO::TypeDesc::FLOAT);
  if (precision == Precision::half && is_color(layer)) {
    spec.set_format(OIIO::TypeDesc::HALF);
    spec.attribute("tiff:half", 1);
  }
  spec.channelnames = layer.channel_names;
  if (layer.image.channels() == 4) {
    spec.alpha_channel = 3;
    spec.attribute("oiio:UnassociatedAlpha", 1);
  }
  spec.attribute("compression", "zip");
  spec.attribute("oiio:ColorSpace", "Linear");
  spec.attribute("DateTime", kFixedDate);
  spec.attribute("Software", "fstop");
  if (!picture.attributes.empty()) {
    spec.attribute("ImageDescription", description_of(picture.attributes));
  }
  return encode_float({&layer, 1}, ImageFormat::tiff, spec);
}

std::vector<std::byte> encode_exr(const Picture& picture, Precision precision) {
  const Image& first = picture.layers.front().image;
  std::vector<std::string> names;
  std::vector<OIIO::TypeDesc> types;
  for (const ImageLayer& layer : picture.layers) {
    for (const std::string& name : layer.channel_names) {
      const bool narrow = precision == Precision::half && is_color(name);
      names.push_back(name);
      types.emplace_back(narrow ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT);
    }
  }
  OIIO::ImageSpec spec(first.width(), first.height(), static_cast<int>(names.size()),
                       OIIO::TypeDesc::FLOAT);
  if (precision == Precision::half) spec.channelformats = std::move(types);
  spec.channelnames = std::move(names);
  for (const ImageAttribute& attribute : picture.attributes) add_exr_attribute(spec, attribute);
  spec.attribute("compression", "zip");
  spec.attribute("oiio:ColorSpace", "Linear");
  spec.attribute("DateTime", kFixedDate);
  return encode_float(picture.layers, ImageFormat::exr, spec);
}

}  // namespace

std::vector<std::byte> encode(const Picture& picture, ImageFormat format, Precision precision) {
  const Image& first = checked_first_image(picture);
  switch (format) {
    case ImageFormat::png:
      require_srgb_image(first, format, std::numeric_limits<int>::max());
      return encode_png(first);
    case ImageFormat::jpeg:
      require_srgb_image(first, format, kMaxJpegSide);
      return encode_jpeg(first);
    case ImageFormat::webp:
      require_srgb_image(first, format, kMaxWebpSide);
      return encode_webp(first);
    case ImageFormat::tiff:
      return encode_tiff(picture, precision);
    case ImageFormat::exr:
      return encode_exr(picture, precision);
  }
  throw Error(ErrorCode::internal, "no such image format");
}

std::string_view media_type(ImageFormat format) {
  switch (format) {
    case ImageFormat::png:
      return "image/png";
    case ImageFormat::jpeg:
      return "image/jpeg";
    case ImageFormat::webp:
      return "image/webp";
    case ImageFormat::tiff:
      return "image/tiff";
    case ImageFormat::exr:
      return "image/x-exr";
  }
  throw Error(ErrorCode::internal, "no such image format");
}

std::string_view format_name(ImageFormat format) {
  switch (format) {
    case ImageFormat::png:
      return "png";
    case ImageFormat::jpeg:
      return "jpeg";
    case ImageFormat::webp:
      return "webp";
    case ImageFormat::tiff:
      return "tiff";
    case ImageFormat::exr:
      return "exr";
  }
  throw Error(ErrorCode::internal, "no such image format");
}

}  // namespace fstop
