#pragma once

#include "core/units.h"

namespace fstop {

struct ThinLens {
  Length focal_length = {};  // f > 0
  double f_number = 0.0;     // N = f / aperture diameter > 0
};

/// Diameter of the entrance pupil, A = f/N.
Length aperture_diameter(const ThinLens& lens);

/// Distance behind the lens where an object at `object_distance` is imaged:
///
///     1/v = 1/f - 1/u
///
/// u = kInfinitelyFar gives f, u = f gives kInfinitelyFar, u < f a negative distance (a virtual
/// image in front of the lens).
/// Throws: Error{outside_domain} unless f > 0 and u > 0.
/// Source: Gaussian lens equation, Hecht, Optics, 5.2.
Length image_distance(Length focal_length, Length object_distance);

/// Transverse magnification of the focused plane, m = -v/s = f/(f - s); 0 at infinity.
/// Throws: Error{outside_domain} unless f > 0 and s > f.
double magnification(Length focal_length, Length focus_distance);

/// Working f-number N_w = N (1 + |m|): the cone that reaches the sensor, pupil magnification 1.
/// Throws: Error{outside_domain} unless f > 0, N > 0 and s > f.
double working_f_number(const ThinLens& lens, Length focus_distance);

/// Diameter on the sensor of the blur disc of a point at `object_distance` when `lens` is
/// focused at `focus_distance`, negative where the point lies in front of the focused plane:
///
///     c = A v (1/s - 1/d),   A = f/N,   1/v = 1/f - 1/s
///
/// s, d: from the lens plane, positive towards the scene; either may be kInfinitelyFar. Regular
/// at and inside d = f, where the image is virtual and the disc real all the same.
/// Valid: one paraxial thin lens in air, on axis, geometric optics. Where |c| is below the Airy
///        diameter (airy_diameter) the true spot is larger.
/// Throws: Error{outside_domain} unless f > 0, N > 0, s > f and d > 0.
/// Source: Gaussian lens equation and similar triangles; Potmesil & Chakravarty 1981.
Length signed_circle_of_confusion(const ThinLens& lens, Length focus_distance,
                                  Length object_distance);

/// The same for a sensor that stays at `sensor_distance` whatever the focus: c = A v' (1/s - 1/d).
/// With v' = f this is the convention of renderers whose framing does not breathe.
Length signed_circle_of_confusion(const ThinLens& lens, Length focus_distance,
                                  Length object_distance, Length sensor_distance);

/// Magnitude of signed_circle_of_confusion.
Length circle_of_confusion(const ThinLens& lens, Length focus_distance, Length object_distance);

/// 1/a - 1/b, keeping all digits where a is close to b; either may be kInfinitelyFar.
Vergence vergence_difference(Length a, Length b);

/// Full angle, in radians, that `extent` on the sensor spans at `image_distance`: 2 atan(w/2v).
double view_angle(Length extent, Length image_distance);

}  // namespace fstop
