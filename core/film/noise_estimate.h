#pragma once

namespace fstop {

/// How far the mean of a film's samples may be from their limit.
struct NoiseEstimate {
  double mse = 0.0;                     // mean over pixels and channels, values clipped to [0,1]
  double mse_upper_95 = 0.0;            // one-sided
  double unclipped_mse_upper_95 = 0.0;  // the same of values as they are
  double energy = 0.0;  // standard error of the total unclipped energy over the total
};

}  // namespace fstop
