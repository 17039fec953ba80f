#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "core/scene/mesh_file.h"

namespace fstop {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

using Corner = std::array<std::uint32_t, 3>;  // v, vt, vn from 0; kNone where absent

// Numbers corners in the order of their first use; an open-addressing hash set of their numbers.
class CornerNumbers {
 public:
  std::uint32_t number_of(const Corner& corner) {
    if (2 * (corners_.size() + 1) > slots_.size()) grow();
    std::size_t slot = slot_of(corner);
    while (slots_[slot] != kNone && corners_[slots_[slot]] != corner) {
      slot = (slot + 1) & (slots_.size() - 1);
    }
    if (slots_[slot] == kNone) {
      slots_[slot] = static_cast<std::uint32_t>(corners_.size());
      corners_.push_back(corner);
    }
    return slots_[slot];
  }
  const std::vector<Corner>& corners() const { return corners_; }

 private:
  std::size_t slot_of(const Corner& corner) const {
    // The finalizer of MurmurHash3 (Appleby, public domain) after each part.
    std::uint64_t hash = 0;
    for (const std::uint32_t part : corner) {
      hash = (hash ^ part) * 0xff51afd7ed558ccdU;
      hash ^= hash >> 33U;
    }
    return static_cast<std::size_t>(hash) & (slots_.size() - 1);
  }
  void grow() {
    slots_.assign(slots_.empty() ? 1024 : 2 * slots_.size(), kNone);  // a power of two
    for (std::uint32_t i = 0; i < corners_.size(); ++i) {
      std::size_t slot = slot_of(corners_[i]);
      while (slots_[slot] != kNone) slot = (slot + 1) & (slots_.size() - 1);
      slots_[slot] = i;
    }
  }

  std::vector<Corner> corners_;
  std::vector<std::uint32_t> slots_;
};

class ObjReader {
 public:
  ObjReader(const std::string& name, std::string_view text, const AssetLimits& limits)
      : name_(name), at_(text.data()), end_(text.data() + text.size()), limits_(limits) {}

  Mesh read() {
    for (; at_ != end_; ++at_, ++line_) {
      statement();
      while (at_ != end_ && *at_ != '\n') skip_one();
      if (at_ == end_) break;
    }
    return mesh();
  }

 private:
  [[noreturn]] void refuse(const std::string& reason) const {
    refuse_mesh(name_, "line " + std::to_string(line_) + ": " + reason);
  }

  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

  // A backslash at the end of a line joins the next to it.
  bool at_joined_line() const {
    if (*at_ != '\\') return false;
    const char* next = at_ + 1;
    if (next != end_ && *next == '\r') ++next;
    return next != end_ && *next == '\n';
  }
  void skip_one() {
    if (at_joined_line()) {
      while (*at_ != '\n') ++at_;
      ++line_;
    }
    ++at_;
  }
  void skip_blanks() {
    while (at_ != end_ && (is_blank(*at_) || at_joined_line())) skip_one();
  }
  bool at_end_of_line() {
    skip_blanks();
    return at_ == end_ || *at_ == '\n' || *at_ == '#';
  }
  bool at_end_of_word() const {
    return at_ == end_ || *at_ == '\n' || is_blank(*at_) || at_joined_line();
  }

  void statement() {
    skip_blanks();
    const char* begin = at_;
    while (!at_end_of_word()) ++at_;
    const std::string_view word(begin, static_cast<std::size_t>(at_ - begin));
    if (word == "v") {
      position();
    } else if (word == "vt") {
      const double u = number();
      uvs_.push_back({narrow(u), at_end_of_line() ? 0.0F : narrow(number())});
    } else if (word == "vn") {
      const double x = number();
      const double y = number();
      normals_.push_back({narrow(x), narrow(y), narrow(number())});
    } else if (word == "f") {
      face();
    }
  }

