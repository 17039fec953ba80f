#include "tests/http/contract.h"

#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "api/contract_schema.h"

namespace fstop::test {
namespace {

using nlohmann::json;

const json& document() {
  static const json parsed = json::parse(api::openapi_json());
  return parsed;
}

std::vector<std::string_view> segments(std::string_view path) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t slash = path.find('/');
    parts.push_back(path.substr(0, slash));
    if (slash == std::string_view::npos) return parts;
    path.remove_prefix(slash + 1);
  }
}

bool fits(std::string_view pattern, std::string_view path) {
  const auto expected = segments(pattern);
  const auto given = segments(path);
  if (expected.size() != given.size()) return false;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const bool is_parameter = expected[i].starts_with('{') && !given[i].empty();
    if (!is_parameter && expected[i] != given[i]) return false;
  }
  return true;
}

const json* operation(std::string_view method, std::string_view path) {
  std::string verb(method == "HEAD" ? "GET" : method);
  for (char& c : verb) c = static_cast<char>(c - 'A' + 'a');
  for (const auto& [pattern, operations] : document().at("paths").items()) {
    if (fits(pattern, path) && operations.contains(verb)) return &operations.at(verb);
  }
  return nullptr;
}

const json& resolved(const json& value) {
  if (!value.contains("$ref")) return value;
  return document().at(json::json_pointer(value.at("$ref").get<std::string>().substr(1)));
}

// Schemas take their time to be read: each once.
std::string objection_of(const std::string& schema, const json& value) {
  static std::mutex mutex;
  static std::map<std::string, api::ContractSchema> schemas;
  const std::lock_guard lock(mutex);
  auto found = schemas.find(schema);
  if (found == schemas.end()) found = schemas.try_emplace(schema, schema).first;
  return found->second.objection(value);
}

}  // namespace

std::string contract_objection(std::string_view method, std::string_view target,
                               const Answer& answer) {
  const std::string_view path = target.substr(0, target.find('?'));
  const json* call = operation(method, path);
  if (call == nullptr) return {};
  const std::string label = std::string(method) + " " + std::string(path) + ": ";
  const json& responses = call->at("responses");
  const std::string status = std::to_string(answer.status);
  const bool is_told = responses.contains(status);
  if (!is_told && answer.status < 400) return label + "no status " + status;
  if (!is_told && !responses.contains("default")) return label + "no status " + status;
  const json& response = resolved(responses.at(is_told ? status : "default"));
  const std::string header = answer.header("content-type");
  const std::string type = header.substr(0, header.find(';'));
  if (!response.contains("content")) return type.empty() ? "" : label + "content of " + status;
  const json& content = response.at("content");
  if (!content.contains(type)) return label + status + " may not be '" + type + "'";
  if (method == "HEAD" || !type.ends_with("json")) return {};
  const json body = json::parse(answer.body, nullptr, false);
  if (body.is_discarded()) return label + "the body is no JSON";
  const json& schema = content.at(type).at("schema");
  if (!schema.contains("$ref")) return {};
  const std::string reference = schema.at("$ref").get<std::string>();
  const std::string objection = objection_of(reference.substr(reference.rfind('/') + 1), body);
  return objection.empty() ? "" : label + objection + "\n" + answer.body.substr(0, 500);
}

}  // namespace fstop::test
