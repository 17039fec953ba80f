#pragma once

#include <string>

#include "core/study/verification.h"
#include "core/study/verification_self_test.h"

namespace fstop {

/// The parts that all reports of a verification are put together from.
std::string number_text(double value, int digits = 6);
std::string with_unit(double value, const std::string& unit, int digits = 6);
/// "sampling noise 0.0012 + single precision 1e-07".
std::string shares_text(const VerificationResult& result);
/// "green", "red", or "red, too noisy to tell".
std::string verdict_of(const VerificationResult& result);
/// Measured, expected, difference and tolerance with its shares.
std::string numbers_text(const VerificationResult& result);
/// "focal length +1 %".
std::string trial_name(const PlantedTrial& trial);

}  // namespace fstop
