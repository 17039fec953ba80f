#pragma once

#include <cmath>
#include <compare>
#include <limits>

namespace fstop {

/// A physical quantity whose dimension is length to the power `Exponent`, metres inside.
///
/// Products and quotients carry their dimension, so a formula of the wrong dimension does not
/// compile; a dimensionless result is a plain `double`. The machine code is that of a bare double.
template <int Exponent>
class Quantity {
 public:
  constexpr Quantity() = default;

  /// `value` in metres to the power `Exponent`.
  static constexpr Quantity si(double value) { return Quantity(value); }
  constexpr double si() const { return value_; }

  constexpr Quantity operator-() const { return Quantity(-value_); }
  constexpr Quantity& operator+=(Quantity other) { return value_ += other.value_, *this; }
  constexpr Quantity& operator-=(Quantity other) { return value_ -= other.value_, *this; }
  constexpr Quantity& operator*=(double factor) { return value_ *= factor, *this; }
  constexpr Quantity& operator/=(double divisor) { return value_ /= divisor, *this; }

  friend constexpr Quantity operator+(Quantity a, Quantity b) {
    return Quantity(a.value_ + b.value_);
  }
  friend constexpr Quantity operator-(Quantity a, Quantity b) {
    return Quantity(a.value_ - b.value_);
  }
  friend constexpr Quantity operator*(Quantity a, double b) { return Quantity(a.value_ * b); }
  friend constexpr Quantity operator*(double a, Quantity b) { return Quantity(a * b.value_); }
  friend constexpr Quantity operator/(Quantity a, double b) { return Quantity(a.value_ / b); }
  friend constexpr auto operator<=>(const Quantity&, const Quantity&) = default;

 private:
  explicit constexpr Quantity(double value) : value_(value) {}
  double value_ = 0.0;
};

using Length = Quantity<1>;
using Area = Quantity<2>;
using Vergence = Quantity<-1>;  ///< 1/metres, the dioptre

namespace detail {
template <int Exponent>
constexpr auto quantity(double value) {
  if constexpr (Exponent == 0) {
    return value;
  } else {
    return Quantity<Exponent>::si(value);
  }
}
}  // namespace detail

template <int A, int B>
constexpr auto operator*(Quantity<A> a, Quantity<B> b) {
  return detail::quantity<A + B>(a.si() * b.si());
}
template <int A, int B>
constexpr auto operator/(Quantity<A> a, Quantity<B> b) {
  return detail::quantity<A - B>(a.si() / b.si());
}
template <int A>
constexpr auto operator/(double a, Quantity<A> b) {
  return Quantity<-A>::si(a / b.si());
}

template <int A>
Quantity<A> abs(Quantity<A> a) {
  return Quantity<A>::si(std::abs(a.si()));
}
inline Length sqrt(Area area) { return Length::si(std::sqrt(area.si())); }
template <int A>
bool is_finite(Quantity<A> a) {
  return std::isfinite(a.si());
}

/// The object distance of a point at infinity: legal wherever a docstring says so.
inline constexpr Length kInfinitelyFar = Length::si(std::numeric_limits<double>::infinity());

inline namespace literals {
// Literals divide, so that 35.0_mm == 0.035_m to the last bit.
constexpr Length operator""_m(long double v) { return Length::si(static_cast<double>(v)); }
constexpr Length operator""_mm(long double v) { return Length::si(static_cast<double>(v) / 1e3); }
constexpr Length operator""_um(long double v) { return Length::si(static_cast<double>(v) / 1e6); }
constexpr Length operator""_nm(long double v) { return Length::si(static_cast<double>(v) / 1e9); }
}  // namespace literals

}  // namespace fstop
