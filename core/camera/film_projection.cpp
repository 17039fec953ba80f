#include "core/camera/film_projection.h"

namespace fstop {

FilmProjection::FilmProjection(const Camera& camera) {
  std::visit(
      [this](const auto& any) {
        const Sensor& sensor = any.sensor();
        world_from_camera = any.pose();
        centre = sensor.centre();
        scale = any.image_distance() / sensor.pixel_pitch;
        pupil_radius = any.pupil_radius().si();
        vergence = any.focus_vergence();
        width = sensor.width;
        height = sensor.height;
      },
      camera);
}

}  // namespace fstop
