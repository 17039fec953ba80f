#pragma once

#include <functional>

#include "core/measure/slanted_edge.h"

namespace fstop {

/// The transfer function that a blur is thought to have along the edge's normal, without the
/// pixel: of the frequency in cycles/px and a scale near 1; real, signed, 1 at frequency 0.
using ScaledTransfer = std::function<double(double frequency, double scale)>;

/// The member of a family of blurs that a picture of an edge shows.
struct ProfileScale {
  double scale = 1.0;           // within kWidestProfileScale of 1; at that end: at least so far
  double standard_error = 0.0;  // of the scale
  double residual = 0.0;        // root mean square over the pixels
  EdgeLevels levels = {};
};
inline constexpr double kWidestProfileScale = 0.1;

/// Fits scale, the edge's place and turn, both levels and a tilt to every pixel of the region: the
/// whole profile, which tells a scale far better than any one number read off it. A pixel's value
/// at x along the normal is
///
///     dark + contrast E(x) + tilt x,
///     E(x) = 1/2 + int_0^inf H(nu, q) B(nu) sin(2 pi nu x)/(pi nu) dnu.
///
/// The tilt is what far light adds that the picture's frame leaves out, or a wall lit unevenly.
/// B = sinc(nu cos) sinc(nu sin) the pixel's square seen along the normal. The integral is a
/// midpoint sum over steps of 1/1024 cycles/px: exact but for the edges' images 512 px away, whose
/// tails nearly cancel. Gauss-Newton; E is a parabola in q through 0.97, 1 and 1.03.
/// The standard error is the sandwich of sums over tiles of 16 x 16 pixels, inside which a
/// renderer's errors may depend on each other, and no less than that of independent pixels.
/// Valid: symmetrical blurs; scales within 3 % to 1e-5, beyond by extrapolation.
/// Throws: as measured_slanted_edge; Error{outside_domain} where the fit does not settle.
/// Source: Liang & Zeger, Biometrika 73, 13 (1986) for the sandwich.
ProfileScale fit_profile_scale(ImageView<const float> image, const SlantedEdgeSpec& spec,
                               const ScaledTransfer& transfer);

}  // namespace fstop
