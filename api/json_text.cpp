#include "api/json_text.h"

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "api/problem.h"

namespace fstop::api {
namespace {

using nlohmann::json;

/// Watches the text go by, knows where it is, and says why it stops.
class TextCheck : public nlohmann::json_sax<json> {
 public:
  TextCheck(std::string_view text, const Limits& limits) : text_(text), limits_(limits) {}

  const std::optional<FieldFault>& fault() const { return fault_; }

  bool null() override { return value(); }
  bool boolean(bool) override { return value(); }
  bool number_integer(number_integer_t) override { return value(); }
  bool number_unsigned(number_unsigned_t) override { return value(); }
  bool number_float(number_float_t number, const string_t& digits) override {
    const std::string_view mantissa =
        std::string_view(digits).substr(0, digits.find_first_of("eE"));
    const bool vanished = number == 0.0 && mantissa.find_first_of("123456789") != mantissa.npos;
    return vanished ? stop("is a number too small for a double") : value();
  }
  bool string(string_t&) override { return value(); }
  bool binary(binary_t&) override { return stop("binary values are not JSON"); }

  bool start_object(std::size_t) override { return open(false); }
  bool key(string_t& name) override {
    levels_.back().name = name;
    return levels_.back().names.insert(name).second || stop("stands twice in one object");
  }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(true); }
  bool end_array() override { return close(); }

  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::json::exception& error) override {
    constexpr int kNumberOverflow = 406;
    return stop(error.id == kNumberOverflow ? "is a number too large for a double"
                                            : syntax_fault(position, error.what()));
  }

 private:
  struct Level {
    bool array = false;
    std::size_t index = 0;
    std::string name = {};
    std::set<std::string> names = {};
  };

  bool open(bool array) {
    if (levels_.size() >= static_cast<std::size_t>(limits_.json_depth)) {
      return stop("is nested deeper than " + std::to_string(limits_.json_depth) + " levels");
    }
    levels_.push_back({.array = array});
    return true;
  }
  bool close() {
    levels_.pop_back();
    return value();
  }
  // One value is complete.
  bool value() {
    if (!levels_.empty() && levels_.back().array) ++levels_.back().index;
    return true;
  }

  bool stop(std::string detail) {
    std::string pointer = "#";
    for (const Level& level : levels_) {
      if (!level.array && level.names.empty()) break;  // at the first name of this object
      pointer += '/' + (level.array ? std::to_string(level.index) : pointer_step(level.name));
    }
    fault_ = FieldFault{std::move(pointer), std::move(detail)};
    return false;
  }

  // The library's text without its own name: "... syntax error while parsing value - ...".
  std::string syntax_fault(std::size_t position, std::string_view text) const {
    const std::size_t colon = text.find(": ");
    std::string detail = "is not JSON at byte " + std::to_string(position);
    if (colon != text.npos) detail += ": " + std::string(text.substr(colon + 2));
    return shortened(detail, limits_.echo_bytes);
  }

  std::string_view text_;
  const Limits& limits_;
  std::vector<Level> levels_;
  std::optional<FieldFault> fault_;
};

bool stays_in_fragment(char c) {
  const bool letter_or_digit =
      (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
  return letter_or_digit ||
         std::string_view("-._~!$&'()*+,;=:@/?").find(c) != std::string_view::npos;
}

template <typename Json>
std::string text_of(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

nlohmann::json parse_json(std::string_view text, const Limits& limits) {
  TextCheck check(text, limits);
  if (!json::sax_parse(text, &check)) {
    throw InvalidRequest(check.fault().value_or(FieldFault{"#", "is not JSON"}),
                         ErrorCode::malformed_json);
  }
  // The library takes a NUL outside a string for the end and has not looked at what follows.
  if (const std::size_t nul = text.find('\0'); nul != text.npos) {
    throw InvalidRequest(FieldFault{"#", "is not JSON at byte " + std::to_string(nul) + ": NUL"},
                         ErrorCode::malformed_json);
  }
  return json::parse(text);
}

std::string pointer_step(std::string_view key) {
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string step;
  for (const char c : key) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '~') {
      step += "~0";
    } else if (c == '/') {
      step += "~1";
    } else if (stays_in_fragment(c)) {
      step += c;
    } else {
      step += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return step;
}

bool is_word(const nlohmann::json& value, std::string_view word) {
  return value.is_string() && value.get_ref<const std::string&>() == word;
}

std::string json_text(const nlohmann::json& value) { return text_of(value); }
std::string json_text(const nlohmann::ordered_json& value) { return text_of(value); }

}  // namespace fstop::api
