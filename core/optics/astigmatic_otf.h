#pragma once

#include <vector>

#include "core/geometry.h"

namespace fstop {

/// OTF of a round pupil whose defocus differs along two axes, as an oblique pinhole's does:
///
///     H(s) = 1/pi integral over P(x + s/2) P(x - s/2) of exp(-i (U_x s_x x + U_y s_y y)) dx dy
///
/// s is in units of the pupil's radius on both axes, H is real and even in s_x and in s_y. Across
/// the vector s the overlap is w = sqrt(1 - eta^2) - |s|/2 long to either side, so that
///
///     H = 4/pi integral from 0 to sqrt(1 - s^2/4) of cos(p_eta eta) sin(p_xi w)/p_xi d(eta)
///
/// with p the phase's gradient; eta = sin(tau) and 16 + 0.6 |U| Gauss-Legendre nodes: 1e-13.
/// With U_x = U_y it is DefocusOtf.
/// Source: Hopkins, Proc. R. Soc. A 231, 91 (1955), with a quadratic form for the defocus.
class AstigmaticOtf {
 public:
  /// Throws: Error{outside_domain} unless |U_x| and |U_y| <= kLargestDefocus.
  AstigmaticOtf(double defocus_x, double defocus_y);

  /// H(s) for any finite s; 0 from |s| = 2 on. Allocates nothing.
  double operator()(Vec2 s) const noexcept;
  int node_count() const noexcept { return static_cast<int>(nodes_.size()); }

 private:
  double defocus_x_;
  double defocus_y_;
  std::vector<double> nodes_;    // in (0, 1)
  std::vector<double> weights_;  // adding up to 1
};

}  // namespace fstop
