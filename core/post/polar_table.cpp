#include "core/post/polar_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fstop {
namespace {

constexpr int kAngles = 65;  // from a corner's direction to the middle between two corners
constexpr float kPi = std::numbers::pi_v<float>;

// atan(t) for t in [0, 1] to 1e-5. Source: Abramowitz & Stegun 1964, 4.4.49.
float arc_tangent(float t) {
  const float s = t * t;
  return t *
         (0.9998660F + s * (-0.3302995F + s * (0.1801410F + s * (-0.0851330F + s * 0.0208351F))));
}

float angle_of(float x, float y) {
  const float ax = std::abs(x);
  const float ay = std::abs(y);
  const float small = std::min(ax, ay);
  const float large = std::max(ax, ay);
  float angle = large > 0.0F ? arc_tangent(small / large) : 0.0F;
  if (ay > ax) angle = 0.5F * kPi - angle;
  if (x < 0.0F) angle = kPi - angle;
  return y < 0.0F ? -angle : angle;
}

}  // namespace

PolarTable::PolarTable(const Aperture& aperture, double step, int count,
                       const std::function<std::complex<double>(Vec2)>& function)
    : blades_(static_cast<float>(aperture.blades)),
      rotation_(static_cast<float>(aperture.rotation)),
      per_step_(static_cast<float>(1.0 / step)),
      count_(std::max(count, 2)),
      values_(static_cast<std::size_t>(kAngles) * static_cast<std::size_t>(count_)) {
  for (int j = 0; j < kAngles; ++j) {
    const double angle = aperture.rotation + std::numbers::pi / aperture.blades * j / (kAngles - 1);
    for (int i = 0; i < count_; ++i) {
      const double frequency = step * i;
      values_[static_cast<std::size_t>(j * count_ + i)] =
          std::complex<float>(function({frequency * std::cos(angle), frequency * std::sin(angle)}));
    }
  }
}

std::complex<float> PolarTable::operator()(float x, float y) const noexcept {
  const float place = std::sqrt(x * x + y * y) * per_step_;
  if (!(place < static_cast<float>(count_ - 1))) return 0.0F;
  const auto i = static_cast<std::size_t>(place);
  const float inner = place - static_cast<float>(i);
  float turn = (angle_of(x, y) - rotation_) * blades_ / (2.0F * kPi);  // in corners
  turn -= std::floor(turn);
  const float fold = std::min(turn, 1.0F - turn) * 2.0F * static_cast<float>(kAngles - 1);
  const auto j = std::min(static_cast<std::size_t>(fold), static_cast<std::size_t>(kAngles - 2));
  const float across = fold - static_cast<float>(j);
  const std::complex<float>* low = values_.data() + j * static_cast<std::size_t>(count_) + i;
  const std::complex<float>* high = low + count_;
  const std::complex<float> a = low[0] + inner * (low[1] - low[0]);
  const std::complex<float> b = high[0] + inner * (high[1] - high[0]);
  return a + across * (b - a);
}

PolarTable PolarTable::without_halo(double amplitude, double decay) const {
  PolarTable table = *this;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const double frequency =
        static_cast<double>(i % static_cast<std::size_t>(count_)) / static_cast<double>(per_step_);
    table.values_[i] -= static_cast<float>(amplitude * std::exp(-frequency * decay));
  }
  return table;
}

}  // namespace fstop
