#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace fstop {

/// A cubic spline on even knots: value and slope anywhere between its ends.
class CubicSpline {
 public:
  /// `coefficients` of the B-splines around the knots `first` + k `spacing`, k from -1 on: the
  /// spline covers [first, first + (coefficients - 3) spacing].
  /// Throws: Error{outside_domain} unless spacing > 0 and there are at least 4 coefficients.
  CubicSpline(double first, double spacing, std::vector<double> coefficients);

  double first() const noexcept { return first_; }
  double last() const noexcept {
    return first_ + spacing_ * static_cast<double>(coefficients_.size() - 3);
  }
  /// Beyond the ends the last piece's polynomial goes on.
  double value(double x) const noexcept;
  double slope(double x) const noexcept;

 private:
  double first_;
  double spacing_;
  std::vector<double> coefficients_;
};

/// The least-squares cubic spline through scattered points (x_i, y_i): the same places serve any
/// number of right-hand sides.
///
/// What the projection onto splines of knots h apart does to a wave of frequency nu is
/// sinc^8(nu h) / sum over k of sinc^8(nu h + k): 1 - 1.6e-4 at nu h = 1/4. A penalty of 1e-6 of
/// the mean diagonal on second differences bridges knots without a point.
/// Source: Unser, IEEE Signal Process. Mag. 16 (6), 22 (1999).
class SplineFit {
 public:
  /// Knots from `first` to at least `last`; points outside are passed over.
  /// Throws: Error{outside_domain} unless first < last, spacing > 0, and some point lies inside.
  SplineFit(double first, double last, double spacing, std::vector<double> places);

  /// The spline for the values at the places, as many as there are places.
  CubicSpline fitted(const std::vector<double>& values) const;
  bool covers(double x) const noexcept { return x >= first_ && x <= last_; }

 private:
  static constexpr std::size_t kBand = 4;  // B-splines that overlap any interval

  void factorise();

  double first_;
  double last_;
  double spacing_;
  std::vector<double> places_;
  std::vector<std::array<double, kBand>> band_;  // the lower Cholesky factor, row by row
};

}  // namespace fstop
