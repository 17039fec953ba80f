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

}  // namespace fstop
