#pragma once

#include <string>

#include <nlohmann/json.hpp>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

#include "api/openapi.h"

namespace fstop::api {

/// One schema of the served contract, for tests: what it says of a JSON value.
class ContractSchema {
 public:
  /// `name`: a member of components.schemas.
  explicit ContractSchema(const std::string& name) {
    // The document's references are pointers from its root, so the root comes along.
    nlohmann::json root = nlohmann::json::parse(openapi_json());
    root["$ref"] = "#/components/schemas/" + name;
    valijson::SchemaParser parser(valijson::SchemaParser::kDraft7);
    parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(root), schema_);
  }

  /// Empty if `value` is valid, else the first reason against it.
  std::string objection(const nlohmann::json& value) const {
    valijson::Validator validator;
    valijson::ValidationResults results;
    const valijson::adapters::NlohmannJsonAdapter target(value);
    if (validator.validate(schema_, target, &results)) return {};
    valijson::ValidationResults::Error error;
    std::string text = "refused";
    while (results.popError(error)) {
      std::string where;
      for (const std::string& step : error.context) where += step;
      text += "\n" + where + ": " + error.description;
    }
    return text;
  }

 private:
  valijson::Schema schema_ = {};
};

}  // namespace fstop::api
