#include "core/scene/image_header.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "core/error.h"

namespace fstop {
namespace {

using Bytes = std::span<const std::byte>;
using std::string_view_literals::operator""sv;

constexpr std::string_view kPngMagic = "\x89PNG\r\n\x1a\n"sv;
constexpr std::string_view kJpegMagic = "\xff\xd8\xff"sv;
constexpr std::string_view kExrMagic = "\x76\x2f\x31\x01"sv;

std::uint8_t byte_at(Bytes bytes, std::size_t at) {
  return std::to_integer<std::uint8_t>(bytes[at]);
}

std::uint32_t big_endian(Bytes bytes, std::size_t at, std::size_t size) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value = value << 8U | byte_at(bytes, at + i);
  return value;
}

std::uint32_t little_endian_32(Bytes bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8U | byte_at(bytes, at + i);
  return value;
}

std::string_view text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

ImageHeader checked(const std::string& name, TextureFormat format, std::int64_t width,
                    std::int64_t height, std::size_t max_pixels) {
  constexpr std::int64_t kMaxSide = 65'536;
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide ||
      static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) > max_pixels) {
    refuse_image(name, "measures " + std::to_string(width) + " x " + std::to_string(height) +
                           "; the limits are " + std::to_string(max_pixels) + " pixels and " +
                           std::to_string(kMaxSide) + " a side");
  }
  return {format, static_cast<int>(width), static_cast<int>(height)};
}

// CRC-32 as PNG has it (ISO 3309): polynomial 0xedb88320, bits reversed.
std::uint32_t checksum(Bytes bytes) {
  static constexpr auto kTable = [] {
    std::array<std::uint32_t, 256> table = {};
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t c = i;
      for (int bit = 0; bit < 8; ++bit) c = (c >> 1U) ^ ((c & 1U) != 0 ? 0xedb88320U : 0U);
      table[i] = c;
    }
    return table;
  }();
  std::uint32_t c = 0xffffffffU;
  for (const std::byte b : bytes)
    c = kTable[(c ^ std::to_integer<std::uint32_t>(b)) & 255U] ^ c >> 8U;
  return ~c;
}

// A chunk is its length, its type of four letters, its data and a checksum of type and data.
struct PngChunk {
  std::string_view type = {};
  Bytes whole = {};
};

// The chunk at `at`, or none if the file ends before it does.
std::optional<PngChunk> png_chunk(Bytes bytes, std::size_t at) {
  if (bytes.size() - at < 12) return std::nullopt;
  const std::size_t length = big_endian(bytes, at, 4);
  if (length > bytes.size() - at - 12) return std::nullopt;
  return PngChunk{text_of(bytes.subspan(at + 4, 4)), bytes.subspan(at, length + 12)};
}

ImageHeader png_header(const std::string& name, Bytes bytes, std::size_t max_pixels) {
  std::optional<PngChunk> chunk = png_chunk(bytes, kPngMagic.size());
  if (!chunk || chunk->type != "IHDR" || chunk->whole.size() != 25) {
    refuse_image(name, "is truncated or has no PNG header");
  }
  const ImageHeader header = checked(name, TextureFormat::png, big_endian(chunk->whole, 8, 4),
                                     big_endian(chunk->whole, 12, 4), max_pixels);
  for (std::size_t at = kPngMagic.size(); chunk->type != "IEND"; at += chunk->whole.size()) {
    chunk = png_chunk(bytes, at);
    if (!chunk) refuse_image(name, "is truncated");
    const Bytes covered = chunk->whole.subspan(4, chunk->whole.size() - 8);
    if (checksum(covered) != big_endian(chunk->whole, chunk->whole.size() - 4, 4)) {
      refuse_image(name, "is damaged: a checksum is wrong");
    }
  }
  return header;
}

std::vector<std::byte> png_pixels(Bytes bytes) {
  std::vector<std::byte> kept(bytes.begin(), bytes.begin() + kPngMagic.size());
  std::size_t at = kPngMagic.size();
  for (std::optional<PngChunk> chunk; (chunk = png_chunk(bytes, at)); at += chunk->whole.size()) {
    // Types that begin with a capital are needed for the pixels; so is tRNS, transparency.
    const bool needed = (chunk->type[0] & 0x20) == 0 || chunk->type == "tRNS";
    if (needed) kept.insert(kept.end(), chunk->whole.begin(), chunk->whole.end());
    if (chunk->type == "IEND") break;
  }
  return kept;
}

