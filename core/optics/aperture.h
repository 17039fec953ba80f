#pragma once

#include <vector>

#include "core/geometry.h"

namespace fstop {

/// The outline of the pupil, scaled so that its area is that of the unit disc: a disc or a
/// regular polygon of blades. The f-number keeps its light whatever the shape.
struct Aperture {
  int blades = 0;         // 0: disc; else >= 3
  double rotation = 0.0;  // radians, of the first vertex from +x towards +y (pupil frame, y down)

  friend bool operator==(const Aperture&, const Aperture&) = default;
};

/// Circumradius of the polygon of n blades with the area of the unit disc; 1 for a disc:
///
///     R^2 = 2 pi / (n sin(2 pi/n))
///
/// Throws: Error{outside_domain} unless blades is 0 or >= 3.
double aperture_circumradius(const Aperture& aperture);

/// Mean square distance from the axis, R^2 (2 + cos(2 pi/n))/6 for a polygon, 1/2 for a disc.
double aperture_mean_square_radius(const Aperture& aperture);

/// The polygon's corners in order, `blades` of them; empty for a disc.
std::vector<Vec2> aperture_vertices(const Aperture& aperture);

}  // namespace fstop
