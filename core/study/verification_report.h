#pragma once

#include <span>
#include <string>

#include "core/study/verification.h"
#include "core/study/verification_self_test.h"

namespace fstop {

/// What stands above a report.
struct VerificationHeading {
  std::string suite = {};   // its title
  std::string target = {};  // "this program", or the server's URL
  std::string engine = {};
};

/// One line for each result: verdict, name, measured, expected, tolerance and its shares; failures
/// in a line of their own.
std::string verification_text(const VerificationOutcome& outcome);
std::string trial_text(const PlantedTrial& trial);

/// JUnit XML: a test suite for each check, a test case for each result, the numbers in its output;
/// red results are failures, checks without results errors. A trial is a test case that fails
/// where the planted error was not caught.
std::string verification_junit(const VerificationHeading& heading,
                               std::span<const VerificationOutcome> outcomes,
                               std::span<const PlantedTrial> trials);

/// One self-contained page: tables with every tolerance, a plot for every curve and the first
/// picture of every check, embedded; no script, no foreign host, light and dark by the reader's
/// preference.
std::string verification_html(const VerificationHeading& heading,
                              std::span<const VerificationOutcome> outcomes,
                              std::span<const PlantedTrial> trials);

/// The curve as an SVG document: closed forms joined by a line, measurements as circles, on white.
std::string verification_plot(const VerificationCurve& curve);

}  // namespace fstop
