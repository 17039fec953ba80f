#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/http/dice.h"

namespace fstop::test {

/// A place of a value and what the contract says of it.
struct Site {
  std::string pointer = {};                // RFC 6901, from the value's root
  const nlohmann::json* schema = nullptr;  // as referred to: with all its alternatives
  const nlohmann::json* chosen = nullptr;  // the alternative that was taken
  bool is_required = false;
};

/// A random value that its schema admits, and its places.
struct SchemaValue {
  nlohmann::json value = {};
  std::vector<Site> sites = {};
};

/// A value of components.schemas.`name`. Numbers tend to the ends of their ranges; arrays and maps
/// are short; names of materials and textures are taken from few, so that some are there.
SchemaValue value_of_schema(const std::string& name, Dice& dice);

/// One violation of the contract.
struct Violation {
  nlohmann::json value = {};
  std::string pointer = {};  // of what violates it
  std::string what = {};
};

/// `valid` with one thing in it made wrong.
Violation violation_of(const SchemaValue& valid, Dice& dice);

}  // namespace fstop::test
