#pragma once

#include "core/film/image.h"
#include "core/geometry.h"

namespace fstop {

/// A sinusoidal star: mean + amplitude cos(cycles phi - phase), phi from +x towards -y of the
/// raster (anticlockwise as seen).
struct SinusoidalStar {
  Vec2 centre = {};    // raster px
  int cycles = 0;      // per turn
  double phase = 0.0;  // radians
  double mean = 0.0;   // where nothing is blurred
  double amplitude = 0.0;
};

/// What a ring of the star has kept of its contrast.
struct StarContrast {
  double frequency = 0.0;   // cycles/px: cycles / (2 pi radius)
  double modulation = 0.0;  // signed, over the unblurred one; negative: contrast reversal
  double quadrature = 0.0;  // what is out of phase; 0 for symmetrical blur
  double mean = 0.0;        // over the unblurred mean
};

/// Fits mean, cosine and sine of the star's angle to the pixels within 1 px of `radius` (px),
/// weighted with a tent of that width.
/// Valid: blur that is narrow against the radius; the ring's curvature then changes the
///        modulation by about (blur/radius)^2/4 of itself.
/// Throws: Error{outside_domain} unless cycles >= 2 and amplitude and mean are not 0, the ring lies
///         inside the image, its frequency is at most 0.5 cycles/px and its pixels are finite.
StarContrast star_contrast(ImageView<const float> image, int channel, const SinusoidalStar& star,
                           double radius);

}  // namespace fstop
