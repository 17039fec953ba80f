#include "core/optics/depth_of_field.h"

#include "core/error.h"

namespace fstop {

Length hyperfocal_distance(const ThinLens& lens, Length coc_limit) {
  if (!(coc_limit > Length{})) throw Error(ErrorCode::outside_domain, "needs c > 0");
  return lens.focal_length + aperture_diameter(lens) * (lens.focal_length / coc_limit);
}

DepthOfField depth_of_field(const ThinLens& lens, Length focus_distance, Length coc_limit) {
  const Length hyperfocal = hyperfocal_distance(lens, coc_limit);
  const Length f = lens.focal_length;
  if (!(focus_distance > f)) throw Error(ErrorCode::outside_domain, "needs s > f");
  const Length reach = hyperfocal - f;  // H0
  if (focus_distance == kInfinitelyFar) return {.near = reach, .far = kInfinitelyFar};
  if (!is_finite(reach)) return {.near = focus_distance, .far = focus_distance};  // c -> 0
  const Length near = focus_distance * (reach / (reach + (focus_distance - f)));
  // H - s and not H0 - (s - f): zero exactly where s is hyperfocal_distance()'s own answer.
  const Length margin = hyperfocal - focus_distance;
  const Length far = margin > Length{} ? focus_distance * (reach / margin) : kInfinitelyFar;
  return {.near = near, .far = far};
}

}  // namespace fstop
