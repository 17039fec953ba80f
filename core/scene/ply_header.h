#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fstop::ply {

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

/// A number of an element, or a list of them.
struct Property {
  std::string name = {};
  Scalar type = Scalar::float32;          // of the value, or of a list's items
  std::optional<Scalar> count_type = {};  // of a list's length
};

/// `count` records of the same properties.
struct Element {
  std::string name = {};
  std::uint64_t count = 0;
  std::vector<Property> properties = {};
};

enum class Encoding { ascii, little_endian, big_endian };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements = {};
  std::size_t size = 0;  // in bytes: where the body begins
};

/// What stands before the body of the PLY file `text`; counts are as promised, not checked.
/// Throws: Error{bad_geometry} naming the file, where the header is malformed or longer than
///         64 KiB or 1000 lines.
Header read_header(const std::string& name, std::string_view text);

}  // namespace fstop::ply
