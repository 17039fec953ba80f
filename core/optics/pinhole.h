#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "core/units.h"

namespace fstop {

/// What "the sharpest pinhole" is to mean; each criterion has its own optimum.
struct PinholeCriterion {
  std::string_view name = {};
  double coefficient = 0.0;  // c in d = c sqrt(f' lambda)
  std::string_view meaning = {};
};

/// All criteria, `brightest` first.
/// Source: scalar Fresnel theory, object at infinity; Young 1971, Mielenz 1999 for the classical
///         values; the others maximise the named figure of the wave-optical point spread.
std::span<const PinholeCriterion> pinhole_criteria();

/// The criterion of that name, if there is one.
std::optional<PinholeCriterion> pinhole_criterion(std::string_view name);

/// Diameter of the best hole for a screen at `image_distance` f' and objects at `object_distance`:
///
///     d = c sqrt(lambda / (1/f' + 1/u))
///
/// u may be kInfinitelyFar: d = c sqrt(f' lambda). c is the criterion's coefficient.
/// Throws: Error{outside_domain} unless all lengths and c are positive, f' and lambda finite.
/// Source: Young, The Physics Teacher 27, 648 (1989) for c = 2.
Length optimal_pinhole_diameter(Length image_distance, Length wavelength, double coefficient = 2.0,
                                Length object_distance = kInfinitelyFar);

/// Fresnel zones that a hole of `diameter` shows: N_F = a^2/lambda (1/f' + 1/u), a the radius.
/// Throws: Error{outside_domain} unless all lengths are positive.
double fresnel_number(Length diameter, Length image_distance, Length wavelength,
                      Length object_distance = kInfinitelyFar);

/// Diameter on the screen of a point's geometric shadow image: D (1 + f'/u).
/// Throws: Error{outside_domain} unless all lengths are positive.
Length geometric_spot_diameter(Length diameter, Length image_distance,
                               Length object_distance = kInfinitelyFar);

/// Diameter of the first dark ring of a round pupil in focus: 2.43934 lambda N_w.
/// Valid: scalar Fraunhofer diffraction. N_w is the working f-number (for a pinhole f'/D).
/// Throws: Error{outside_domain} unless both are positive.
/// Source: first zero of J1, 3.8317, over pi; Hecht, Optics, 10.2.5.
Length airy_diameter(Length wavelength, double working_f_number);

}  // namespace fstop
