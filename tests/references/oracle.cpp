#include "tests/references/oracle.h"

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

namespace fstop::oracle {

nlohmann::json fixture(std::string_view name) {
  const std::string path = std::string(FSTOP_ORACLE_DIR) + "/" + std::string(name) + ".json";
  std::ifstream file(path);
  if (!file) {
    throw std::runtime_error("cannot read the reference numbers " + path +
                             ": give their folder to CMake as -DFSTOP_ORACLE_DIR=FOLDER");
  }
  try {
    return nlohmann::json::parse(file);
  } catch (const nlohmann::json::exception& fault) {
    throw std::runtime_error(path + ": " + fault.what());
  }
}

double number(const nlohmann::json& value) {
  if (value.is_number()) return value.get<double>();
  if (value == "inf") return std::numeric_limits<double>::infinity();
  throw std::runtime_error("neither a number nor \"inf\" in a fixture: " + value.dump());
}

Length millimetres(const nlohmann::json& value) { return Length::si(number(value) / 1e3); }

double relative_difference(double actual, double expected) {
  if (actual == expected) return 0.0;
  return std::abs(actual - expected) / std::abs(expected);
}

double chi_square_tail(double chi_square, int degrees_of_freedom) {
  const double y = 0.5 * chi_square;
  const bool odd = degrees_of_freedom % 2 != 0;
  double tail = odd ? std::erfc(std::sqrt(y)) : std::exp(-y);
  for (double a = odd ? 0.5 : 1.0; 2.0 * a < degrees_of_freedom; a += 1.0) {
    tail += std::exp(a * std::log(y) - y - std::lgamma(a + 1.0));
  }
  return tail;
}

double sidak_significance(int tests) { return -std::expm1(std::log(0.99) / tests); }

double normal_bound(double significance) {
  // erfc falls steadily: halve the interval that holds the answer.
  double low = 0.0;
  double high = 40.0;
  for (int i = 0; i < 64; ++i) {
    const double middle = 0.5 * (low + high);
    (std::erfc(middle / std::numbers::sqrt2) > significance ? low : high) = middle;
  }
  return low;
}

}  // namespace fstop::oracle
