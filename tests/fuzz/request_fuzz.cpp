// Bodies: JSON text to a checked request. What is accepted is accepted again once it is normalised,
// as the same; what is refused has a problem document that names its places.
#include <string>

#include <nlohmann/json.hpp>

#include "api/json_text.h"
#include "api/problem.h"
#include "api/render_request.h"
#include "api/scene_json.h"
#include "core/error.h"
#include "tests/fuzz/fuzz_target.h"

namespace fstop::test {
namespace {

const api::Limits& limits() {
  static const api::Limits limits;
  return limits;
}

void read_render(std::string_view text) {
  const auto read = [](std::string_view body) {
    return api::parse_render_request(body, limits(), api::SceneNames::stored_only);
  };
  const api::RenderRequest request = read(text);
  const api::RenderRequest again = read(request.normalised);
  require(again.canonical == request.canonical, "normalised is the same request");
  require(again.normalised == request.normalised, "normalised is normal");
}

void read_scene(std::string_view text) {
  const api::SceneDocument document = api::parse_scene_text(text, limits());
  const api::SceneDocument again = api::parse_scene_text(document.canonical, limits());
  require(again.canonical == document.canonical, "canonical is the same scene");
}

void check_problem(const Error& error) {
  const api::Problem problem = api::problem(error);
  require(problem.status == 400 || problem.status == 422, "bodies are refused by 400 or 422");
  const std::string text = api::to_json(problem);
  require(text.size() <= limits().problem_bytes, "problem documents are short");
  const nlohmann::json document = nlohmann::json::parse(text);
  require(document.at("status") == problem.status, "the document tells the status");
  for (const api::FieldFault& fault : problem.errors)
    require(fault.pointer.starts_with('#'), "every fault has its place");
}

}  // namespace
}  // namespace fstop::test

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fstop::test;
  Input input(data, size);
  const unsigned kind = input.choice();
  try {
    kind % 2 == 0 ? read_render(input.text()) : read_scene(input.text());
  } catch (const fstop::Error& error) {
    check_problem(error);
  }
  return 0;
}
