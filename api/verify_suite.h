#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "api/limits.h"
#include "core/study/verification.h"
#include "core/study/verification_report.h"

namespace fstop::api {

/// The checks that `fstop verify` runs.
struct VerifySuite {
  std::string title = {};
  std::vector<VerificationCheck> checks = {};
};

/// Reads a suite ("format": "fstop-suite/1", schema: suite_schema_json()). Members that a check's
/// kind has no use for are faults, as is a camera without the lens or the pinhole that it needs.
/// Throws: InvalidRequest with every fault; malformed_json where the text is not JSON.
VerifySuite parse_verify_suite(std::string_view text, const Limits& limits);

/// api/suites/default.json and api/suites/suite.schema.json, part of the program.
std::string_view default_suite_json();
std::string_view suite_schema_json();

}  // namespace fstop::api
