#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// Files for the loaders' tests, put together byte by byte from the formats' specifications, so
// that no library decides what is right.
namespace fstop::handmade {

using Bytes = std::vector<std::byte>;

inline Bytes bytes_of(std::string_view text) {
  const auto* data = reinterpret_cast<const std::byte*>(text.data());
  return {data, data + text.size()};
}

/// Appends whole values in one byte order.
class Writer {
 public:
  explicit Writer(bool big_endian = false) : big_endian_(big_endian) {}

  Writer& text(std::string_view text) {
    for (const char c : text) bytes_.push_back(std::byte(c));
    return *this;
  }
  template <typename T>
  Writer& put(T value) {
    const auto raw = std::bit_cast<std::array<std::byte, sizeof(T)>>(value);
    const bool turned = big_endian_ == (std::endian::native == std::endian::little);
    if (turned) {
      bytes_.insert(bytes_.end(), raw.rbegin(), raw.rend());
    } else {
      bytes_.insert(bytes_.end(), raw.begin(), raw.end());
    }
    return *this;
  }
  template <typename T>
  Writer& put_all(const std::vector<T>& values) {
    for (const T value : values) put(value);
    return *this;
  }
  Writer& append(std::span<const std::byte> more) {
    bytes_.insert(bytes_.end(), more.begin(), more.end());
    return *this;
  }
  const Bytes& bytes() const { return bytes_; }
  std::size_t size() const { return bytes_.size(); }

