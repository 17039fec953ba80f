#pragma once

#include "core/measure/slanted_edge.h"

namespace fstop {

/// A straight edge from 0 to 1 blurred by a uniform disc of radius 1, t from the edge:
///
///     1/2 + [t sqrt(1 - t^2) + asin t]/pi,   0 below -1, 1 above 1
double disc_edge(double t) noexcept;

/// The same for a disc of `radius` px, averaged over a pixel's square whose centre lies `distance`
/// px from the edge, with the edge `slant` radians from a pixel axis. The square's projection on
/// the normal is a trapezoid: the second difference of disc_edge's second integral.
/// Valid: radius >= 0.02 px, 0 <= slant <= pi/4; rounding below 1e-9.
double disc_pixel_edge(double distance, double radius, double slant) noexcept;

/// A uniform disc found at an edge.
struct DiscEdge {
  double radius = 0.0;  // px
  EdgeLevels levels = {};
  Vec2 point = {};        // raster px, on the edge
  Vec2 normal = {};       // unit, raster, towards the bright side
  double residual = 0.0;  // root mean square over the region's pixels
};

/// The disc radius with the smallest squares: radius, the edge's place and slope and both levels,
/// fitted to every pixel of the region (Gauss-Newton in the radius' square, in which a small disc
/// stays regular). Starts from measured_slanted_edge and has its bounds; spec.levels are fitted
/// all the same.
/// Valid: a blur that is a disc; any other gives the nearest disc, with its residual.
/// Throws: as measured_slanted_edge, and Error{outside_domain} where the fit does not settle.
DiscEdge fit_disc_radius(ImageView<const float> image, const SlantedEdgeSpec& spec);

}  // namespace fstop
