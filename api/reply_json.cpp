#include "api/reply_json.h"

#include "api/json_text.h"
#include "api/problem.h"

namespace fstop::api {
namespace {

using nlohmann::json;

// A member that is a string, else nothing: the server may be any version, or a proxy before it.
std::string word(const json& object, const char* key) {
  if (!object.is_object()) return {};
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::string problem_line(const json& problem) {
  std::string line = word(problem, "title");
  if (const std::string detail = word(problem, "detail"); !detail.empty()) line += ": " + detail;
  const auto errors = problem.is_object() ? problem.find("errors") : problem.end();
  if (errors == problem.end() || !errors->is_array()) return line;
  for (const json& fault : *errors)
    line += "; " + word(fault, "pointer") + " " + word(fault, "detail");
  return line;
}

}  // namespace

std::string told_problem(std::string_view body) {
  constexpr std::size_t kShown = 1000;
  const json value = json::parse(body, nullptr, false);
  const std::string line = value.is_discarded() ? std::string() : problem_line(value);
  return shortened(line.empty() ? body : std::string_view(line), kShown);
}

ToldJob told_job(std::string_view body) {
  const json value = parse_json(body, Limits{});
  ToldJob job{.state = word(value, "state")};
  if (value.is_object() && value.contains("problem")) job.problem = problem_line(value["problem"]);
  return job;
}

}  // namespace fstop::api
