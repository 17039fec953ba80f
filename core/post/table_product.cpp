#include "core/post/table_product.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>

#include "core/optics/bessel.h"

namespace fstop {
namespace {

constexpr double kTau = 2.0 * std::numbers::pi;

}  // namespace

void add_radial(const RadialTable& table, const FrequencySteps& steps, const SpectralPlane& sharp,
                SpectralPlane& sum) {
  const auto dx = static_cast<float>(steps.column);
  const auto dy = static_cast<float>(steps.row);
  sum.add_product(sharp, [&](int row, std::span<float> g) {
    const float y = dy * static_cast<float>(row);
    for (std::size_t i = 0; i < g.size(); ++i) {
      const float x = dx * static_cast<float>(i);
      g[i] = table(std::sqrt(x * x + y * y));
    }
  });
}

void add_polar(const PolarTable& table, const FrequencySteps& steps, const SpectralPlane& sharp,
               SpectralPlane& sum) {
  const auto dx = static_cast<float>(steps.column);
  const auto dy = static_cast<float>(steps.row);
  sum.add_complex_product(sharp, [&](int row, std::span<std::complex<float>> g) {
    const float y = dy * static_cast<float>(row);
    for (std::size_t i = 0; i < g.size(); ++i) g[i] = table(dx * static_cast<float>(i), y);
  });
}

void add_harmonic(const RadialTable& table, const AzimuthHarmonic& harmonic,
                  const FrequencySteps& steps, const SpectralPlane& sharp, SpectralPlane& sum) {
  const auto dx = static_cast<float>(steps.column);
  const auto dy = static_cast<float>(steps.row);
  sum.add_product(sharp, [&](int row, std::span<float> g) {
    const float y = dy * static_cast<float>(row);
    for (std::size_t i = 0; i < g.size(); ++i) {
      const float x = dx * static_cast<float>(i);
      const float frequency = std::sqrt(x * x + y * y);
      const float value = table(frequency);
      if (value == 0.0F || frequency == 0.0F) {
        g[i] = 0.0F;
        continue;
      }
      // cos and sin of 2 m psi by multiplying out (cos psi + i sin psi)^2.
      const std::complex<float> unit(x / frequency, y / frequency);
      const std::complex<float> turn = unit * unit;
      std::complex<float> power = 1.0F;
      for (int k = 0; k < harmonic.order; ++k) power *= turn;
      g[i] = value * (harmonic.sine ? power.imag() : power.real());
    }
  });
}

RadialTable disc_table(double radius, double highest_frequency) {
  const double step = std::min(0.02 / (kTau * std::abs(radius)), highest_frequency / 64.0);
  std::vector<float> values(static_cast<std::size_t>(highest_frequency / step) + 3);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<float>(jinc(kTau * radius * step * static_cast<double>(i)));
  }
  return {step, std::move(values)};
}

}  // namespace fstop
