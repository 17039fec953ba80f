#include "core/study/verification_words.h"

#include <cmath>
#include <cstdio>

namespace fstop {

std::string number_text(double value, int digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

std::string with_unit(double value, const std::string& unit, int digits) {
  return unit.empty() ? number_text(value, digits) : number_text(value, digits) + " " + unit;
}

std::string shares_text(const VerificationResult& result) {
  std::string text;
  for (const ToleranceShare& share : result.shares) {
    if (share.size <= 0.0) continue;
    text += (text.empty() ? "" : " + ") + share.cause + " " + number_text(share.size, 2);
  }
  return text.empty() ? "none" : text;
}

std::string verdict_of(const VerificationResult& result) {
  if (result.holds()) return "green";
  return result.is_decisive() ? "red" : "red, too noisy to tell";
}

std::string numbers_text(const VerificationResult& result) {
  std::string text = "measured " + with_unit(result.measured, result.unit) + ", expected " +
                     number_text(result.expected) + ", off by " +
                     number_text(result.measured - result.expected, 2) + " of +-" +
                     number_text(result.tolerance(), 2) + " (" + shares_text(result) + ")";
  if (!result.is_decisive()) {
    text += ", a tolerance beyond the " + number_text(result.largest_tolerance, 2) +
            " that still tell something";
  }
  return text;
}

std::string trial_name(const PlantedTrial& trial) {
  return std::string(planted_error_name(trial.error)) + (trial.factor > 1.0 ? " +" : " -") +
         number_text(100.0 * std::abs(trial.factor - 1.0), 3) + " %";
}

}  // namespace fstop
