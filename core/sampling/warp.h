#pragma once

#include <vector>

#include "core/geometry.h"
#include "core/sampling/sequence.h"

namespace fstop {

/// Maps the unit square onto the unit disc, area-preserving and with little distortion.
/// u, v in [0, 1). Source: Shirley & Chiu, J. Graphics Tools 2(3), 1997.
Vec2 disc_point(Vec2 square) noexcept;

/// Maps the unit square uniformly onto a disc or a star-shaped polygon around the origin, given
/// by its corners in order; kLanes points at once.
class PupilWarp {
 public:
  /// No corners: the unit disc. Otherwise at least three, whose triangles with the origin have
  /// equal areas (a regular polygon).
  explicit PupilWarp(std::vector<Vec2> corners);

  /// Replaces (u, v) in the unit square by (x, y) on the pupil, in place.
  void apply(LaneValues& u_to_x, LaneValues& v_to_y) const noexcept;

 private:
  std::vector<Vec2> corners_;  // the first once more at the end
};

}  // namespace fstop
