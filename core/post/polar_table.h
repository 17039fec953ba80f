#pragma once

#include <complex>
#include <functional>
#include <vector>

#include "core/geometry.h"
#include "core/optics/aperture.h"

namespace fstop {

/// A transfer function with a regular polygon's symmetry, tabled over the frequency's magnitude and
/// over half the angle between two corners; linear between its points, 0 beyond. Hermitian.
class PolarTable {
 public:
  /// Samples `function` (of a frequency, cycles per metre) at magnitudes i * step, i < count.
  PolarTable(const Aperture& aperture, double step, int count,
             const std::function<std::complex<double>(Vec2)>& function);

  /// Of frequency (x, y), y down.
  std::complex<float> operator()(float x, float y) const noexcept;
  /// The same less `amplitude` exp(-frequency * decay), the transform of a far halo.
  PolarTable without_halo(double amplitude, double decay) const;

 private:
  float blades_;
  float rotation_;  // radians
  float per_step_;
  int count_;
  std::vector<std::complex<float>> values_;  // [angle][magnitude]
};

}  // namespace fstop
