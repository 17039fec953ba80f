#include "core/optics/thin_lens.h"

#include <cmath>

#include "core/error.h"

namespace fstop {
namespace {

void require_focusable(Length focal_length, Length focus_distance) {
  if (!(focal_length > Length{} && focus_distance > focal_length)) {
    throw Error(ErrorCode::outside_domain, "needs f > 0 and s > f");
  }
}

}  // namespace

Length aperture_diameter(const ThinLens& lens) {
  if (!(lens.focal_length > Length{} && lens.f_number > 0.0)) {
    throw Error(ErrorCode::outside_domain, "needs f > 0 and N > 0");
  }
  return lens.focal_length / lens.f_number;
}

Length image_distance(Length focal_length, Length object_distance) {
  if (!(focal_length > Length{} && object_distance > Length{})) {
    throw Error(ErrorCode::outside_domain, "needs f > 0 and u > 0");
  }
  return 1.0 / vergence_difference(focal_length, object_distance);
}

double magnification(Length focal_length, Length focus_distance) {
  require_focusable(focal_length, focus_distance);
  return focal_length / (focal_length - focus_distance);
}

double working_f_number(const ThinLens& lens, Length focus_distance) {
  if (!(lens.f_number > 0.0)) throw Error(ErrorCode::outside_domain, "needs N > 0");
  return lens.f_number * (1.0 + std::abs(magnification(lens.focal_length, focus_distance)));
}

Length signed_circle_of_confusion(const ThinLens& lens, Length focus_distance,
                                  Length object_distance) {
  require_focusable(lens.focal_length, focus_distance);
  return signed_circle_of_confusion(lens, focus_distance, object_distance,
                                    image_distance(lens.focal_length, focus_distance));
}

Length signed_circle_of_confusion(const ThinLens& lens, Length focus_distance,
                                  Length object_distance, Length sensor_distance) {
  require_focusable(lens.focal_length, focus_distance);
  if (!(object_distance > Length{})) throw Error(ErrorCode::outside_domain, "needs d > 0");
  return aperture_diameter(lens) *
         (sensor_distance * vergence_difference(focus_distance, object_distance));
}

Length circle_of_confusion(const ThinLens& lens, Length focus_distance, Length object_distance) {
  return abs(signed_circle_of_confusion(lens, focus_distance, object_distance));
}

Vergence vergence_difference(Length a, Length b) {
  // The quotient keeps all digits where a is close to b, the difference loses half of them.
  const bool finite = a < kInfinitelyFar && b < kInfinitelyFar;
  return finite ? (b - a) / (a * b) : 1.0 / a - 1.0 / b;
}

double view_angle(Length extent, Length image_distance) {
  return 2.0 * std::atan(extent / (2.0 * image_distance));
}

}  // namespace fstop
