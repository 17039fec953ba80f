#pragma once

#include "core/optics/defocus_field.h"

namespace fstop {

/// Share of the light within the reduced radius v of the axis:
///
///     E(v) = 2 integral from 0 to v of |G(w, U)|^2 w dw,   1 - E(v) ~ 2/(pi v)
///
/// by 16 Gauss-Legendre nodes for every 2 pi of v, through which |G|^2 swings twice: 1e-13
/// absolute. Beyond v = 1e5 + 20 |U| the tail's leading term answers, to 0.3 % of the tail.
/// Throws: Error{outside_domain} unless v >= 0 and finite.
double encircled_energy(const DefocusField& field, double v);

/// The v within which `fraction` of the light lies: the inverse of encircled_energy, to 1e-12.
/// Throws: Error{outside_domain} unless 0 < fraction <= 0.99999; the tail falls as 1/v only, so
///         that more would lie 60000 reduced units away, where no pupil's edge is sharp enough.
double encircled_radius(const DefocusField& field, double fraction);

/// The smallest v at which |G|^2 falls to half its value on the axis.
/// Throws: Error{outside_domain} where some ring outshines the axis, as behind an even
///         number of Fresnel zones: there is no width at half maximum.
double half_maximum_radius(const DefocusField& field);

}  // namespace fstop