  double number() {
    skip_blanks();
    if (at_ != end_ && *at_ == '+') ++at_;
    double value = 0.0;
    const auto [next, error] = std::from_chars(at_, end_, value);
    at_ = next;
    if (error != std::errc{} || !at_end_of_word()) refuse("a number is missing or malformed");
    if (!std::isfinite(value)) refuse("a number is not finite");
    return value;
  }

  static float narrow(double value) { return static_cast<float>(value); }

  void position() {
    std::array<float, 3> position = {};
    for (float& coordinate : position) {
      const double value = number();
      if (std::abs(value) > limits_.max_coordinate) {
        refuse("vertex " + std::to_string(positions_.size() + 1) + " lies beyond " +
               std::to_string(limits_.max_coordinate) + " m");
      }
      coordinate = narrow(value);
    }
    positions_.push_back(position);
  }

  // From 1, or from the end so far when negative; an index may come before what it names.
  std::uint32_t index(std::size_t count) {
    std::int64_t value = 0;
    const auto [next, error] = std::from_chars(at_, end_, value);
    if (error != std::errc{}) refuse("an index is missing or malformed");
    at_ = next;
    if (value < 0) value += static_cast<std::int64_t>(count) + 1;
    if (value < 1 || value >= std::int64_t{kNone}) refuse("an index is out of range");
    return static_cast<std::uint32_t>(value - 1);
  }

  // v, v/vt, v//vn or v/vt/vn
  Corner corner() {
    Corner corner = {index(positions_.size()), kNone, kNone};
    if (at_ != end_ && *at_ == '/') {
      ++at_;
      if (at_ != end_ && *at_ != '/') corner[1] = index(uvs_.size());
      if (at_ != end_ && *at_ == '/') {
        ++at_;
        corner[2] = index(normals_.size());
      }
    }
    if (!at_end_of_word()) refuse("an index is missing or malformed");
    return corner;
  }

  void face() {
    std::size_t count = 0;
    std::uint32_t first = 0;
    std::uint32_t previous = 0;
    for (; !at_end_of_line(); ++count) {
      const std::uint32_t current = numbers_.number_of(corner());
      if (count == 0) first = current;
      if (count >= 2) {
        if (triangles_.size() >= limits_.max_triangles) {
          refuse("more than " + std::to_string(limits_.max_triangles) + " triangles");
        }
        triangles_.push_back({first, previous, current});
      }
      previous = current;
    }
    if (count < 3) refuse("a face has fewer than three corners");
  }

  // One column of the corners; empty if one of them has none.
  template <typename Value>
  std::vector<Value> gathered(const std::vector<Value>& values, std::size_t part,
                              const std::string& what) const {
    std::vector<Value> result;
    result.reserve(numbers_.corners().size());
    for (const Corner& corner : numbers_.corners()) {
      const std::uint32_t index = corner[part];
      if (index == kNone) return {};
      if (index >= values.size()) {
        refuse_mesh(name_, "a face asks for " + what + " " + std::to_string(index + 1) + " of " +
                               std::to_string(values.size()));
      }
      result.push_back(values[index]);
    }
    return result;
  }

  Mesh mesh() {
    return {.positions = gathered(positions_, 0, "vertex"),
            .normals = gathered(normals_, 2, "normal"),
            .uvs = gathered(uvs_, 1, "texture coordinate"),
            .triangles = std::move(triangles_)};
  }

  const std::string& name_;
  const char* at_;
  const char* end_;
  const AssetLimits& limits_;
  std::size_t line_ = 1;
  std::vector<std::array<float, 3>> positions_;
  std::vector<std::array<float, 3>> normals_;
  std::vector<std::array<float, 2>> uvs_;
  CornerNumbers numbers_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
};

}  // namespace

Mesh decode_obj(const std::string& name, std::span<const std::byte> bytes,
                const AssetLimits& limits) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return ObjReader(name, text, limits).read();
}

}  // namespace fstop
