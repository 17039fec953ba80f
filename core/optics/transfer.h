#pragma once

#include <span>
#include <vector>

namespace fstop {

/// MTF of a round pupil in focus,
///
///     T(s) = 2/pi (acos(s/2) - s/2 sqrt(1 - s^2/4)),
///
/// s = nu lambda z / a the reduced frequency; 0 from the cut-off s = 2 on. Any finite s.
/// Source: Goodman, Introduction to Fourier Optics, 6.4.2.
double diffraction_mtf(double s) noexcept;

/// OTF of a round pupil with defocus, signed (negative: contrast reversal):
///
///     H(s) = 4/pi integral from 0 to 1 - s/2 of sqrt(1 - (x + s/2)^2) cos(U s x) dx
///
/// The substitution x + s/2 = cos(tau) removes the square root's end; 16 + 0.3 |U| Gauss-Legendre
/// nodes then give 1e-13. Fewer fail completely: 24 are exact at W20 = 5 waves and wrong by 0.4 at
/// 20.
/// Source: Hopkins, Proc. R. Soc. A 231, 91 (1955).
class DefocusOtf {
 public:
  /// Throws: Error{outside_domain} unless |U| <= kLargestDefocus.
  explicit DefocusOtf(double defocus);

  /// H(s) for any finite s; even, 0 from |s| = 2 on.
  double operator()(double s) const noexcept;
  void values(std::span<const double> s, std::span<double> result) const noexcept;
  int node_count() const noexcept { return static_cast<int>(nodes_.size()); }

 private:
  double defocus_;
  std::vector<double> nodes_;    // in (0, 1)
  std::vector<double> weights_;  // adding up to 1
};

/// Cheaper models of the same OTF, each with the law of its largest error over all s.
enum class OtfModel {
  airy,             ///< T(s): defocus left out; error 2.23 W20^2, at most 1.14
  disc,             ///< jinc(U s): diffraction left out; error 0.165 W20^(-3/4), at most 1
  disc_times_airy,  ///< T(s) jinc(U s): both, as if independent; error up to 0.26
  stretched_disc    ///< T(s) jinc(U s (1 - s/2)): Stokseth's argument; error at most 0.0168
};

/// The model's OTF at s; even in s and U. For `disc` any s counts, the others end at s = 2.
/// Source: Stokseth, J. Opt. Soc. Am. 59, 1314 (1969) for the stretched argument.
double model_otf(OtfModel model, double s, double defocus) noexcept;

/// A bound of |model_otf - H| over all s at defocus U, W = |U|/4 pi waves:
///
///     airy             min(2.23 W^2, 1.14)
///     disc             min(1, 0.165 W^(-3/4))
///     disc x Airy      min(6.97 W^2, 0.26, 0.165 W^(-3/4))
///     stretched disc   min(0.0995 W^2, 0.0168, 0.0168 / W)
///
/// Fitted to the differences from H for W from 0.01 to 100 waves; not claimed beyond.
double model_otf_error(OtfModel model, double defocus) noexcept;

}  // namespace fstop