// A segment is ff, its marker and its length, which counts itself; ff may be repeated.
struct JpegSegment {
  std::uint8_t marker = 0;
  Bytes whole = {};
};

std::optional<JpegSegment> jpeg_segment(Bytes bytes, std::size_t at) {
  while (at + 1 < bytes.size() && byte_at(bytes, at) == 0xff && byte_at(bytes, at + 1) == 0xff)
    ++at;
  if (at + 4 > bytes.size() || byte_at(bytes, at) != 0xff) return std::nullopt;
  const std::size_t length = big_endian(bytes, at + 2, 2) + 2U;
  if (length < 4 || length > bytes.size() - at) return std::nullopt;
  return JpegSegment{byte_at(bytes, at + 1), bytes.subspan(at, length)};
}

constexpr std::uint8_t kStartOfScan = 0xda;

bool is_frame(std::uint8_t marker) {  // SOF0-15, less DHT, JPG and DAC
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

std::size_t end_of(Bytes bytes, const JpegSegment& segment) {
  return static_cast<std::size_t>(segment.whole.data() - bytes.data()) + segment.whole.size();
}

ImageHeader jpeg_header(const std::string& name, Bytes bytes, std::size_t max_pixels) {
  std::optional<ImageHeader> header;
  std::size_t at = 2;
  for (std::optional<JpegSegment> segment; (segment = jpeg_segment(bytes, at));
       at = end_of(bytes, *segment)) {
    if (segment->marker == kStartOfScan) {
      if (header) return *header;
      break;
    }
    if (!is_frame(segment->marker)) continue;
    if (header || segment->whole.size() < 10) refuse_image(name, "its frame header is damaged");
    header = checked(name, TextureFormat::jpeg, big_endian(segment->whole, 7, 2),
                     big_endian(segment->whole, 5, 2), max_pixels);
  }
  refuse_image(name, "is truncated or damaged before its first scan");
}

std::vector<std::byte> jpeg_pixels(Bytes bytes) {
  std::vector<std::byte> kept(bytes.begin(), bytes.begin() + 2);
  std::size_t at = 2;
  for (std::optional<JpegSegment> segment; (segment = jpeg_segment(bytes, at));
       at = end_of(bytes, *segment)) {
    if (segment->marker == kStartOfScan) break;
    // APP1-13, APP15 and comments; APP0 (JFIF) and APP14 (Adobe) say how colour is stored.
    const std::uint8_t marker = segment->marker;
    const bool metadata = (marker > 0xe0 && marker <= 0xef && marker != 0xee) || marker == 0xfe;
    if (!metadata) kept.insert(kept.end(), segment->whole.begin(), segment->whole.end());
  }
  kept.insert(kept.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end());
  return kept;
}

// Reads attributes of the form: name, 0, type, 0, size in 4 bytes, value.
class ExrHeaderReader {
 public:
  ExrHeaderReader(const std::string& name, Bytes bytes) : name_(name), bytes_(bytes) {}

  ImageHeader read(std::size_t max_pixels) {
    if (bytes_.size() < 9) refuse_image(name_, "is truncated");
    // Version 2; of the flags only 0x200 (one tiled part) and 0x400 (long names) are plain images.
    const std::uint32_t version = little_endian_32(bytes_, 4);
    if ((version & ~0x600U) != 2) refuse_image(name_, "is a deep or multi-part EXR file");
    std::optional<ImageHeader> header;
    for (at_ = 8; next_byte() != 0;) {
      const std::string_view attribute = text();
      text();  // its type
      const Bytes value = value_bytes();
      if (attribute == "dataWindow" && value.size() == 16) {
        header = checked(name_, TextureFormat::exr, extent(value, 0), extent(value, 4), max_pixels);
      } else if (attribute == "channels") {
        channels_ = std::max(channels_, channels_in(value));
      } else if (attribute == "compression" && value.size() == 1) {
        rows_ = std::max(rows_, rows_of_block(byte_at(value, 0)));
      } else if (attribute == "tiles" && value.size() == 9) {
        tile_ = {little_endian_32(value, 0), little_endian_32(value, 4)};
      }
    }
    if (!header || channels_ == 0) refuse_image(name_, "its EXR header is incomplete");
    check_blocks(*header);
    return *header;
  }

 private:
  static constexpr std::size_t kMaxText = 255;

  std::uint8_t next_byte() const {
    if (at_ >= bytes_.size()) refuse_image(name_, "is truncated");
    return byte_at(bytes_, at_);
  }
  std::string_view text() {
    const std::string_view rest = text_of(bytes_.subspan(at_));
    const std::size_t end = rest.substr(0, kMaxText + 1).find('\0');
    if (end == std::string_view::npos) refuse_image(name_, "its EXR header is damaged");
    at_ += end + 1;
    return rest.substr(0, end);
  }
  Bytes value_bytes() {
    if (bytes_.size() - at_ < 4) refuse_image(name_, "is truncated");
    const std::size_t size = little_endian_32(bytes_, at_);
    at_ += 4;
    if (size > bytes_.size() - at_) refuse_image(name_, "is truncated");
    at_ += size;
    return bytes_.subspan(at_ - size, size);
  }

  // min and max, both inclusive, 8 bytes apart
  static std::int64_t extent(Bytes box, std::size_t at) {
    const auto low = static_cast<std::int32_t>(little_endian_32(box, at));
    const auto high = static_cast<std::int32_t>(little_endian_32(box, at + 8));
    return std::int64_t{high} - low + 1;
  }

  // name, 0 and 16 bytes for each, then 0
  static std::size_t channels_in(Bytes list) {
    std::size_t count = 0;
    const std::string_view text = text_of(list);
    for (std::size_t at = 0; at < list.size() && byte_at(list, at) != 0; ++count) {
      at = std::min(text.find('\0', at), list.size()) + 17;
    }
    return count;
  }

  // none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB
  std::size_t rows_of_block(std::uint8_t compression) const {
    static constexpr std::array<std::size_t, 10> kRows = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
    if (compression >= kRows.size()) refuse_image(name_, "its EXR compression is unknown");
    return kRows[compression];
  }

  // OpenEXR takes memory for a block of whole rows, or for a tile, whatever the file's length, and
  // for a table with an entry of 8 bytes for each.
  void check_blocks(const ImageHeader& header) const {
    constexpr std::uint64_t kMaxBlockBytes = std::uint64_t{1} << 28U;
    constexpr std::uint32_t kMinTileSide = 16;
    const auto height = static_cast<std::size_t>(header.height);
    const bool tiled = (little_endian_32(bytes_, 4) & 0x200U) != 0;
    if (tiled && std::min(tile_[0], tile_[1]) < kMinTileSide) {
      refuse_image(name_, "its EXR tiles are missing or too small");
    }
    const std::uint64_t samples = (tiled ? std::uint64_t{tile_[0]} * tile_[1]
                                         : static_cast<std::uint64_t>(header.width) * rows_);
    if (samples > kMaxBlockBytes / (sizeof(float) * channels_)) {
      refuse_image(name_, "its EXR blocks or tiles are too large");
    }
    if (bytes_.size() - at_ < (tiled ? 8 : 8 * ((height + rows_ - 1) / rows_))) {
      refuse_image(name_, "is truncated");
    }
  }

  const std::string& name_;
  Bytes bytes_;
  std::size_t at_ = 0;
  std::size_t channels_ = 0;
  std::size_t rows_ = 1;  // of a block
  std::array<std::uint32_t, 2> tile_ = {};
};

}  // namespace

void refuse_image(const std::string& name, const std::string& reason) {
  throw Error(ErrorCode::bad_image, name + ": " + reason);
}

ImageHeader image_header(const std::string& name, Bytes bytes, std::size_t max_pixels) {
  const std::string_view start = text_of(bytes.first(std::min<std::size_t>(bytes.size(), 8)));
  if (start.starts_with(kPngMagic)) return png_header(name, bytes, max_pixels);
  if (start.starts_with(kJpegMagic)) return jpeg_header(name, bytes, max_pixels);
  if (start.starts_with(kExrMagic)) return ExrHeaderReader(name, bytes).read(max_pixels);
  refuse_image(name, "is no PNG, JPEG or EXR file");
}

std::vector<std::byte> without_metadata(const ImageHeader& header, Bytes bytes) {
  switch (header.format) {
    case TextureFormat::png:
      return png_pixels(bytes);
    case TextureFormat::jpeg:
      return jpeg_pixels(bytes);
    case TextureFormat::exr:
      break;
  }
  return {bytes.begin(), bytes.end()};
}

}  // namespace fstop
