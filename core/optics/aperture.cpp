#include "core/optics/aperture.h"

#include <cmath>
#include <numbers>

#include "core/error.h"

namespace fstop {
namespace {

double sector_angle(const Aperture& aperture) {
  if (aperture.blades < 3) {
    throw Error(ErrorCode::outside_domain, "needs 0 blades (a disc) or at least 3");
  }
  return 2.0 * std::numbers::pi / aperture.blades;
}

}  // namespace

double aperture_circumradius(const Aperture& aperture) {
  if (aperture.blades == 0) return 1.0;
  const double sector = sector_angle(aperture);
  return std::sqrt(sector / std::sin(sector));
}

double aperture_mean_square_radius(const Aperture& aperture) {
  if (aperture.blades == 0) return 0.5;
  const double radius = aperture_circumradius(aperture);
  return radius * radius * (2.0 + std::cos(sector_angle(aperture))) / 6.0;
}

std::vector<Vec2> aperture_vertices(const Aperture& aperture) {
  std::vector<Vec2> vertices;
  if (aperture.blades == 0) return vertices;
  const double radius = aperture_circumradius(aperture);
  for (int i = 0; i < aperture.blades; ++i) {
    const double angle = aperture.rotation + i * sector_angle(aperture);
    vertices.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return vertices;
}

}  // namespace fstop
