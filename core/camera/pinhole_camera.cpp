#include "core/camera/pinhole_camera.h"

#include "core/error.h"
#include "core/optics/exposure.h"

namespace fstop {

PinholeCamera::PinholeCamera(Length image_distance, Length diameter, const Sensor& sensor,
                             const Pose& world_from_camera)
    : sensor_(sensor),
      world_from_camera_(world_from_camera),
      pupil_radius_(0.5 * diameter.si()),
      image_distance_(image_distance.si()) {
  const bool in_domain = image_distance > Length{} && is_finite(image_distance) &&
                         diameter >= Length{} && is_finite(diameter);
  if (!in_domain) {
    throw Error(ErrorCode::outside_domain, "needs a finite f' > 0 and a finite D >= 0");
  }
}

double PinholeCamera::falloff(Vec2 raster) const noexcept {
  const Vec3 chief = sensor_.upright_point(raster, image_distance_);
  return cosine_fourth(Length::si(std::hypot(chief.x, chief.y)), image_distance());
}

}  // namespace fstop
