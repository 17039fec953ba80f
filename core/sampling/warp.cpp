#include "core/sampling/warp.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace fstop {
namespace {

// sin and cos for |x| <= pi/4 by their Taylor series; the first terms left out are below
// 2e-14 and 6e-13. Polynomials vectorise and give the same bits with every C library.
inline double small_sine(double x) {
  const double q = x * x;
  return x * (1.0 +
              q * (-1.0 / 6 +
                   q * (1.0 / 120 +
                        q * (-1.0 / 5040 + q * (1.0 / 362880 + q * (-1.0 / 39916800 +
                                                                    q * (1.0 / 6227020800.0)))))));
}
inline double small_cosine(double x) {
  const double q = x * x;
  return 1.0 + q * (-1.0 / 2 +
                    q * (1.0 / 24 +
                         q * (-1.0 / 720 +
                              q * (1.0 / 40320 + q * (-1.0 / 3628800 + q * (1.0 / 479001600.0))))));
}

inline Vec2 concentric(double u, double v) {
  const double a = 2.0 * u - 1.0;
  const double b = 2.0 * v - 1.0;
  const bool wide = std::abs(a) > std::abs(b);
  const double radius = wide ? a : b;
  const double other = wide ? b : a;
  const double ratio = radius != 0.0 ? other / radius : 0.0;
  const double angle = (std::numbers::pi / 4.0) * ratio;
  const double along = radius * small_cosine(angle);
  const double across = radius * small_sine(angle);
  return {wide ? along : across, wide ? across : along};
}

}  // namespace

Vec2 disc_point(Vec2 square) noexcept { return concentric(square.x, square.y); }

PupilWarp::PupilWarp(std::vector<Vec2> corners) : corners_(std::move(corners)) {
  if (!corners_.empty()) corners_.push_back(corners_.front());
}

void PupilWarp::apply(LaneValues& u_to_x, LaneValues& v_to_y) const noexcept {
  if (corners_.empty()) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      const Vec2 point = concentric(u_to_x[i], v_to_y[i]);
      u_to_x[i] = point.x;
      v_to_y[i] = point.y;
    }
    return;
  }
  const auto blades = static_cast<double>(corners_.size() - 1);
  for (std::size_t i = 0; i < kLanes; ++i) {
    // u runs along the outline, sqrt(v) from the centre to it: uniform in every triangle.
    const double along = u_to_x[i] * blades;
    const auto blade = static_cast<std::size_t>(along);
    const Vec2 a = corners_[blade];
    const Vec2 rim = a + (corners_[blade + 1] - a) * (along - static_cast<double>(blade));
    const double radius = std::sqrt(v_to_y[i]);
    u_to_x[i] = rim.x * radius;
    v_to_y[i] = rim.y * radius;
  }
}

}  // namespace fstop
