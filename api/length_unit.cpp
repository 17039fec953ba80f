#include "api/length_unit.h"

#include <array>
#include <charconv>
#include <cmath>

#include "core/error.h"

namespace fstop::api {
namespace {

constexpr std::array<LengthUnit, 4> kUnits = {{{"mm", 1e3}, {"um", 1e6}, {"nm", 1e9}, {"m", 1.0}}};

double rounded(double number, int digits) {
  std::array<char, 40> text = {};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number,
                                 std::chars_format::scientific, digits - 1);
  double result = 0.0;
  std::from_chars(text.data(), end.ptr, result);
  return result;
}

}  // namespace

double LengthUnit::number(Length length) const {
  const double product = length.si() * per_metre;
  if (!std::isfinite(product)) return product;
  // The product is off by up to an ulp: 0.0023 m would read 2.3000000000000003 mm.
  const double decimal = rounded(product, 15);
  return this->length(decimal) == length ? decimal : product;
}

std::string LengthUnit::text(Length length) const {
  if (!is_finite(length)) return number_text(length.si());
  return number_text(number(length)) + " " + std::string(symbol);
}

const LengthUnit& unit_of_suffix(std::string_view key) {
  for (const LengthUnit& unit : kUnits) {
    if (key.ends_with("_" + std::string(unit.symbol))) return unit;
  }
  throw Error(ErrorCode::internal, "no unit of length in the name " + std::string(key));
}

std::string number_text(double number) {
  if (std::isinf(number)) return number > 0.0 ? "infinity" : "-infinity";
  std::array<char, 40> text = {};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), number, std::chars_format::general, 10);
  return {text.data(), end.ptr};
}

}  // namespace fstop::api
