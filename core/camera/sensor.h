#pragma once

#include "core/geometry.h"

namespace fstop {

/// A plane of square pixels, centred on the axis. Raster: pixels, origin top-left, pixel centres
/// at half-integers, y down.
struct Sensor {
  Length pixel_pitch = {};
  int width = 0;   // pixels
  int height = 0;  // pixels

  Vec2 centre() const { return {0.5 * width, 0.5 * height}; }

  /// Where `raster` would lie before the lens, upright and unmirrored, `image_distance` metres
  /// ahead of it: camera frame, metres. The real sensor point is its mirror image in the lens
  /// centre.
  Vec3 upright_point(Vec2 raster, double image_distance) const noexcept {
    const double pitch = pixel_pitch.si();
    return {(raster.x - 0.5 * width) * pitch, (raster.y - 0.5 * height) * pitch, image_distance};
  }

  friend bool operator==(const Sensor&, const Sensor&) = default;
};

/// What aims packets of rays: the ray of a raster point and a pupil point starts at
/// position + radius (pupil.x right + pupil.y down) and runs along
/// forward + a_x right + a_y down, a = slope (raster - centre) - radius vergence pupil.
struct AimFrame {
  Vec3 position = {};
  Vec3 right = {};
  Vec3 down = {};
  Vec3 forward = {};
  Vec2 centre = {};       // raster, pixels
  double slope = 0.0;     // per pixel: pixel pitch over image distance
  double radius = 0.0;    // of the pupil, metres
  double vergence = 0.0;  // 1/metres; of the plane where a raster point's rays meet
};

/// The frame of a camera of the given pose whose sensor lies `image_distance` metres from a pupil
/// of `radius` metres.
inline AimFrame aim_frame_of(const Sensor& sensor, const Pose& pose, double image_distance,
                             double radius, double vergence) noexcept {
  return {.position = pose.position(),
          .right = pose.vector({1.0, 0.0, 0.0}),
          .down = pose.vector({0.0, 1.0, 0.0}),
          .forward = pose.forward(),
          .centre = sensor.centre(),
          .slope = sensor.pixel_pitch.si() / image_distance,
          .radius = radius,
          .vergence = vergence};
}

}  // namespace fstop
