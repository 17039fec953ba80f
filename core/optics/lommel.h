#pragma once

#include <complex>

namespace fstop {

/// Lommel's two series for G(v, U) (defocus_field.h), kept beside the series in use to show where
/// each fails: a method for comparison, not for images.
enum class LommelSide {
  u_series,  ///< powers of U/v: for |U| <= v
  v_series   ///< powers of v/U: for |U| >= v
};

/// G by one of Lommel's series:
///
///     G = exp(iU/2)/U (U_1 - i U_2),                        U_n = sum (-1)^s (U/v)^(n+2s)
///     J_(n+2s)(v) G = i/U (exp(-i v^2/2U) - exp(iU/2) (V_0 - i V_1)),   V_n = sum (-1)^s
///     (v/U)^(n+2s) J_(n+2s)(v)
///
/// Valid: on its own side to 1e-14 / min(1, |U|). On the other the terms grow before they cancel:
///        with J_n exact to their last digit the U series still keeps only 5 digits at U/v = 60/20
///        and is wrong by 25 orders of magnitude at 200/20; it may end in infinity or NaN.
/// Throws: Error{outside_domain} unless 0 < |U| <= kLargestDefocus and 0 < v <= 1e5.
/// Source: Lommel 1885; Born & Wolf, Principles of Optics, 8.8.1, equations 14 to 21.
std::complex<double> lommel_field(double v, double defocus, LommelSide side);

}  // namespace fstop
