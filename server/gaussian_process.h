#pragma once

#include <cstddef>
#include <span>

namespace fstop::server {

/// Mean of a Gaussian process at a point, given what was observed elsewhere: `observed` less the
/// process's own mean there, n values; `between` their covariances with the noise's variance on
/// the diagonal, n x n, positive definite; `with_point` the point's with each. 0 of nothing.
/// Source: Rasmussen & Williams 2006, equation 2.25.
double conditional_mean(std::span<const double> observed, std::span<double> between,
                        std::span<const double> with_point);

}  // namespace fstop::server
