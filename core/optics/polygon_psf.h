#pragma once

#include <complex>
#include <vector>

#include "core/geometry.h"
#include "core/optics/aperture.h"

namespace fstop {

/// The field of a regular polygon's pupil, in focus and out of it, over that on the axis in focus:
///
///     A(q, U) = 1/area integral over the pupil of exp(i [U r^2/2 - q . x]) dx dy
///
/// q = k a rho/z as v for the disc, in the pupil's axes (a: the length that is 1 in the pupil), U
/// as there. Green's theorem leaves the edges: with P the phase, g its gradient U x - q,
///
///     -i closed integral of (exp(iP) - exp(iP0)) (g.n)/g^2 dl
///
/// where P0 is the phase at the stationary point g = 0 if that lies within two circumradii of the
/// centre and 0 otherwise. The bracket vanishes where g^2 does: no denominator comes near zero.
/// In focus every edge has its closed form; out of focus 16 Gauss-Legendre nodes serve every 6
/// radians of phase along an edge, and 48 more each edge: 1e-13 absolute.
/// Source: Komrska, J. Opt. Soc. Am. 72, 1382 (1982) for U = 0; Green's theorem with the gradient
///         of the phase for the rest.
class PolygonPupil {
 public:
  /// `blades` corners on a circle of `circumradius`, the first at `rotation` from +x towards +y.
  /// Throws: Error{outside_domain} unless 3 <= blades <= 10000 and circumradius > 0, finite.
  PolygonPupil(int blades, double rotation, double circumradius);
  /// The polygon of the unit disc's area: the f-number keeps its light whatever the blades.
  /// Throws: Error{outside_domain} for a disc (0 blades) or 1 or 2 blades.
  explicit PolygonPupil(const Aperture& aperture);

  double area() const noexcept { return area_; }
  /// A(q, U) for finite q and U; to full accuracy while |q| and |U| stay below 1e5 out of focus.
  std::complex<double> field(Vec2 q, double defocus = 0.0) const noexcept;
  /// |A|^2.
  double intensity(Vec2 q, double defocus = 0.0) const noexcept;
  /// What to multiply |A|^2 with for unit energy over the plane of q: area / (4 pi^2).
  double energy_scale() const noexcept;
  /// Nodes that field() uses at q and U, for cost estimates; 0 in focus.
  int node_count(Vec2 q, double defocus) const noexcept;

 private:
  struct Edge {
    Vec2 middle = {};
    Vec2 along = {};   // unit
    Vec2 normal = {};  // unit, outwards
  };
  std::complex<double> focused(Vec2 q) const noexcept;
  int panels(const Edge& edge, Vec2 q, double defocus) const noexcept;

  double circumradius_;
  double edge_length_ = 0.0;
  double area_ = 0.0;
  std::vector<Edge> edges_;
};

}  // namespace fstop
