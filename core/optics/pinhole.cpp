#include "core/optics/pinhole.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace fstop {
namespace {

constexpr double kFirstZeroOfJ1 = 3.8317059702075123;

constexpr PinholeCriterion kCriteria[] = {
    {"brightest", 2.0, "largest intensity on the axis: the hole is one Fresnel zone"},
    {"peak-per-energy", 1.72281083748293, "largest share of the light on the axis"},
    {"energy50", 1.4943832451982, "smallest circle that holds half of the light"},
    {"energy80", 1.79352944, "smallest circle that holds 80 % of the light"},
    {"mtf50", 1.37650584420416, "highest frequency that keeps half of its contrast"},
    {"mtf10", 1.778466, "highest frequency that keeps a tenth of its contrast"},
    {"line-spread", 1.60935352418071, "highest peak of a line's image (area under the MTF)"},
    {"fwhm", 2.217515, "narrowest width at half maximum"},
    {"rayleigh", 1.8973665961010275, "Rayleigh's sqrt(3.6), given by eye"},
    {"petzval", 1.4142135623730951, "Petzval's sqrt(2), confirmed by Mielenz 1999"},
};

void require_positive(std::initializer_list<double> values, const char* message) {
  if (!std::all_of(values.begin(), values.end(), [](double v) { return v > 0.0; })) {
    throw Error(ErrorCode::outside_domain, message);
  }
}

}  // namespace

std::span<const PinholeCriterion> pinhole_criteria() { return kCriteria; }

std::optional<PinholeCriterion> pinhole_criterion(std::string_view name) {
  const auto found =
      std::ranges::find_if(kCriteria, [&](const PinholeCriterion& c) { return c.name == name; });
  if (found == std::end(kCriteria)) return std::nullopt;
  return *found;
}

Length optimal_pinhole_diameter(Length image_distance, Length wavelength, double coefficient,
                                Length object_distance) {
  require_positive({image_distance.si(), wavelength.si(), coefficient, object_distance.si()},
                   "needs f' > 0, lambda > 0, c > 0 and u > 0");
  if (!is_finite(image_distance) || !is_finite(wavelength)) {
    throw Error(ErrorCode::outside_domain, "needs finite f' and lambda");
  }
  return coefficient * sqrt(wavelength / (1.0 / image_distance + 1.0 / object_distance));
}

double fresnel_number(Length diameter, Length image_distance, Length wavelength,
                      Length object_distance) {
  require_positive({diameter.si(), image_distance.si(), wavelength.si(), object_distance.si()},
                   "needs D > 0, f' > 0, lambda > 0 and u > 0");
  const Length radius = diameter / 2.0;
  return (radius / wavelength) * (radius * (1.0 / image_distance + 1.0 / object_distance));
}

Length geometric_spot_diameter(Length diameter, Length image_distance, Length object_distance) {
  require_positive({diameter.si(), image_distance.si(), object_distance.si()},
                   "needs D > 0, f' > 0 and u > 0");
  return diameter * (1.0 + image_distance / object_distance);
}

Length airy_diameter(Length wavelength, double working_f_number) {
  require_positive({wavelength.si(), working_f_number}, "needs lambda > 0 and N_w > 0");
  return 2.0 * (kFirstZeroOfJ1 / std::numbers::pi) * working_f_number * wavelength;
}

}  // namespace fstop
