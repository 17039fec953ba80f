#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/length_unit.h"
#include "api/problem.h"
#include "core/geometry.h"

namespace fstop::api {

/// A word of a closed set and what it means.
template <typename Value>
struct Named {
  std::string_view name = {};
  Value value = {};
};

/// Both ends belong to the range. An infinite `max` makes the string "infinity" legal.
struct Range {
  double min = 0.0;
  double max = 0.0;
};

/// Reads one JSON object member by member. Whatever is wrong becomes a fault and reading goes on
/// with a legal placeholder, so that one pass finds all faults. What was read, with defaults for
/// what was absent, is written to `normal`: the normalised form of the object.
/// A member without a fallback is required. No value is converted to another type: 960.0 is an
/// integer, true and "960" are not.
class ObjectReader {
 public:
  /// `pointer`: where `value` stands. `value`, `faults` and `normal` outlive the reader.
  ObjectReader(const nlohmann::json& value, std::string pointer, FaultList& faults,
               nlohmann::json& normal);

  bool has(std::string_view key) const { return value_->contains(std::string(key)); }
  /// True until a fault is recorded through this reader: values can be compared with each other.
  bool clean() const noexcept { return clean_; }

  double number(std::string_view key, Range range, std::optional<double> fallback = {});
  std::int64_t integer(std::string_view key, std::int64_t min, std::int64_t max,
                       std::optional<std::int64_t> fallback = {});
  /// Absent and null are the same.
  std::optional<double> optional_number(std::string_view key, Range range);
  std::optional<std::int64_t> optional_integer(std::string_view key, std::int64_t min,
                                               std::int64_t max);
  bool boolean(std::string_view key, bool fallback);
  std::string text(std::string_view key, std::size_t max_bytes,
                   std::optional<std::string> fallback = {});

  /// In the unit that `key` ends in; max = kInfinitelyFar makes "infinity" legal.
  Length length(std::string_view key, Length min, Length max, std::optional<Length> fallback = {});
  std::array<Length, 2> two_lengths(std::string_view key, Length min, Length max,
                                    std::array<Length, 2> fallback);
  std::vector<Length> lengths(std::string_view key, Length min, Length max, std::size_t most);
  /// A list of at most `most` numbers, each in `range`; absent: `fallback`.
  std::vector<double> numbers(std::string_view key, Range range, std::size_t most,
                              std::vector<double> fallback);
  /// The same of whole numbers.
  std::vector<std::int64_t> integers(std::string_view key, std::int64_t min, std::int64_t max,
                                     std::size_t most, std::vector<std::int64_t> fallback);
  /// Each coordinate in [-bound, bound]; `unit` is for messages ("m", "m/s", "").
  Vec3 vec3(std::string_view key, double bound, std::string_view unit,
            std::optional<Vec3> fallback = {});
  /// Each component in `range`.
  std::array<double, 3> triple(std::string_view key, Range range, std::string_view unit,
                               std::optional<std::array<double, 3>> fallback = {});

  template <typename Value>
  Value choice(std::string_view key, std::span<const Named<Value>> words,
               std::optional<std::string_view> fallback = {}) {
    return words[word_index(key, names_of(words), fallback)].value;
  }
  /// One or more different words, in the order of `words`; `always` is added where absent.
  template <typename Value>
  std::vector<Value> choices(std::string_view key, std::span<const Named<Value>> words,
                             std::string_view always) {
    std::vector<Value> values;
    for (const std::size_t i : word_indices(key, names_of(words), always)) {
      values.push_back(words[i].value);
    }
    return values;
  }

  /// A member that is an object; absent it is read as an empty one.
  ObjectReader object(std::string_view key);
  /// The elements of an array of objects; absent: none.
  std::vector<ObjectReader> objects(std::string_view key, std::size_t most);
  /// The members of an object of objects, sorted by name; absent: none.
  std::vector<std::pair<std::string, ObjectReader>> named_objects(std::string_view key,
                                                                  std::size_t most);

  /// The member as it stands, marked as read and copied to the normal form; null where absent
  /// (which is a fault if `required`).
  const nlohmann::json* value(std::string_view key, bool required);
  /// Leaves `key` out of the normal form: it has no part in what is asked for.
  void leave_out(std::string_view key) { normal_->erase(std::string(key)); }
  void normalise(std::string_view key, nlohmann::json value) { normal(key) = std::move(value); }

  void fault(std::string_view key, std::string detail);
  /// A fault of the object as a whole.
  void fault(std::string detail);
  /// A fault further down: `pointer` begins with this reader's.
  void fault_at(std::string_view pointer, std::string detail);
  std::string pointer(std::string_view key) const;

  /// Call last: members that nothing has asked for are faults.
  void reject_unread_members();

 private:
  template <typename Value>
  static std::vector<std::string_view> names_of(std::span<const Named<Value>> words) {
    std::vector<std::string_view> names;
    for (const Named<Value>& word : words) names.push_back(word.name);
    return names;
  }
  const nlohmann::json* array(std::string_view key, std::size_t most);
  double checked(const nlohmann::json& member, const std::string& where, Range range,
                 std::string_view unit);
  std::vector<double> tuple(std::string_view key, std::size_t count, Range range,
                            std::string_view unit, const std::vector<double>& fallback);
  std::size_t word_index(std::string_view key, const std::vector<std::string_view>& names,
                         std::optional<std::string_view> fallback);
  std::vector<std::size_t> word_indices(std::string_view key,
                                        const std::vector<std::string_view>& names,
                                        std::string_view always);
  nlohmann::json& normal(std::string_view key) { return (*normal_)[std::string(key)]; }

  const nlohmann::json* value_;  // an object, or fstop's own empty one
  std::string pointer_;
  FaultList* faults_;
  nlohmann::json* normal_;
  std::set<std::string, std::less<>> asked_ = {};
  bool clean_ = true;
};

}  // namespace fstop::api
