#pragma once

#include "core/camera/sensor.h"
#include "core/optics/thin_lens.h"

namespace fstop {

/// Perspective camera: one ideal thin lens, its pupil centred on the camera origin.
/// Camera space: metres, x right, y down, z forward. Raster: pixels, origin top-left.
/// Valid: paraxial, no aberrations, no diffraction, open pupil of any outline.
class ThinLensCamera {
 public:
  /// The sensor lies at the image distance of the focused plane.
  /// Throws: Error{outside_domain} unless focus_distance > lens.focal_length.
  ThinLensCamera(const ThinLens& lens, Length focus_distance, const Sensor& sensor,
                 const Pose& world_from_camera);

  /// The same with the sensor's distance given: the picture is that of a sensor at the image
  /// distance, scaled to `sensor_distance`. With f, framing does not change with focus.
  ThinLensCamera(const ThinLens& lens, Length focus_distance, Length sensor_distance,
                 const Sensor& sensor, const Pose& world_from_camera);

  /// The ray from `pupil` (in units of the pupil's radius) that the lens bends to `raster`:
  /// world space, unit direction.
  Ray ray(Vec2 raster, Vec2 pupil) const noexcept {
    const Vec3 origin{pupil.x * pupil_radius_, pupil.y * pupil_radius_, 0.0};
    const Vec3 chief =
        sensor_.upright_point(raster, image_distance_);  // unflipped, before the lens
    // Rays of one raster point meet at chief * (s/v); divided by s, the aim is finite at infinity.
    const Vec3 aim = chief * (1.0 / image_distance_) - origin * focus_vergence_;
    return {world_from_camera_.point(origin), normalized(world_from_camera_.vector(aim))};
  }

  /// The same for packets of rays.
  AimFrame aim_frame() const noexcept {
    return aim_frame_of(sensor_, world_from_camera_, image_distance_, pupil_radius_,
                        focus_vergence_);
  }

  /// Cosine to the fourth power of the chief ray's angle; applied only where it is asked for.
  double falloff(Vec2 raster) const noexcept;

  Length image_distance() const noexcept { return Length::si(image_distance_); }
  Length pupil_radius() const noexcept { return Length::si(pupil_radius_); }
  /// One over the focused distance, 1/metres: 0 at infinity.
  double focus_vergence() const noexcept { return focus_vergence_; }
  const Sensor& sensor() const noexcept { return sensor_; }
  const Pose& pose() const noexcept { return world_from_camera_; }

 private:
  Sensor sensor_;
  Pose world_from_camera_;
  double pupil_radius_;    // metres
  double image_distance_;  // metres, lens to sensor
  double focus_vergence_;  // 1/metres; 0 when focused at infinity
};

}  // namespace fstop