 private:
  bool big_endian_;
  Bytes bytes_ = {};
};

inline std::uint32_t crc32(std::span<const std::byte> bytes) {  // bit by bit, PNG annex D
  std::uint32_t c = 0xffffffffU;
  for (const std::byte b : bytes) {
    c ^= std::to_integer<std::uint32_t>(b);
    for (int bit = 0; bit < 8; ++bit) c = (c & 1U) != 0 ? 0xedb88320U ^ c >> 1U : c >> 1U;
  }
  return ~c;
}

inline void add_png_chunk(Writer& png, std::string_view type, std::span<const std::byte> data) {
  Writer covered(true);
  covered.text(type).append(data);
  png.put(static_cast<std::uint32_t>(data.size())).append(covered.bytes());
  png.put(crc32(covered.bytes()));
}

enum class PngColor : std::uint8_t {
  grey = 0,
  rgb = 2,
  palette = 3,
  grey_alpha = 4,
  rgb_alpha = 6
};

/// A PNG of `rows` of raw samples (PNG order), with `more` chunks before its data. RFC 1950, 1951:
/// one stored block; Adler-32.
inline Bytes png(std::uint32_t width, std::uint8_t depth, PngColor color,
                 const std::vector<Bytes>& rows,
                 const std::vector<std::pair<std::string, Bytes>>& more = {}) {
  Writer raw;
  for (const Bytes& row : rows) raw.put(std::uint8_t{0}).append(row);  // 0: not filtered
  std::uint32_t a = 1;
  std::uint32_t b = 0;
  for (const std::byte sample : raw.bytes()) {
    a = (a + std::to_integer<std::uint32_t>(sample)) % 65521;
    b = (b + a) % 65521;
  }
  const auto length = static_cast<std::uint16_t>(raw.size());
  Writer zlib;
  zlib.text("\x78\x01\x01").put(length).put(static_cast<std::uint16_t>(~length));
  zlib.append(raw.bytes());
  for (const std::uint32_t half : {b, a}) {
    zlib.put(static_cast<std::uint8_t>(half >> 8U)).put(static_cast<std::uint8_t>(half));
  }
  Writer header(true);
  header.put(width).put(static_cast<std::uint32_t>(rows.size())).put(depth).put(color);
  header.put(std::uint8_t{0}).put(std::uint8_t{0}).put(std::uint8_t{0});
  Writer file(true);
  file.text("\x89PNG\r\n\x1a\n");
  add_png_chunk(file, "IHDR", header.bytes());
  for (const auto& [type, data] : more) add_png_chunk(file, type, data);
  add_png_chunk(file, "IDAT", zlib.bytes());
  add_png_chunk(file, "IEND", {});
  return file.bytes();
}

/// A JPEG of 8 x 8 pixels of one level: ITU T.81 with all quantizers 8, so that the only
/// coefficient of a component is level - 128. Two DC codes, 00: a difference of 6 bits, 01: none;
/// one AC code, 0: end of block. `level` - 128 must have 6 bits (160 to 191). With `color`, Cb and
/// Cr are none, which is grey. `segments` stand before the frame.
inline Bytes jpeg(std::uint8_t level, bool color, const Bytes& segments = {}) {
  Writer file(true);
  file.put(std::uint16_t{0xffd8}).append(segments);
  file.put(std::uint16_t{0xffdb}).put(std::uint16_t{67}).put(std::uint8_t{0});
  for (int i = 0; i < 64; ++i) file.put(std::uint8_t{8});
  const std::uint8_t components = color ? 3 : 1;
  file.put(std::uint16_t{0xffc0}).put(static_cast<std::uint16_t>(8 + 3 * components));
  file.put(std::uint8_t{8}).put(std::uint16_t{8}).put(std::uint16_t{8}).put(components);
  for (std::uint8_t c = 1; c <= components; ++c) {
    file.put(c).put(std::uint8_t{0x11}).put(std::uint8_t{0});
  }
  file.put(std::uint16_t{0xffc4}).put(std::uint16_t{21}).put(std::uint8_t{0});
  for (int length = 1; length <= 16; ++length) {
    file.put(static_cast<std::uint8_t>(length == 2 ? 2 : 0));
  }
  file.put(std::uint8_t{6}).put(std::uint8_t{0});
  file.put(std::uint16_t{0xffc4}).put(std::uint16_t{20}).put(std::uint8_t{0x10});
  for (int length = 1; length <= 16; ++length) {
    file.put(static_cast<std::uint8_t>(length == 1 ? 1 : 0));
  }
  file.put(std::uint8_t{0});
  file.put(std::uint16_t{0xffda}).put(static_cast<std::uint16_t>(6 + 2 * components));
  file.put(components);
  for (std::uint8_t c = 1; c <= components; ++c) file.put(c).put(std::uint8_t{0});
  file.put(std::uint8_t{0}).put(std::uint8_t{63}).put(std::uint8_t{0});
  // Bits: 00 dddddd 0, then 01 0 for each of Cb and Cr, then ones.
  const std::uint32_t y = static_cast<std::uint32_t>(level - 128) << 1U;  // 9 bits
  const std::uint32_t bits = color ? y << 7U | 0b0100101U : y << 7U | 0b1111111U;
  file.put(static_cast<std::uint8_t>(bits >> 8U)).put(static_cast<std::uint8_t>(bits));
  file.put(std::uint16_t{0xffd9});
  return file.bytes();
}

struct ExrChannel {
  std::string name = {};
  std::vector<float> samples = {};  // row by row
};

/// An EXR of one uncompressed part; `channels` in alphabetical order. OpenEXR File Layout.
inline Bytes exr(std::int32_t width, std::int32_t height, const std::vector<ExrChannel>& channels) {
  Writer file;
  const auto attribute = [&](std::string_view name, std::string_view type, const Bytes& value) {
    file.text(name).put('\0').text(type).put('\0');
    file.put(static_cast<std::int32_t>(value.size())).append(value);
  };
  Writer list;
  for (const ExrChannel& channel : channels) {
    list.text(channel.name).put('\0').put(std::int32_t{2}).put(std::int32_t{0});  // float
    list.put(std::int32_t{1}).put(std::int32_t{1});
  }
  list.put('\0');
  Writer window;
  window.put_all<std::int32_t>({0, 0, width - 1, height - 1});
  file.text("\x76\x2f\x31\x01").put(std::int32_t{2});
  attribute("channels", "chlist", list.bytes());
  attribute("compression", "compression", {std::byte{0}});
  attribute("dataWindow", "box2i", window.bytes());
  attribute("displayWindow", "box2i", window.bytes());
  attribute("lineOrder", "lineOrder", {std::byte{0}});
  attribute("pixelAspectRatio", "float", Writer().put(1.0F).bytes());
  attribute("screenWindowCenter", "v2f", Writer().put(0.0F).put(0.0F).bytes());
  attribute("screenWindowWidth", "float", Writer().put(1.0F).bytes());
  file.put('\0');
  const auto columns = static_cast<std::size_t>(width);
  const std::size_t row_bytes = 4 * columns * channels.size();
  const std::size_t first = file.size() + 8 * static_cast<std::size_t>(height);
  for (std::int32_t y = 0; y < height; ++y) {
    file.put(static_cast<std::uint64_t>(first + static_cast<std::size_t>(y) * (row_bytes + 8)));
  }
  for (std::int32_t y = 0; y < height; ++y) {
    file.put(y).put(static_cast<std::int32_t>(row_bytes));
    for (const ExrChannel& channel : channels) {
      for (std::size_t x = 0; x < columns; ++x) {
        file.put(channel.samples[static_cast<std::size_t>(y) * columns + x]);
      }
    }
  }
  return file.bytes();
}

/// A .glb of JSON text and one binary chunk (glTF 2.0, 4.4).
inline Bytes glb(std::string json, const Bytes& binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  Bytes padded = binary;
  padded.resize((padded.size() + 3) / 4 * 4);
  Writer file;
  file.text("glTF").put(std::uint32_t{2});
  file.put(static_cast<std::uint32_t>(28 + json.size() + padded.size()));
  file.put(static_cast<std::uint32_t>(json.size())).text("JSON").text(json);
  file.put(static_cast<std::uint32_t>(padded.size())).text(std::string_view("BIN\0", 4));
  file.append(padded);
  return file.bytes();
}

inline std::string base64(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group =
          group << 8U | (i + k < bytes.size() ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return text;
}

}  // namespace fstop::handmade
