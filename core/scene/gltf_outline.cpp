#include "core/scene/gltf_outline.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/scene/mesh_file.h"

namespace fstop {
namespace {

constexpr int kMaxDepth = 64;
// An object counts twice, for its comma and its bracket. Files of several thousand nodes stay
// within; the library's memory stays below 0.3 GB (measured: 100,000 empty materials).
constexpr std::size_t kMaxValues = 200'000;

// Counts what JSON text holds, without building anything.
class Outline {
 public:
  explicit Outline(std::string_view text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
      switch (text[i]) {
        case '"':
          i = end_of_string(text, i);
          break;
        case '{':
        case '[':
          open();
          break;
        case '}':
        case ']':
          --level_;
          break;
        case ',':
          ++values_;
          break;
        default:
          break;
      }
    }
  }

  int depth() const { return depth_; }
  std::size_t values() const { return values_; }
  /// Objects in the root's member "buffers".
  std::size_t buffers() const { return buffers_; }
  /// A size or an offset is negative, which the library would read as 0.
  bool has_negative_size() const { return has_negative_size_; }
  /// A root member is written with escapes: it could be "buffers" in disguise.
  bool has_escaped_member() const { return has_escaped_member_; }

 private:
  void open() {
    ++values_;
    depth_ = std::max(depth_, ++level_);
    if (level_ == 3 && in_buffers_) ++buffers_;
  }

  std::size_t end_of_string(std::string_view text, std::size_t begin) {
    std::size_t end = begin + 1;
    while (end < text.size() && text[end] != '"') end += text[end] == '\\' ? 2 : 1;
    has_negative_size_ = has_negative_size_ || is_negative_size(text, begin, end);
    if (level_ == 1 && end < text.size()) {  // a member's name, or a value that does not matter
      const std::string_view name = text.substr(begin + 1, end - begin - 1);
      in_buffers_ = name == "buffers";
      has_escaped_member_ = has_escaped_member_ || name.find('\\') != std::string_view::npos;
    }
    return end;
  }

  static bool is_negative_size(std::string_view text, std::size_t begin, std::size_t end) {
    const std::string_view name = text.substr(begin + 1, end - begin - 1);
    const bool is_size =
        name == "byteOffset" || name == "byteLength" || name == "byteStride" || name == "count";
    if (!is_size) return false;
    const std::size_t colon = text.find_first_not_of(" \t\r\n", end + 1);
    if (colon == std::string_view::npos || text[colon] != ':') return false;
    const std::size_t value = text.find_first_not_of(" \t\r\n", colon + 1);
    return value != std::string_view::npos && text[value] == '-';
  }

  int level_ = 0;
  int depth_ = 0;
  std::size_t values_ = 1;
  std::size_t buffers_ = 0;
  bool in_buffers_ = false;
  bool has_escaped_member_ = false;
  bool has_negative_size_ = false;
};

// Of a .glb: 12 bytes of header, then length, "JSON", text (glTF 2.0, 4.4).
std::string_view json_of(const std::string& name, std::string_view file, bool binary) {
  if (!binary) return file;
  std::uint32_t length = 0;
  if (file.size() < 20) refuse_mesh(name, "is truncated");
  std::memcpy(&length, file.data() + 12, sizeof length);
  if (length > file.size() - 20) refuse_mesh(name, "is truncated");
  return file.substr(20, length);
}

}  // namespace

void check_gltf_outline(const std::string& name, std::string_view file, bool binary) {
  const Outline outline(json_of(name, file, binary));
  if (outline.depth() > kMaxDepth) refuse_mesh(name, "its JSON is nested too deeply");
  if (outline.values() > kMaxValues) {
    refuse_mesh(name, "its JSON holds more than " + std::to_string(kMaxValues) + " values");
  }
  if (outline.has_negative_size()) refuse_mesh(name, "has a negative offset, length or count");
  if (binary && (outline.buffers() > 1 || outline.has_escaped_member())) {
    refuse_mesh(name, "has more than one buffer");
  }
}

}  // namespace fstop
