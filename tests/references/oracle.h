#pragma once

#include <string_view>

#include <nlohmann/json.hpp>

#include "core/units.h"

/// What results are compared with: numbers that were computed elsewhere, and distributions that
/// random results follow.
namespace fstop::oracle {

/// The fixture NAME.json of the folder FSTOP_ORACLE_DIR.
/// Throws: std::runtime_error naming the file and the setting if it is missing or not JSON.
nlohmann::json fixture(std::string_view name);

/// A number of a fixture; the string "inf" is infinity. Throws: std::runtime_error otherwise.
double number(const nlohmann::json& value);

/// A length that a fixture gives in millimetres.
Length millimetres(const nlohmann::json& value);

/// |actual - expected| over |expected|; 0 where they are equal, infinity included.
double relative_difference(double actual, double expected);

/// The probability that chi-square with `degrees_of_freedom` exceeds `chi_square`:
///
///     Q(k/2, x/2),   Q(a + 1, y) = Q(a, y) + y^a e^-y / Gamma(a + 1),
///     Q(1/2, y) = erfc(sqrt(y)),   Q(1, y) = e^-y
///
/// Source: Abramowitz & Stegun 1964, 26.4.4, 26.4.5.
double chi_square_tail(double chi_square, int degrees_of_freedom);

/// The significance of each of `tests` independent tests that are to raise a false alarm with
/// probability 0.01 all together: 1 - 0.99^(1/tests). Source: Sidak 1967.
double sidak_significance(int tests);

/// The distance from the mean, in standard deviations, that a normal variable exceeds to either
/// side with probability `significance`.
double normal_bound(double significance);

}  // namespace fstop::oracle
