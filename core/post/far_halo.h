#pragma once

#include "core/film/image.h"
#include "core/post/spectral_plane.h"

namespace fstop {

/// Light far from where point spreads begin: of every pixel's light the density
///
///     kappa / (2 pi (r^2 + b^2)^(3/2))  per square pixel,
///
/// whose whole is kappa/b and whose transform (kappa/b) exp(-2 pi b nu). A pupil sends 2/(pi v) of
/// the light beyond v: kappa/r beyond r. So smooth a thing needs a grid of b/4 only; it is twice
/// as wide as the light, so that nothing wraps round.
class FarHalo {
 public:
  /// `light`: radiance, 1 channel, `cells` x `cells` elements a pixel; kappa and b in pixels,
  /// b >= 4.
  FarHalo(const Image& light, int cells, double kappa, double radius);

  /// At a raster point of the light's picture, in pixels.
  float at(double x, double y) const noexcept;

 private:
  int step_;  // pixels along a side of the grid's squares
  SpectralPlane grid_;
};

}  // namespace fstop
