#include "core/render/texture_detail.h"

#include <algorithm>
#include <cmath>

#include "core/render/shot_facts.h"

namespace fstop {

double texture_lookup_width(const QualitySpec& quality) {
  if (quality.texture_width_px) return *quality.texture_width_px;
  return 0.125 * std::sqrt(std::min(1.0, quality.max_error / 0.01));
}

double texture_detail_rmse(const Image& image, double width, const RunControl& run) {
  return 0.5 * (width * width / 4.0) * curvature_of(image, run);
}

}  // namespace fstop
