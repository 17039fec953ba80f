#include "api/json_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "api/json_text.h"

namespace fstop::api {
namespace {

using nlohmann::json;

const json& empty_object() {
  static const json value = json::object();
  return value;
}

std::string with_unit(double number, std::string_view unit) {
  std::string text = number_text(number);
  if (!unit.empty() && std::isfinite(number)) text += " " + std::string(unit);
  return text;
}

// The unit that a number's name ends in, as messages say it; empty for pure numbers.
std::string_view unit_of(std::string_view key) {
  constexpr std::pair<std::string_view, std::string_view> kUnits[] = {
      {"_m_s", "m/s"}, {"_deg", "degrees"}, {"_px", "px"}, {"_ms", "ms"}, {"_s", "s"}, {"_m", "m"}};
  for (const auto& [suffix, unit] : kUnits) {
    if (key.ends_with(suffix)) return unit;
  }
  return "";
}

std::string range_text(Range range, std::string_view unit) {
  return "must lie in " + with_unit(range.min, unit) + " to " + with_unit(range.max, unit);
}

std::string list_text(const std::vector<std::string_view>& names) {
  std::string text;
  for (const std::string_view name : names) text += (text.empty() ? "" : ", ") + std::string(name);
  return text;
}

std::string echo(const json& value) { return shortened(json_text(value), Limits{}.echo_bytes); }

Range range_in(const LengthUnit& unit, Length min, Length max) {
  return {unit.number(min), unit.number(max)};
}

// Infinity as JSON has it.
json normal_number(double number) {
  return std::isinf(number) ? json("infinity") : json(number + 0.0);  // -0.0 becomes 0.0
}

}  // namespace

ObjectReader::ObjectReader(const json& value, std::string pointer, FaultList& faults, json& normal)
    : value_(&value), pointer_(std::move(pointer)), faults_(&faults), normal_(&normal) {
  *normal_ = json::object();
  if (value.is_object()) return;
  fault("must be an object, got " + std::string(value.type_name()));
  value_ = &empty_object();
}

const json* ObjectReader::value(std::string_view key, bool required) {
  asked_.emplace(key);
  const auto found = value_->find(std::string(key));
  if (found == value_->end()) {
    // A reader of something that was no object has said so already.
    if (required && value_ != &empty_object()) fault(key, "is required");
    return nullptr;
  }
  normal(key) = *found;
  return &*found;
}

double ObjectReader::checked(const json& member, const std::string& where, Range range,
                             std::string_view unit) {
  const bool may_be_infinite = std::isinf(range.max);
  if (may_be_infinite && is_word(member, "infinity")) return range.max;
  if (!member.is_number()) {
    fault_at(where, std::string("must be a number") + (may_be_infinite ? " or \"infinity\"" : "") +
                        ", got " + member.type_name());
    return range.min;
  }
  const double number = member.get<double>();
  if (number >= range.min && number <= range.max) return number;
  fault_at(where, range_text(range, unit));
  return range.min;
}

double ObjectReader::number(std::string_view key, Range range, std::optional<double> fallback) {
  const json* member = value(key, !fallback);
  const double number = member == nullptr ? fallback.value_or(range.min)
                                          : checked(*member, pointer(key), range, unit_of(key));
  normal(key) = normal_number(number);
  return number;
}

std::optional<double> ObjectReader::optional_number(std::string_view key, Range range) {
  const json* member = value(key, false);
  if (member == nullptr || member->is_null()) return normal(key) = nullptr, std::nullopt;
  return number(key, range);
}

std::int64_t ObjectReader::integer(std::string_view key, std::int64_t min, std::int64_t max,
                                   std::optional<std::int64_t> fallback) {
  const json* member = value(key, !fallback);
  std::int64_t result = fallback.value_or(min);
  if (member != nullptr) {
    // Compared as a double: get<int>() would map 2^32 to 0 and true to 1. Limits are below 2^53.
    const Range range{static_cast<double>(min), static_cast<double>(max)};
    const double number = checked(*member, pointer(key), range, unit_of(key));
    if (number != std::floor(number)) fault(key, "must be a whole number, got " + echo(*member));
    result = static_cast<std::int64_t>(number);
  }
  normal(key) = result;
  return result;
}

std::optional<std::int64_t> ObjectReader::optional_integer(std::string_view key, std::int64_t min,
                                                           std::int64_t max) {
  const json* member = value(key, false);
  if (member == nullptr || member->is_null()) return normal(key) = nullptr, std::nullopt;
  return integer(key, min, max);
}

bool ObjectReader::boolean(std::string_view key, bool fallback) {
  const json* member = value(key, false);
  if (member != nullptr && !member->is_boolean()) {
    fault(key, "must be true or false, got " + std::string(member->type_name()));
  }
  const bool result = member != nullptr && member->is_boolean() ? member->get<bool>() : fallback;
  normal(key) = result;
  return result;
}

std::string ObjectReader::text(std::string_view key, std::size_t max_bytes,
                               std::optional<std::string> fallback) {
  const json* member = value(key, !fallback);
  std::string result = fallback.value_or("");
  if (member != nullptr && !member->is_string()) {
    fault(key, "must be a string, got " + std::string(member->type_name()));
  } else if (member != nullptr) {
    result = member->get<std::string>();
    if (result.size() > max_bytes) {
      fault(key, "must have at most " + std::to_string(max_bytes) + " bytes");
    }
  }
  normal(key) = result;
  return result;
}

Length ObjectReader::length(std::string_view key, Length min, Length max,
                            std::optional<Length> fallback) {
  const LengthUnit& unit = unit_of_suffix(key);
  const json* member = value(key, !fallback);
  const double number = member == nullptr
                            ? unit.number(fallback.value_or(min))
                            : checked(*member, pointer(key), range_in(unit, min, max), unit.symbol);
  normal(key) = normal_number(number);
  return unit.length(number);
}

std::array<Length, 2> ObjectReader::two_lengths(std::string_view key, Length min, Length max,
                                                std::array<Length, 2> fallback) {
  const LengthUnit& unit = unit_of_suffix(key);
  const std::vector<double> numbers = tuple(key, 2, range_in(unit, min, max), unit.symbol,
                                            {unit.number(fallback[0]), unit.number(fallback[1])});
  return {unit.length(numbers[0]), unit.length(numbers[1])};
}

std::vector<Length> ObjectReader::lengths(std::string_view key, Length min, Length max,
                                          std::size_t most) {
  const LengthUnit& unit = unit_of_suffix(key);
  std::vector<Length> result;
  json numbers = json::array();
  if (const json* elements = array(key, most)) {
    for (std::size_t i = 0; i < elements->size(); ++i) {
      const std::string where = pointer(key) + '/' + std::to_string(i);
      const double number = checked((*elements)[i], where, range_in(unit, min, max), unit.symbol);
      numbers.push_back(normal_number(number));
      result.push_back(unit.length(number));
    }
  }
  normal(key) = std::move(numbers);
  return result;
}

std::vector<double> ObjectReader::numbers(std::string_view key, Range range, std::size_t most,
                                          std::vector<double> fallback) {
  std::vector<double> result = std::move(fallback);
  if (value(key, false) != nullptr) {
    result.clear();
    const json* elements = array(key, most);
    for (std::size_t i = 0; elements != nullptr && i < elements->size(); ++i) {
      result.push_back(checked((*elements)[i], pointer(key) + '/' + std::to_string(i), range, "") +
                       0.0);
    }
  }
  normal(key) = result;
  return result;
}

std::vector<std::int64_t> ObjectReader::integers(std::string_view key, std::int64_t min,
                                                 std::int64_t max, std::size_t most,
                                                 std::vector<std::int64_t> fallback) {
  const Range range{static_cast<double>(min), static_cast<double>(max)};
  const std::vector<double> read =
      numbers(key, range, most, std::vector<double>(fallback.begin(), fallback.end()));
  std::vector<std::int64_t> result;
  for (const double number : read) {
    if (number != std::floor(number)) {
      fault_at(pointer(key) + '/' + std::to_string(result.size()), "must be a whole number");
    }
    result.push_back(static_cast<std::int64_t>(number));
  }
  normal(key) = result;
  return result;
}

Vec3 ObjectReader::vec3(std::string_view key, double bound, std::string_view unit,
                        std::optional<Vec3> fallback) {
  std::optional<std::array<double, 3>> values;
  if (fallback) values = {fallback->x, fallback->y, fallback->z};
  const std::array<double, 3> read = triple(key, {-bound, bound}, unit, values);
  return {read[0], read[1], read[2]};
}

std::array<double, 3> ObjectReader::triple(std::string_view key, Range range, std::string_view unit,
                                           std::optional<std::array<double, 3>> fallback) {
  std::vector<double> values;
  if (fallback) values.assign(fallback->begin(), fallback->end());
  const std::vector<double> read = tuple(key, 3, range, unit, values);
  return {read[0], read[1], read[2]};
}

// An empty `fallback`: the member is required.
std::vector<double> ObjectReader::tuple(std::string_view key, std::size_t count, Range range,
                                        std::string_view unit,
                                        const std::vector<double>& fallback) {
  const json* member = value(key, fallback.empty());
  std::vector<double> numbers = fallback.empty() ? std::vector<double>(count, range.min) : fallback;
  if (member != nullptr && (!member->is_array() || member->size() != count)) {
    fault(key, "must be an array of " + std::to_string(count) + " numbers");
  } else if (member != nullptr) {
    for (std::size_t i = 0; i < count; ++i) {
      numbers[i] = checked((*member)[i], pointer(key) + '/' + std::to_string(i), range, unit) + 0.0;
    }
  }
  normal(key) = numbers;
  return numbers;
}

const json* ObjectReader::array(std::string_view key, std::size_t most) {
  const json* member = value(key, false);
  if (member == nullptr) return nullptr;
  if (!member->is_array()) {
    fault(key, "must be an array, got " + std::string(member->type_name()));
  } else if (member->size() > most) {
    fault(key, "must have at most " + std::to_string(most) + " elements");
  } else {
    return member;
  }
  return nullptr;
}

std::size_t ObjectReader::word_index(std::string_view key,
                                     const std::vector<std::string_view>& names,
                                     std::optional<std::string_view> fallback) {
  const json* member = value(key, !fallback);
  std::string word(fallback.value_or(names.front()));
  if (member != nullptr && member->is_string()) word = member->get<std::string>();
  auto found = std::ranges::find(names, word);
  if (found == names.end() || (member != nullptr && !member->is_string())) {
    fault(key, "must be one of " + list_text(names) + "; got " + echo(*member));
    found = names.begin();
  }
  normal(key) = *found;
  return static_cast<std::size_t>(found - names.begin());
}

std::vector<std::size_t> ObjectReader::word_indices(std::string_view key,
                                                    const std::vector<std::string_view>& names,
                                                    std::string_view always) {
  std::vector<bool> chosen(names.size(), false);
  if (const json* words = array(key, names.size())) {
    if (words->empty()) fault(key, "must have at least 1 element");
    for (std::size_t i = 0; i < words->size(); ++i) {
      const json& word = (*words)[i];
      const auto found =
          std::ranges::find_if(names, [&](auto name) { return is_word(word, name); });
      const std::string where = pointer(key) + '/' + std::to_string(i);
      if (found == names.end()) {
        fault_at(where, "must be one of " + list_text(names) + "; got " + echo(word));
      } else if (chosen[static_cast<std::size_t>(found - names.begin())]) {
        fault_at(where, "must not stand twice");
      } else {
        chosen[static_cast<std::size_t>(found - names.begin())] = true;
      }
    }
  }
  std::vector<std::size_t> indices;
  json normal_words = json::array();
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!chosen[i] && names[i] != always) continue;
    indices.push_back(i);
    normal_words.push_back(names[i]);
  }
  normal(key) = std::move(normal_words);
  return indices;
}

