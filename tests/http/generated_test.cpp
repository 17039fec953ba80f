// Bodies made from the contract's own schemas. What the contract admits is answered, or refused at
// a place that is there; what it does not is refused at the place that is wrong.
#include <cstdlib>
#include <map>
#include <ostream>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/contract_schema.h"
#include "tests/http/http_client.h"
#include "tests/http/schema_values.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

using nlohmann::json;

struct Operation {
  std::string target;
  std::string schema;
  std::set<int> statuses;  // that the contract tells of
};

std::ostream& operator<<(std::ostream& stream, const Operation& operation) {
  return stream << operation.target;
}

std::vector<Operation> operations() {
  std::vector<Operation> found;
  const json document = json::parse(api::openapi_json());
  for (const auto& [path, methods] : document.at("paths").items()) {
    if (!methods.contains("post")) continue;
    const json& call = methods.at("post");
    const std::string reference = call.at("requestBody")
                                      .at("content")
                                      .at("application/json")
                                      .at("schema")
                                      .at("$ref")
                                      .get<std::string>();
    // Of pictures and ids, which no generator draws.
    if (path == "/v1/measurements" || path == "/v1/composites") continue;
    if (path == "/v1/sweeps") continue;  // of pointers into their own base
    Operation operation{path, reference.substr(reference.rfind('/') + 1), {}};
    for (const auto& [status, response] : call.at("responses").items()) {
      if (status != "default") operation.statuses.insert(std::stoi(status));
    }
    found.push_back(std::move(operation));
  }
  return found;
}

// FSTOP_GENERATED sets how many of each kind: ./dev campaign generated asks for more.
int count_of_each() {
  const char* wanted = std::getenv("FSTOP_GENERATED");
  return wanted == nullptr ? 60 : std::atoi(wanted);
}

// Renders of moments; their time is for other tests.
TestServer::Options quick() {
  TestServer::Options options;
  options.limits.render_time = std::chrono::milliseconds(1000);
  options.limits.chart_time = std::chrono::milliseconds(1000);
  return options;
}

// Makes what is random small, where it is there, and the pixels square: else nothing would render.
void make_cheap(json& body, Dice& dice) {
  if (!body.is_object()) return;
  const auto has = [](const json& value, const char* name) {
    return value.is_object() && value.contains(name);
  };
  if (dice.one_in(4)) return;
  if (has(body, "camera") && has(body["camera"], "sensor_mm")) body["camera"].erase("sensor_mm");
  body["image"]["width"] = 9;
  body["image"]["height"] = 6;
  if (has(body, "quality") && has(body["quality"], "samples")) body["quality"]["samples"] = 4;
  if (has(body, "samples")) body["samples"] = {1, 2};
  if (has(body, "reference")) body["reference"] = {{"samples", 2}, {"replicates", 2}};
}

class Generated : public testing::TestWithParam<Operation> {
 protected:
  static void SetUpTestSuite() { server_ = new TestServer(quick()); }
  static void TearDownTestSuite() {
    delete server_;
    server_ = nullptr;
  }
  static Answer answer(const json& body) {
    const Headers headers = {{"Prefer", "wait=5"}, {"Accept", "application/json"}};
    return ask(server_->port(), "POST", GetParam().target, headers, body.dump());
  }
  static TestServer* server_;
};
TestServer* Generated::server_ = nullptr;

std::string unescaped(std::string_view fragment) {
  std::string text;
  for (std::size_t i = 1; i < fragment.size(); ++i) {
    if (fragment[i] == '%') {
      text += static_cast<char>(std::stoi(std::string(fragment.substr(i + 1, 2)), nullptr, 16));
      i += 2;
    } else {
      text += fragment[i];
    }
  }
  return text;
}

// A place in the body, or a member that its object does not have.
bool exists(const json& body, std::string_view fragment) {
  if (!fragment.starts_with('#')) return false;
  const json::json_pointer pointer(unescaped(fragment));
  return body.contains(pointer) || pointer.empty() || body.contains(pointer.parent_pointer());
}

TEST_P(Generated, WhatTheContractAdmitsIsAnsweredOrRefusedAtAPlaceThatIsThere) {
  const api::ContractSchema schema(GetParam().schema);
  Dice dice(std::hash<std::string>()(GetParam().target));
  std::map<int, int> statuses;
  for (int i = 0; i < count_of_each(); ++i) {
    json body = value_of_schema(GetParam().schema, dice).value;
    make_cheap(body, dice);
    ASSERT_EQ(schema.objection(body), "") << body;
    const Answer reply = answer(body);
    ++statuses[reply.status / 100];
    ASSERT_TRUE(GetParam().statuses.contains(reply.status))
        << i << ": " << reply.status << ' ' << reply.body << '\n'
        << body;
    if (reply.status < 400) continue;
    if (reply.status == 504) continue;  // a second was not enough
    ASSERT_LT(reply.status, 500) << i << ": " << reply.body << '\n' << body;
    const json problem = json::parse(reply.body);
    const json errors = problem.value("errors", json::array());
    for (const json& error : errors) {
      EXPECT_TRUE(exists(body, error.at("pointer").get<std::string>()))
          << i << ": " << error << '\n'
          << body;
    }
  }
  EXPECT_GE(statuses[2], count_of_each() / 10) << "hardly any was answered";
}

TEST_P(Generated, WhatViolatesTheContractIsRefusedAtThatPlace) {
  Dice dice(1 + std::hash<std::string>()(GetParam().target));
  const api::ContractSchema schema(GetParam().schema);
  std::map<std::string, int> kinds;
  for (int i = 0; i < count_of_each(); ++i) {
    const SchemaValue valid = value_of_schema(GetParam().schema, dice);
    const Violation wrong = violation_of(valid, dice);
    ASSERT_NE(schema.objection(wrong.value), "") << wrong.what << '\n' << wrong.value;
    const Answer reply = answer(wrong.value);
    ASSERT_EQ(reply.status, 422) << i << ": " << reply.body << '\n' << wrong.value;
    const json errors = json::parse(reply.body).value("errors", json::array());
    bool is_told = false;
    for (const json& error : errors) is_told = is_told || error.at("pointer") == wrong.pointer;
    EXPECT_TRUE(is_told) << i << ": " << wrong.what << " at " << wrong.pointer << ": " << reply.body
                         << '\n'
                         << wrong.value;
    ++kinds[wrong.what];
  }
  EXPECT_GE(kinds.size(), 5U);
}

INSTANTIATE_TEST_SUITE_P(Operations, Generated, testing::ValuesIn(operations()),
                         [](const auto& each) { return each.param.schema; });

}  // namespace
}  // namespace fstop::test
