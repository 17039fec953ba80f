#pragma once

#include <span>

namespace fstop {

/// The plain way to a point spread: a round pupil on `samples` x `samples` points across its
/// diameter, each 1 or 0, padded with zeros to four times the width and transformed.
///
/// Answers at its own points alone, v = k pi/4 up to the window's edge v = samples pi/2, and
/// s = 2k/samples. Single precision, as the images' transforms are.
/// Fails: where the phase step at the rim, 2|U|/samples, nears pi, and by the staircase of the rim.
class FftPupil {
 public:
  explicit FftPupil(int samples) : samples_(samples) {}

  int samples() const noexcept { return samples_; }
  /// The nearest points of its own.
  double nearest_v(double v) const noexcept;
  double nearest_s(double s) const noexcept;
  /// |G(v, U)|^2 of defocus_field.h at nearest_v(v); 0 beyond the window.
  void intensities(double defocus, std::span<const double> v, std::span<double> result) const;
  /// The OTF of transfer.h at nearest_s(s): the pupil's autocorrelation; 0 from s = 2 on.
  void otf(double defocus, std::span<const double> s, std::span<double> result) const;

 private:
  int samples_;
};

}  // namespace fstop