ObjectReader ObjectReader::object(std::string_view key) {
  const json* member = value(key, false);
  return {member == nullptr ? empty_object() : *member, pointer(key), *faults_, normal(key)};
}

std::vector<ObjectReader> ObjectReader::objects(std::string_view key, std::size_t most) {
  std::vector<ObjectReader> readers;
  const json* elements = array(key, most);
  json& normals = normal(key) = json::array();
  if (elements == nullptr) return readers;
  // All at once: a reader keeps the address of its own normal form.
  normals = std::vector<json>(elements->size());
  for (std::size_t i = 0; i < elements->size(); ++i) {
    readers.emplace_back((*elements)[i], pointer(key) + '/' + std::to_string(i), *faults_,
                         normals[i]);
  }
  return readers;
}

std::vector<std::pair<std::string, ObjectReader>> ObjectReader::named_objects(std::string_view key,
                                                                              std::size_t most) {
  std::vector<std::pair<std::string, ObjectReader>> readers;
  const json* member = value(key, false);
  json& normals = normal(key) = json::object();
  if (member == nullptr) return readers;
  if (!member->is_object()) {
    fault(key, "must be an object, got " + std::string(member->type_name()));
    return readers;
  }
  if (member->size() > most) {
    fault(key, "must have at most " + std::to_string(most) + " members");
    return readers;
  }
  for (const auto& [name, element] : member->items()) {
    const std::string where = pointer(key) + '/' + pointer_step(name);
    readers.emplace_back(name, ObjectReader(element, where, *faults_, normals[name]));
  }
  return readers;
}

void ObjectReader::fault(std::string_view key, std::string detail) {
  fault_at(pointer(key), std::move(detail));
}

void ObjectReader::fault(std::string detail) { fault_at(pointer_, std::move(detail)); }

void ObjectReader::fault_at(std::string_view pointer, std::string detail) {
  clean_ = false;
  faults_->add(pointer, std::move(detail));
}

std::string ObjectReader::pointer(std::string_view key) const {
  return pointer_ + '/' + pointer_step(key);
}

void ObjectReader::reject_unread_members() {
  const std::vector<std::string_view> known(asked_.begin(), asked_.end());
  for (const auto& [name, member] : value_->items()) {
    if (!asked_.contains(name)) fault(name, "is unknown here; known are " + list_text(known));
  }
}

}  // namespace fstop::api
