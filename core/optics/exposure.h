#pragma once

#include "core/units.h"

namespace fstop {

/// Factor from mean radiance to pixel value under `exposure: {"iso": S}`:
///
///     k = 8000 t (S/100) / N_w^2
///
/// t in seconds, S the ISO speed, N_w the working f-number; 1 at N_w = 8, t = 1/125 s, ISO 100.
/// Throws: Error{outside_domain} unless t, S and N_w are positive and finite.
double exposure_factor(double shutter_seconds, double iso, double working_f_number);

/// Illuminance over pi L on the axis behind a flat disc pupil: 1/(4 N_w^2 + 1).
/// The usual 1/(4 N_w^2) is 12 % high at f/1.4. Throws: Error{outside_domain} unless N_w > 0.
double relative_illuminance_on_axis(double working_f_number);

/// The same at `height` from the axis, for a pupil at `image_distance`, exactly (no cos^4 limit):
///
///     E/(pi L) = 1/2 [1 - (1 + t^2 - a^2) / sqrt(t^4 + 2 t^2 (1 - a^2) + (1 + a^2)^2)]
///
/// t = height/v, a = 1/(2 N_w), the pupil's radius over v.
/// Throws: Error{outside_domain} unless N_w and the image distance are positive and the height is
///         a number.
/// Source: Foote, Bull. Bur. Standards 12, 583 (1916), for a disc parallel to the receiver.
double relative_illuminance(double working_f_number, Length height, Length image_distance);

/// Natural vignetting of a small pupil: the cosine of the chief ray's angle to the fourth power.
double cosine_fourth(Length height, Length image_distance);

}  // namespace fstop
