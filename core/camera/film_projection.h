#pragma once

#include "core/camera/camera.h"

namespace fstop {

/// Farthest that a pupil reaches from its centre, in radii of the disc of the same area: the corner
/// of a triangle, sqrt(2 pi/(3 sin(2 pi/3))) = 1.5551.
inline constexpr double kFarthestCorner = 1.5552;

/// Where points of the scene fall on the film through points of the pupil: the inverse of the
/// cameras' `ray`, as plain numbers for inner loops. Camera frame, metres; raster, pixels.
///
///     q = centre + (v/p) [(P - L)/P.z + kappa L]
///
/// P.z > 0; L on the pupil; v the sensor's distance, p the pixel pitch, kappa the vergence of the
/// focused plane (minus 1/v for a pinhole).
struct FilmProjection {
  explicit FilmProjection(const Camera& camera);

  Vec2 raster(Vec3 point, double lens_x, double lens_y) const noexcept {
    const double inverse = 1.0 / point.z;
    return {centre.x + scale * ((point.x - lens_x) * inverse + vergence * lens_x),
            centre.y + scale * ((point.y - lens_y) * inverse + vergence * lens_y)};
  }
  /// Signed diameter, in pixels, of the disc that a point at `depth` metres is spread over;
  /// negative in front of the focused plane.
  double blur_px(double depth) const noexcept {
    return 2.0 * pupil_radius * scale * (vergence - 1.0 / depth);
  }
  /// Pixels that a steradian covers, seen from a point of the pupil at `cosine` to the axis: a
  /// plane at unit distance is met at 1/cosine and slanted by it, so that the solid angle is
  /// cosine^3 times its area, and the film is that plane's picture (v/p)^2 times enlarged.
  double px_per_steradian(double cosine) const noexcept {
    return scale * scale / (cosine * cosine * cosine);
  }

  Pose world_from_camera = {};
  Vec2 centre = {};           // raster
  double scale = 0.0;         // v/p
  double pupil_radius = 0.0;  // metres, of the disc of the same area
  double vergence = 0.0;      // kappa, 1/metres
  int width = 0;              // pixels
  int height = 0;
};

}  // namespace fstop
