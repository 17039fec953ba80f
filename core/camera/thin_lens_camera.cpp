#include "core/camera/thin_lens_camera.h"

#include "core/error.h"
#include "core/optics/exposure.h"

namespace fstop {

ThinLensCamera::ThinLensCamera(const ThinLens& lens, Length focus_distance, const Sensor& sensor,
                               const Pose& world_from_camera)
    : ThinLensCamera(lens, focus_distance, fstop::image_distance(lens.focal_length, focus_distance),
                     sensor, world_from_camera) {}

ThinLensCamera::ThinLensCamera(const ThinLens& lens, Length focus_distance, Length sensor_distance,
                               const Sensor& sensor, const Pose& world_from_camera)
    : sensor_(sensor),
      world_from_camera_(world_from_camera),
      pupil_radius_(0.5 * aperture_diameter(lens).si()),
      image_distance_(sensor_distance.si()),
      focus_vergence_((1.0 / focus_distance).si()) {
  if (!(focus_distance > lens.focal_length)) {
    throw Error(ErrorCode::outside_domain, "needs the focus distance beyond the focal length");
  }
}

double ThinLensCamera::falloff(Vec2 raster) const noexcept {
  const Vec3 chief = sensor_.upright_point(raster, image_distance_);
  return cosine_fourth(Length::si(std::hypot(chief.x, chief.y)), image_distance());
}

}  // namespace fstop
