#include "core/post/far_halo.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fstop {
namespace {

int squares(int elements, int cells, int step) {
  return (elements + cells * step - 1) / (cells * step);
}

}  // namespace

FarHalo::FarHalo(const Image& light, int cells, double kappa, double radius)
    : step_(std::max(1, static_cast<int>(radius / 4.0))),
      grid_(fast_transform_length(2 * squares(light.width(), cells, step_)),
            fast_transform_length(2 * squares(light.height(), cells, step_))) {
  const int square = step_ * cells;
  const float share = 1.0F / static_cast<float>(cells * cells);
  for (int y = 0; y < light.height(); ++y) {
    float* line = grid_.view().at(0, y / square);
    for (int x = 0; x < light.width(); ++x) line[x / square] += share * *light.at(x, y);
  }
  SpectralPlane kernel(grid_.width(), grid_.height());
  for (int y = 0; y < kernel.height(); ++y) {
    for (int x = 0; x < kernel.width(); ++x) {
      const double dx = step_ * std::min(x, kernel.width() - x);
      const double dy = step_ * std::min(y, kernel.height() - y);
      const double distance = dx * dx + dy * dy + radius * radius;
      *kernel.view().at(x, y) =
          static_cast<float>(kappa / (2.0 * std::numbers::pi * distance * std::sqrt(distance)));
    }
  }
  grid_.transform();
  kernel.transform();
  grid_ *= kernel;
  grid_.invert();
}

float FarHalo::at(double x, double y) const noexcept {
  // The grid's centres lie at (i + 1/2) steps.
  const double u = x / step_ - 0.5;
  const double v = y / step_ - 0.5;
  const int i = std::clamp(static_cast<int>(std::floor(u)), 0, grid_.width() - 2);
  const int j = std::clamp(static_cast<int>(std::floor(v)), 0, grid_.height() - 2);
  const auto value = [&](int a, int b) { return static_cast<double>(*grid_.view().at(a, b)); };
  const double top = value(i, j) + (u - i) * (value(i + 1, j) - value(i, j));
  const double bottom = value(i, j + 1) + (u - i) * (value(i + 1, j + 1) - value(i, j + 1));
  return static_cast<float>(top + (v - j) * (bottom - top));
}

}  // namespace fstop
