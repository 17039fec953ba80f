#pragma once

#include "core/camera/sensor.h"

namespace fstop {

/// Perspective camera: a round hole before a screen, centred on the camera origin.
/// Camera space and raster as in ThinLensCamera.
/// Valid: geometric optics; where the hole shows few Fresnel zones (fresnel_number) the true
///        image is a diffraction pattern.
class PinholeCamera {
 public:
  /// `diameter` 0 is the ideal centre of projection.
  /// Throws: Error{outside_domain} unless image_distance > 0 and diameter >= 0, both finite.
  PinholeCamera(Length image_distance, Length diameter, const Sensor& sensor,
                const Pose& world_from_camera);

  /// The ray that leaves the scene towards `raster` through `pupil` (in units of the hole's
  /// radius): straight on from the screen's point. World space, unit direction.
  Ray ray(Vec2 raster, Vec2 pupil) const noexcept {
    const Vec3 origin{pupil.x * pupil_radius_, pupil.y * pupil_radius_, 0.0};
    // The screen's true point is -chief; from there through the hole's point.
    const Vec3 aim = sensor_.upright_point(raster, image_distance_) + origin;
    return {world_from_camera_.point(origin), normalized(world_from_camera_.vector(aim))};
  }

  /// The same for packets of rays.
  AimFrame aim_frame() const noexcept {
    return aim_frame_of(sensor_, world_from_camera_, image_distance_, pupil_radius_,
                        -1.0 / image_distance_);
  }

  /// Cosine to the fourth power of the chief ray's angle; applied only where it is asked for.
  double falloff(Vec2 raster) const noexcept;

  Length image_distance() const noexcept { return Length::si(image_distance_); }
  Length pupil_radius() const noexcept { return Length::si(pupil_radius_); }
  /// Rays of one screen point meet behind the hole, on the screen: minus one over its distance.
  double focus_vergence() const noexcept { return -1.0 / image_distance_; }
  const Sensor& sensor() const noexcept { return sensor_; }
  const Pose& pose() const noexcept { return world_from_camera_; }

 private:
  Sensor sensor_;
  Pose world_from_camera_;
  double pupil_radius_;    // metres
  double image_distance_;  // metres, hole to screen
};

}  // namespace fstop
