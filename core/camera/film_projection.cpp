#include "core/camera/film_projection.h"

namespace fstop {

FilmProjection::FilmProjection(const Camera& camera) {
  std::visit(
      [this](const auto& any) {
        const AimFrame frame = any.aim_frame();
        world_from_camera = any.pose();
        centre = frame.centre;
        scale = 1.0 / frame.slope;
        pupil_radius = frame.radius;
        vergence = frame.vergence;
        width = any.sensor().width;
        height = any.sensor().height;
      },
      camera);
}

}  // namespace fstop
