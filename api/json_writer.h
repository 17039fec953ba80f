#pragma once

#include <string_view>

#include <nlohmann/json.hpp>

#include "core/camera/optical_summary.h"
#include "core/render/simulation.h"

namespace fstop::api {

/// Answers keep their members in the order of the contract.
using Json = nlohmann::ordered_json;

/// `value` as JSON: infinity is the string "infinity".
/// Throws: Error{internal} for NaN and minus infinity, which no answer may hold.
Json number_json(double value);

/// Sets member `key` of `object` to `value` in the unit that `key` ends in.
void put_length(Json& object, std::string_view key, Length value);

/// The members of a report's "optics", and the first of an optics answer.
Json optics_members(const OpticalSummary& summary);

Json model_json(const std::vector<ModelledEffect>& model);
Json passed_over_json(const std::vector<PassedOverMethod>& passed_over);

}  // namespace fstop::api
