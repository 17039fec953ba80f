#pragma once

#include <string>
#include <string_view>

#include "core/units.h"

namespace fstop::api {

/// The unit a JSON member's name ends in ("focal_length_mm"): the one place where millimetres
/// become metres and metres millimetres.
struct LengthUnit {
  std::string_view symbol = {};  // "mm"
  double per_metre = 1.0;

  /// Divides, as the literals do: 35 mm is 0.035 m to the last bit.
  Length length(double number) const { return Length::si(number / per_metre); }

  /// The number of these units: the shortest decimal that gives back the same length.
  double number(Length length) const;

  /// "35 mm", "infinity".
  std::string text(Length length) const;
};

/// m, mm, um or nm by the end of `key`. Throws: Error{internal} for any other name.
const LengthUnit& unit_of_suffix(std::string_view key);

/// At most ten digits, as messages quote limits; "infinity" for infinity.
std::string number_text(double number);

}  // namespace fstop::api
