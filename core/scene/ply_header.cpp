#include "core/scene/ply_header.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <system_error>
#include <utility>

#include "core/scene/mesh_file.h"

namespace fstop::ply {

namespace {

std::optional<Scalar> scalar_of(std::string_view word) {
  static constexpr std::array<std::pair<std::string_view, Scalar>, 16> kNames = {
      {{"char", Scalar::int8},
       {"int8", Scalar::int8},
       {"uchar", Scalar::uint8},
       {"uint8", Scalar::uint8},
       {"short", Scalar::int16},
       {"int16", Scalar::int16},
       {"ushort", Scalar::uint16},
       {"uint16", Scalar::uint16},
       {"int", Scalar::int32},
       {"int32", Scalar::int32},
       {"uint", Scalar::uint32},
       {"uint32", Scalar::uint32},
       {"float", Scalar::float32},
       {"float32", Scalar::float32},
       {"double", Scalar::float64},
       {"float64", Scalar::float64}}};
  for (const auto& [name, scalar] : kNames) {
    if (name == word) return scalar;
  }
  return std::nullopt;
}

class HeaderReader {
 public:
  HeaderReader(const std::string& name, std::string_view text) : name_(name), text_(text) {}

  Header read() {
    if (next_line() != std::vector<std::string_view>{"ply"}) refuse("is not a PLY file");
    bool format_seen = false;
    for (std::vector<std::string_view> words; words = next_line(), words.at(0) != "end_header";) {
      if (words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "format" && words.size() == 3 && words[2] == "1.0") {
        header_.encoding = encoding_of(words[1]);
        format_seen = true;
      } else if (words[0] == "element" && words.size() == 3) {
        element(words);
      } else if (words[0] == "property" && !header_.elements.empty()) {
        property(words);
      } else {
        refuse("header line " + std::to_string(line_) + " is malformed");
      }
    }
    if (!format_seen) refuse("the header names no format");
    header_.size = at_;
    return std::move(header_);
  }

 private:
  static constexpr std::size_t kMaxLines = 1000;
  static constexpr std::size_t kMaxLength = 65'536;

  [[noreturn]] void refuse(const std::string& reason) const { refuse_mesh(name_, reason); }

  // At least one word, possibly empty.
  std::vector<std::string_view> next_line() {
    const std::size_t end = text_.substr(0, kMaxLength).find('\n', at_);
    if (end == std::string_view::npos || ++line_ > kMaxLines) refuse("the header has no end");
    std::string_view line = text_.substr(at_, end - at_);
    at_ = end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    std::vector<std::string_view> words;
    while (!line.empty()) {
      const std::size_t space = std::min(line.find(' '), line.size());
      if (space > 0) words.push_back(line.substr(0, space));
      line.remove_prefix(std::min(space + 1, line.size()));
    }
    if (words.empty()) words.emplace_back();
    return words;
  }

  Encoding encoding_of(std::string_view word) const {
    if (word == "ascii") return Encoding::ascii;
    if (word == "binary_little_endian") return Encoding::little_endian;
    if (word == "binary_big_endian") return Encoding::big_endian;
    refuse("the header's format is unknown");
  }

  void element(const std::vector<std::string_view>& words) {
    Element element{.name = std::string(words[1])};
    const std::string_view count = words[2];
    const auto [end, error] =
        std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (error != std::errc{} || end != count.data() + count.size()) {
      refuse("header line " + std::to_string(line_) + " has no count");
    }
    header_.elements.push_back(std::move(element));
  }

  void property(const std::vector<std::string_view>& words) {
    const bool list = words.size() == 5 && words[1] == "list";
    const auto type = list || words.size() == 3 ? scalar_of(words[list ? 3 : 1]) : std::nullopt;
    const auto count_type = list ? scalar_of(words[2]) : std::nullopt;
    if (!type || (list && !count_type)) {
      refuse("header line " + std::to_string(line_) + " is malformed");
    }
    header_.elements.back().properties.push_back({std::string(words.back()), *type, count_type});
  }

  const std::string& name_;
  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 0;
  Header header_ = {};
};

}  // namespace

Header read_header(const std::string& name, std::string_view text) {
  return HeaderReader(name, text).read();
}

}  // namespace fstop::ply
