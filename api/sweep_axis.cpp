#include "api/sweep_axis.h"

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "api/json_text.h"
#include "core/study/sweep_range.h"

namespace fstop::api {
namespace {

using nlohmann::json;

constexpr std::size_t kPointerBytes = 512;
constexpr Range kAnyNumber{-1e300, 1e300};
constexpr Named<Spacing> kSpacings[] = {{"linear", Spacing::linear},
                                        {"log", Spacing::log},
                                        {"reciprocal", Spacing::reciprocal},
                                        {"third-stop", Spacing::third_stop}};

// As JSON has it: a whole number is one, so that ranges serve members that must be whole.
json number_value(double number) {
  if (std::isinf(number)) return "infinity";
  constexpr double kExact = 9007199254740992.0;  // 2^53
  if (number == std::floor(number) && std::abs(number) < kExact)
    return static_cast<std::int64_t>(number);
  return number;
}

double range_end(ObjectReader& reader, std::string_view key, bool may_be_infinite) {
  const double most = may_be_infinite ? std::numeric_limits<double>::infinity() : kAnyNumber.max;
  return reader.number(key, {kAnyNumber.min, most});
}

SweepRange read_range(ObjectReader& reader, const Limits& limits) {
  SweepRange range;
  range.spacing = reader.choice<Spacing>("spacing", kSpacings, "linear");
  const bool may_be_infinite = range.spacing == Spacing::reciprocal;
  range.from = range_end(reader, "from", may_be_infinite);
  range.to = range_end(reader, "to", may_be_infinite);
  if (const auto count =
          reader.optional_integer("count", 1, static_cast<std::int64_t>(limits.sweep_cells))) {
    range.count = static_cast<int>(*count);
  } else {
    reader.leave_out("count");
  }
  range.step = reader.optional_number("step", kAnyNumber);
  if (!range.step) reader.leave_out("step");
  reader.reject_unread_members();
  if (!reader.clean()) return range;
  if (const std::string why = objection(range); !why.empty()) reader.fault(why);
  return range;
}

std::string count_text(double count) {
  return count < 1e15 ? std::to_string(static_cast<std::int64_t>(count)) : number_text(count);
}

std::vector<json> range_values(const SweepRange& range) {
  std::vector<json> values;
  for (const double number : values_of(range)) values.push_back(number_value(number));
  return values;
}

void read_member(ObjectReader& reader, AxisValues& axis) {
  std::string member = reader.text("member", kPointerBytes);
  if (!reader.clean()) return;
  if (member.starts_with("#/")) member.erase(0, 1);
  json ignored = json::object();
  try {
    if (json::json_pointer(member).empty()) {
      return reader.fault("member", "must name a member of the base, not all of it");
    }
  } catch (const json::exception&) {
    return reader.fault("member",
                        "must be a JSON pointer (RFC 6901) such as "
                        "/camera/lens/f_number");
  }
  axis.member = std::move(member);
  reader.normalise("member", axis.member);
}

AxisValues read_axis(ObjectReader& reader, const std::string& where, const Limits& limits) {
  AxisValues axis{.where = where};
  read_member(reader, axis);
  const json* values = reader.value("values", false);
  const bool has_range = reader.value("range", false) != nullptr;
  if ((values != nullptr) == has_range) {
    reader.fault("needs either values or range");
  } else if (has_range) {
    ObjectReader inner = reader.object("range");
    const SweepRange range = read_range(inner, limits);
    if (inner.clean() && value_count(range) > static_cast<double>(limits.sweep_cells)) {
      reader.fault("range", "has " + count_text(value_count(range)) + " values; at most " +
                                std::to_string(limits.sweep_cells) + " are allowed");
    } else if (inner.clean()) {
      axis.values = range_values(range);
    }
  } else if (!values->is_array() || values->empty() || values->size() > limits.sweep_cells) {
    reader.fault("values",
                 "must be an array of 1 to " + std::to_string(limits.sweep_cells) + " values");
  } else {
    axis.is_listed = true;
    axis.values.assign(values->begin(), values->end());
  }
  reader.reject_unread_members();
  return axis;
}

bool lies_below(const std::string& member, const std::string& above) {
  return member == above || member.starts_with(above + "/");
}

}  // namespace

std::vector<AxisValues> read_axes(ObjectReader& root, const Limits& limits) {
  std::vector<AxisValues> axes;
  for (ObjectReader& reader : root.objects("axes", limits.sweep_axes)) {
    const std::string where = root.pointer("axes") + "/" + std::to_string(axes.size());
    axes.push_back(read_axis(reader, where, limits));
    const std::string& member = axes.back().member;
    for (std::size_t i = 0; i + 1 < axes.size() && !member.empty(); ++i) {
      const std::string& other = axes[i].member;
      if (other.empty() || (!lies_below(member, other) && !lies_below(other, member))) continue;
      reader.fault("member", "sets what axis " + std::to_string(i) + " sets, " + other);
    }
  }
  return axes;
}

AxisValues range_axis(ObjectReader& root, std::string_view key, std::string member,
                      const SweepRange& range, const Limits& limits) {
  AxisValues axis{.where = root.pointer(key), .member = std::move(member)};
  if (!root.clean()) return axis;
  if (const std::string why = objection(range); !why.empty()) {
    root.fault(key, why);
  } else if (value_count(range) > static_cast<double>(limits.sweep_cells)) {
    root.fault(key, "makes " + count_text(value_count(range)) + " cells; at most " +
                        std::to_string(limits.sweep_cells) + " are allowed");
  } else {
    axis.values = range_values(range);
  }
  return axis;
}

std::string fragment_of(const std::string& pointer) {
  std::string fragment = "#";
  // Steps escape "~" and "/" in both forms.
  for (json::json_pointer rest(pointer); !rest.empty(); rest.pop_back()) {
    fragment.insert(1, "/" + pointer_step(rest.back()));
  }
  return fragment;
}

std::string set_member(json& request, const std::string& pointer, const json& value) {
  const json::json_pointer whole(pointer);
  json* place = &request;
  std::vector<std::string> steps;
  for (json::json_pointer rest = whole; !rest.empty(); rest.pop_back())
    steps.push_back(rest.back());
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    if (place->is_null()) *place = json::object();
    if (place->is_object()) {
      place = &(*place)[*step];
    } else if (place->is_array()) {
      const json::json_pointer index("/" + *step);
      if (!place->contains(index)) return "names an element that the base does not have";
      place = &place->at(index);
    } else {
      return "leads through a " + std::string(place->type_name());
    }
  }
  *place = value;
  return {};
}

}  // namespace fstop::api
