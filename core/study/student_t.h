#pragma once

namespace fstop {

/// Chance that |t| of Student's distribution with `freedom` degrees lies beyond `t`:
/// I_x(freedom/2, 1/2) with x = freedom/(freedom + t^2), by its continued fraction.
/// Valid: freedom >= 1, t >= 0; to 1e-12 relative.
/// Source: Abramowitz & Stegun 1964, 26.7.1, 26.5.8; Lentz, Appl. Opt. 15, 668 (1976).
double student_t_tail(double t, double freedom);

/// The t that |t| passes with `chance`, 0 < chance < 1: the tail's inverse.
double student_t_threshold(double chance, double freedom);

}  // namespace fstop
