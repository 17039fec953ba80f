#include "core/study/verification_report.h"

#include <algorithm>

#include "core/study/svg_writer.h"
#include "core/study/verification_words.h"

namespace fstop {
namespace {

std::string attribute(std::string_view name, const std::string& value) {
  return " " + std::string(name) + "=\"" + xml_escaped(value) + "\"";
}

std::string junit_check(const VerificationOutcome& outcome) {
  const auto red = std::ranges::count_if(outcome.results, [](const auto& r) { return !r.holds(); });
  const bool failed = !outcome.failure.empty();
  std::string xml = "  <testsuite" + attribute("name", outcome.check) +
                    attribute("tests", std::to_string(outcome.results.size() + (failed ? 1 : 0))) +
                    attribute("failures", std::to_string(red)) +
                    attribute("errors", failed ? "1" : "0") + ">\n";
  const std::string group =
      "verify." + std::string(verification_kind_name(outcome.kind)) + "." + outcome.camera;
  for (const VerificationResult& result : outcome.results) {
    xml += "    <testcase" + attribute("classname", group) + attribute("name", result.name) + ">";
    if (!result.holds()) {
      xml += "<failure" + attribute("message", verdict_of(result)) + ">" +
             xml_escaped(numbers_text(result)) + "</failure>";
    }
    xml += "<system-out>" + xml_escaped(numbers_text(result)) + "</system-out></testcase>\n";
  }
  if (failed) {
    xml += "    <testcase" + attribute("classname", group) + attribute("name", "measurement") +
           "><error" + attribute("message", outcome.failure) + "/></testcase>\n";
  }
  return xml + "  </testsuite>\n";
}

}  // namespace

std::string verification_text(const VerificationOutcome& outcome) {
  std::string text;
  for (const VerificationResult& result : outcome.results) {
    text += verdict_of(result) + ": " + outcome.check + ": " + result.name + ": " +
            numbers_text(result) + "\n";
  }
  if (!outcome.failure.empty()) text += "red: " + outcome.check + ": " + outcome.failure + "\n";
  return text;
}

std::string trial_text(const PlantedTrial& trial) {
  std::string text = (trial.is_caught() ? "caught: " : "NOT caught: ") + trial_name(trial) + ": " +
                     std::to_string(trial.red_results()) + " of " +
                     std::to_string(trial.results()) + " results are red";
  std::string checks;
  for (const VerificationOutcome& outcome : trial.outcomes) {
    const bool red = std::ranges::any_of(
        outcome.results, [](const auto& r) { return r.is_decisive() && !r.holds(); });
    if (red) checks += (checks.empty() ? ", of " : ", ") + outcome.check;
  }
  return text + checks + "\n";
}

std::string verification_junit(const VerificationHeading& heading,
                               std::span<const VerificationOutcome> outcomes,
                               std::span<const PlantedTrial> trials) {
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites" +
                    attribute("name", heading.suite + ", " + heading.target) + ">\n";
  for (const VerificationOutcome& outcome : outcomes) xml += junit_check(outcome);
  if (!trials.empty()) {
    const auto missed =
        std::ranges::count_if(trials, [](const auto& trial) { return !trial.is_caught(); });
    xml += "  <testsuite" + attribute("name", "planted errors") +
           attribute("tests", std::to_string(trials.size())) +
           attribute("failures", std::to_string(missed)) + attribute("errors", "0") + ">\n";
    for (const PlantedTrial& trial : trials) {
      xml += "    <testcase" + attribute("classname", "verify.planted") +
             attribute("name", trial_name(trial)) + ">";
      if (!trial.is_caught()) xml += "<failure" + attribute("message", "not caught") + "/>";
      xml += "<system-out>" + xml_escaped(trial_text(trial)) + "</system-out></testcase>\n";
    }
    xml += "  </testsuite>\n";
  }
  return xml + "</testsuites>\n";
}

}  // namespace fstop
