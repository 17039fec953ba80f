#include "core/optics/exposure.h"

#include <cmath>

#include "core/error.h"

namespace fstop {
namespace {

void require_positive(double working_f_number) {
  if (!(working_f_number > 0.0)) throw Error(ErrorCode::outside_domain, "needs N_w > 0");
}

}  // namespace

double exposure_factor(double shutter_seconds, double iso, double working_f_number) {
  const double factor =
      8000.0 * shutter_seconds * (iso / 100.0) / (working_f_number * working_f_number);
  const bool positive = shutter_seconds > 0.0 && iso > 0.0 && working_f_number > 0.0;
  if (!positive || !(factor > 0.0 && std::isfinite(factor))) {
    throw Error(ErrorCode::outside_domain,
                "needs a positive shutter time (s), ISO speed and working f-number");
  }
  return factor;
}

double relative_illuminance_on_axis(double working_f_number) {
  require_positive(working_f_number);
  return 1.0 / (4.0 * working_f_number * working_f_number + 1.0);
}

double relative_illuminance(double working_f_number, Length height, Length image_distance) {
  require_positive(working_f_number);
  if (!(image_distance > Length{} && abs(height) >= Length{})) {
    throw Error(ErrorCode::outside_domain, "needs v > 0 and a height that is a number");
  }
  const double t2 = std::pow(height / image_distance, 2);
  const double a2 = 1.0 / (4.0 * working_f_number * working_f_number);
  const double q = 1.0 + t2 - a2;
  // (1 - q/r)/2 loses all digits for a small pupil; r^2 - q^2 = 4 a^2 makes it a quotient.
  const double r = std::sqrt(q * q + 4.0 * a2);
  return q > 0.0 ? 2.0 * a2 / (r * (r + q)) : 0.5 * (1.0 - q / r);
}

double cosine_fourth(Length height, Length image_distance) {
  const double tangent = height / image_distance;
  const double cosine_squared = 1.0 / (1.0 + tangent * tangent);
  return cosine_squared * cosine_squared;
}

}  // namespace fstop
