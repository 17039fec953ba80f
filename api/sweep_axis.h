#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/json_reader.h"
#include "api/limits.h"
#include "core/study/sweep_range.h"

namespace fstop::api {

/// A member of a render request and the values that it takes.
struct AxisValues {
  std::string where = {};   // of the axis in the sweep's request: "#/axes/1"
  std::string member = {};  // a JSON pointer, "/camera/lens/f_number"
  bool is_listed = false;   // its values stand in the request, one by one
  std::vector<nlohmann::json> values = {};

  /// Where value `i` stands, or what made it.
  std::string pointer_of(std::size_t i) const {
    return is_listed ? where + "/values/" + std::to_string(i) : where;
  }
};

/// Reads the axes of a sweep; faults go to the reader's list. No two set the same member, or one a
/// part of another's.
std::vector<AxisValues> read_axes(ObjectReader& root, const Limits& limits);

/// The same of one range, for a recipe: `range` has no objection, or its fault is added to `root`
/// as that of `key`.
AxisValues range_axis(ObjectReader& root, std::string_view key, std::string member,
                      const SweepRange& range, const Limits& limits);

/// `pointer` as a URI fragment: "/a b" becomes "#/a%20b".
std::string fragment_of(const std::string& pointer);

/// Sets the member of `request` that `pointer` names, making the objects above it that are absent.
/// Nothing, or why that cannot be.
std::string set_member(nlohmann::json& request, const std::string& pointer,
                       const nlohmann::json& value);

}  // namespace fstop::api
