#include "core/geometry.h"

#include "core/error.h"

namespace fstop {

Pose Pose::looking_at(Vec3 position, Vec3 target, Vec3 up) {
  const Vec3 sight = target - position;
  const Vec3 right = cross(sight, up);
  // The sine of the angle between sight and up: below 1e-9 the image's up is rounding noise.
  const double sine = norm(right) / (norm(sight) * norm(up));
  if (!(sine > 1e-9)) {
    throw Error(ErrorCode::outside_domain,
                "needs look_at different from position and up not parallel to the line of sight");
  }
  Pose pose;
  pose.position_ = position;
  pose.forward_ = normalized(sight);
  pose.right_ = normalized(right);
  pose.down_ = cross(pose.forward_, pose.right_);
  return pose;
}

}  // namespace fstop
