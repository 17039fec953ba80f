#pragma once

#include "core/optics/thin_lens.h"

namespace fstop {

/// The object distances between which the blur disc stays within a limit.
struct DepthOfField {
  Length near = {};
  Length far = {};  // kInfinitelyFar from the hyperfocal distance on
};

/// Focus distance from which on everything to infinity is acceptably sharp: H = f + f^2/(N c).
/// Throws: Error{outside_domain} unless f > 0, N > 0 and c > 0.
Length hyperfocal_distance(const ThinLens& lens, Length coc_limit);

/// Where the disc of a point reaches `coc_limit`, exactly:
///
///     near, far = H0 s / (H0 +- (s - f)),   H0 = f^2/(N c),   far = infinity for s >= H
///
/// s may be kInfinitelyFar; near is then H - f. At s = H near is H/2.
/// Valid: as signed_circle_of_confusion; the approximations H0 s/(H0 +- s) and H s/(H +- (s - f))
///        of other calculators differ by up to 0.7 % near s = H.
/// Throws: Error{outside_domain} unless f > 0, N > 0, c > 0 and s > f.
/// Source: 1/u = 1/s +- c/(A v), solved for u.
DepthOfField depth_of_field(const ThinLens& lens, Length focus_distance, Length coc_limit);

}  // namespace fstop
