#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/scene/mesh_file.h"
#include "core/scene/ply_header.h"

namespace fstop {
namespace {

using ply::Element;
using ply::Encoding;
using ply::Header;
using ply::Property;
using ply::Scalar;

std::size_t size_of(Scalar scalar) {
  static constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(scalar)];
}

// Where a vertex's numbers go.
enum Slot : int { x, y, z, nx, ny, nz, u, v, slot_count, no_slot = -1 };

Slot slot_of(std::string_view property) {
  static constexpr std::array<std::pair<std::string_view, Slot>, 12> kNames = {{{"x", x},
                                                                                {"y", y},
                                                                                {"z", z},
                                                                                {"nx", nx},
                                                                                {"ny", ny},
                                                                                {"nz", nz},
                                                                                {"u", u},
                                                                                {"v", v},
                                                                                {"s", u},
                                                                                {"t", v},
                                                                                {"texture_u", u},
                                                                                {"texture_v", v}}};
  for (const auto& [name, slot] : kNames) {
    if (name == property) return slot;
  }
  return no_slot;
}

// The numbers of the body, one after another; each is a double, which holds them all.
class AsciiBody {
 public:
  explicit AsciiBody(std::string_view text) : at_(text.data()), end_(text.data() + text.size()) {}

  static constexpr std::size_t least_size(Scalar) { return 2; }  // a digit and a blank
  std::size_t size() const { return static_cast<std::size_t>(end_ - at_) + 1; }

  std::optional<double> next(Scalar) {
    while (at_ != end_ && is_blank(*at_)) ++at_;
    if (at_ != end_ && *at_ == '+') ++at_;
    double value = 0.0;
    const auto [after, error] = std::from_chars(at_, end_, value);
    if (error != std::errc{} || (after != end_ && !is_blank(*after))) return std::nullopt;
    at_ = after;
    return value;
  }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }
  const char* at_;
  const char* end_;
};

class BinaryBody {
 public:
  BinaryBody(std::string_view bytes, bool big_endian)
      : bytes_(bytes), reversed_(big_endian == (std::endian::native == std::endian::little)) {}

  static std::size_t least_size(Scalar scalar) { return size_of(scalar); }
  std::size_t size() const { return bytes_.size(); }

  std::optional<double> next(Scalar scalar) {
    if (bytes_.size() < size_of(scalar)) return std::nullopt;
    switch (scalar) {
      case Scalar::int8:
        return taken<std::int8_t>();
      case Scalar::uint8:
        return taken<std::uint8_t>();
      case Scalar::int16:
        return taken<std::int16_t>();
      case Scalar::uint16:
        return taken<std::uint16_t>();
      case Scalar::int32:
        return taken<std::int32_t>();
      case Scalar::uint32:
        return taken<std::uint32_t>();
      case Scalar::float32:
        return taken<float>();
      case Scalar::float64:
        return taken<double>();
    }
    return std::nullopt;
  }

 private:
  template <typename T>
  double taken() {
    std::array<char, sizeof(T)> raw = {};
    std::memcpy(raw.data(), bytes_.data(), sizeof(T));
    bytes_.remove_prefix(sizeof(T));
    if (reversed_) std::reverse(raw.begin(), raw.end());
    return static_cast<double>(std::bit_cast<T>(raw));
  }

  std::string_view bytes_;
  bool reversed_;
};

template <typename Body>
class BodyReader {
 public:
  BodyReader(const std::string& name, const Header& header, Body body, const AssetLimits& limits)
      : name_(name), header_(header), body_(body), limits_(limits) {}

