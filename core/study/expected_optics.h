#pragma once

#include <functional>

#include "core/camera/camera_spec.h"

namespace fstop {

/// What a camera of these numbers must show: closed forms derived apart from core/optics, which
/// they are held against in tests, and from nominal numbers alone. Distances are from the lens,
/// along the axis.

/// By images: object at d is imaged f d/(d - f) behind the lens, and the cone from the pupil A to
/// there is cut by the sensor; a sensor that does not breathe scales that by f/v. Unsigned.
/// Throws: Error{outside_domain} for a camera without a lens.
Length expected_blur_diameter(const CameraSpec& camera, Length object_distance);

/// The object distances whose disc is `coc_limit` wide, by the images v/(1 -+ c/A) behind the lens;
/// far is kInfinitelyFar where that image lies within the focal length.
/// Throws: Error{outside_domain} for a camera without a lens, or a limit as wide as the pupil.
struct ExpectedDepthOfField {
  Length near = {};
  Length far = {};
};
ExpectedDepthOfField expected_depth_of_field(const CameraSpec& camera, Length coc_limit);

/// Size on the sensor over size in the focused plane: by Newton's equation f/(s - f), or f/s for a
/// sensor that does not breathe. Throws: Error{outside_domain} for a camera without a lens.
double expected_magnification(const CameraSpec& camera);

/// Pixel value of radiance 1 under ISO exposure, 8000 t (S/100)/N_w^2 with N_w = v/A.
/// Throws: Error{outside_domain} for a camera without a lens or without such an exposure.
double expected_exposure(const CameraSpec& camera);

/// A transfer function over the frequency on the sensor, cycles per metre; signed.
using TransferFunction = std::function<double(double)>;

/// Of a uniform disc of `diameter`: 2 J_1(x)/x, x = pi nu c. Source: Goodman, 2.1.6.
TransferFunction disc_transfer(Length diameter);

/// Of a lens in focus, 2/pi (acos t - t sqrt(1 - t^2)) with t = nu lambda N_w: the overlap of two
/// circles. Source: Goodman, Introduction to Fourier Optics, 6.4.2.
TransferFunction diffraction_transfer(const CameraSpec& camera);

/// 1/(lambda N_w), where two pupils part. Throws: Error{outside_domain} for a camera without a
/// lens.
Vergence expected_cut_off(const CameraSpec& camera);

/// Of a pinhole for a plane at `object_distance`: the overlap of two pupils shifted by nu lambda z,
/// over which their quadratic phases differ linearly,
///
///     H = 1/area integral of chord(x) cos(2 pi W x nu z) dx,  W = 1/z + 1/u
///
/// with x along the shift, metres, and chord(x) the overlap's height there.
/// Source: Hopkins, Proc. R. Soc. A 231, 91 (1955), in pupil metres.
/// Throws: Error{outside_domain} for a camera without a pinhole.
TransferFunction pinhole_transfer(const CameraSpec& camera, Length object_distance);

/// Mean of (x + iy)^n over a regular n-gon of circumradius R is 2 R^n/((n + 1)(n + 2)) turned by n
/// times its first vertex's angle: from its triangles' mean, 2/((n+1)(n+2)) sum of a^j b^(n-j), the
/// sum over all n roots of unity but one being left. R of the n-gon with a disc's area:
/// R = c/2 sqrt(2 pi/(n sin(2 pi/n))).
Length expected_circumradius(Length blur_diameter, int blades);

}  // namespace fstop
