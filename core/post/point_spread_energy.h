#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/post/point_spread.h"

namespace fstop {

/// The largest fraction whose radius is looked for: the light outside falls as 1/r only.
inline constexpr double kLargestEncircledFraction = 0.99;

/// For every fraction the radius about the chief ray (metres) within which that share of each
/// channel's light lies. Round images by Gauss-Legendre over the density; others by
///
///     E(r) = 2 pi r integral of mean H(nu) J_1(2 pi nu r) d(nu),
///
/// the mean over the directions of nu. 1e-9 relative for round images, 1e-4 for others.
/// Throws: Error{outside_domain} unless 0 < fraction <= kLargestEncircledFraction.
std::vector<Channels> encircled_radii(const PointSpread& spread, std::span<const double> fractions);

/// What so many fractions cost, about, in the units of PointSpread::density_cost.
double encircled_radii_cost(const PointSpread& spread, std::size_t fractions) noexcept;

}  // namespace fstop