  Mesh read() {
    for (const Element& element : header_.elements) {
      check_count(element);
      if (element.properties.empty()) continue;
      if (element.name == "vertex") {
        vertices(element);
      } else if (element.name == "face") {
        faces(element);
      } else {
        for (std::uint64_t i = 0; i < element.count; ++i) {
          for (const Property& property : element.properties) skip(element, property, i);
        }
      }
    }
    if (mesh_.positions.empty()) refuse("the file holds no vertex");
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void refuse(const std::string& reason) const { refuse_mesh(name_, reason); }

  // The names of other elements are the file's own, of any length.
  std::string label(const Element& element) const {
    if (element.name == "vertex" || element.name == "face") return element.name;
    return "element " + std::to_string(&element - header_.elements.data());
  }

  // A header may promise more than the rest of the file can hold.
  void check_count(const Element& element) const {
    std::size_t least = 0;
    for (const Property& property : element.properties) {
      least += Body::least_size(property.count_type.value_or(property.type));
    }
    if (least > 0 && element.count > body_.size() / least) {
      refuse("is truncated: its header promises " + std::to_string(element.count) + " x " +
             label(element));
    }
    const bool vertex = element.name == "vertex";
    const std::size_t most = limits_.max_triangles * (vertex ? 3 : 1);
    if ((vertex || element.name == "face") && element.count > most) {
      refuse("more than " + std::to_string(most) + (vertex ? " vertices" : " faces"));
    }
  }

  double next(const Element& element, Scalar type, std::uint64_t number) {
    const std::optional<double> value = body_.next(type);
    if (!value) {
      refuse("is truncated or malformed at " + label(element) + ' ' + std::to_string(number));
    }
    return *value;
  }

  std::uint64_t length(const Element& element, const Property& list, std::uint64_t number) {
    const double count = next(element, *list.count_type, number);
    if (!(count >= 0.0 && count <= static_cast<double>(body_.size())) ||
        count != std::floor(count)) {
      refuse("a list of " + label(element) + ' ' + std::to_string(number) +
             " has an impossible length");
    }
    return static_cast<std::uint64_t>(count);
  }

  void skip(const Element& element, const Property& property, std::uint64_t number) {
    const std::uint64_t count = property.count_type ? length(element, property, number) : 1;
    for (std::uint64_t i = 0; i < count; ++i) next(element, property.type, number);
  }

  void vertices(const Element& element) {
    if (!mesh_.positions.empty()) refuse("two elements are called vertex");
    std::vector<Slot> slots;
    std::array<bool, slot_count> present = {};
    for (const Property& property : element.properties) {
      slots.push_back(property.count_type ? no_slot : slot_of(property.name));
      if (slots.back() != no_slot) present[static_cast<std::size_t>(slots.back())] = true;
    }
    if (!present[x] || !present[y] || !present[z]) refuse("its vertices have no x, y, z");
    const bool with_normals = present[nx] && present[ny] && present[nz];
    const bool with_uvs = present[u] && present[v];
    mesh_.positions.reserve(element.count);
    if (with_normals) mesh_.normals.reserve(element.count);
    if (with_uvs) mesh_.uvs.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      std::array<float, slot_count> values = {};
      for (std::size_t p = 0; p < slots.size(); ++p) {
        if (slots[p] == no_slot) {
          skip(element, element.properties[p], i);
        } else {
          values[static_cast<std::size_t>(slots[p])] =
              static_cast<float>(next(element, element.properties[p].type, i));
        }
      }
      mesh_.positions.push_back({values[x], values[y], values[z]});
      if (with_normals) mesh_.normals.push_back({values[nx], values[ny], values[nz]});
      if (with_uvs) mesh_.uvs.push_back({values[u], values[v]});
    }
  }

  void faces(const Element& element) {
    const auto is_corners = [](const Property& property) {
      return property.count_type &&
             (property.name == "vertex_indices" || property.name == "vertex_index");
    };
    if (std::none_of(element.properties.begin(), element.properties.end(), is_corners)) {
      refuse("its faces have no vertex_indices");
    }
    mesh_.triangles.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const Property& property : element.properties) {
        if (is_corners(property)) {
          face(element, property, i);
        } else {
          skip(element, property, i);
        }
      }
    }
  }

  void face(const Element& element, const Property& corners, std::uint64_t number) {
    const std::uint64_t count = length(element, corners, number);
    if (count < 3) refuse("face " + std::to_string(number) + " has fewer than three corners");
    if (count - 2 > limits_.max_triangles - mesh_.triangles.size()) {
      refuse("more than " + std::to_string(limits_.max_triangles) + " triangles");
    }
    std::uint32_t first = 0;
    std::uint32_t previous = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      const double index = next(element, corners.type, number);
      if (!(index >= 0.0 && index <= std::numeric_limits<std::uint32_t>::max()) ||
          index != std::floor(index)) {
        refuse("face " + std::to_string(number) + " has an index out of range");
      }
      const auto current = static_cast<std::uint32_t>(index);
      if (i == 0) first = current;
      if (i >= 2) mesh_.triangles.push_back({first, previous, current});
      previous = current;
    }
  }

  const std::string& name_;
  const Header& header_;
  Body body_;
  const AssetLimits& limits_;
  Mesh mesh_ = {};
};

}  // namespace

Mesh decode_ply(const std::string& name, std::span<const std::byte> bytes,
                const AssetLimits& limits) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const Header header = ply::read_header(name, text);
  const std::string_view body = text.substr(header.size);
  if (header.encoding == Encoding::ascii) {
    return BodyReader(name, header, AsciiBody(body), limits).read();
  }
  const BinaryBody binary(body, header.encoding == Encoding::big_endian);
  return BodyReader(name, header, binary, limits).read();
}

}  // namespace fstop
