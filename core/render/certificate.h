#pragma once

#include <cstdint>

#include "core/film/replicate_film.h"
#include "core/parallel.h"
#include "core/render/block_tracer.h"

namespace fstop {

/// The error of a picture, however it was made, bias included.
struct Certificate {
  /// As quality counts it; `energy` joins the difference of the totals and its standard error.
  NoiseEstimate error = {};
  double standard_error = 0.0;  // of the mean squared error, before its estimate is cut at 0
  double clip_bias = 0.0;       // RMSE that clipping noisy replicates may hide; part of the bound
  Image tiles =
      {};  // 3 channels: mean squared error in tiles of kErrorTile, every pixel its tile's
  std::uint64_t rays = 0;
  std::uint32_t samples = 0;  // of a pixel in each replicate
};

/// Compares `picture` X (3 channels) with two independent unbiased replicates U1 and U2 of it, each
/// with samples in every block and none of them used to make X:
///
///     E (X - U1)(X - U2) = (X - T)^2,   T = E U
///
/// since neither the noise of U1 and U2 nor X, which is fixed, depend on each other: their noise
/// cancels, what X has of noise and of bias stays. Blocks are the independent units, their pixels
/// share pupil points.
///
/// *Standard error.* The variance of a block's sum, estimated by
///
///     (sum (X - U1)^2 - sum (X - U2)^2)^2/4 + (sum (U1 - U2)^2)^2/8
///
/// The first term is exact for the part that grows with the error of X, however unevenly that is
/// spread over the picture. The second covers the replicates' own noise: it is right where all of a
/// block's pixels share it, and too large, by less as samples are added, where they do not. Both
/// see rare bright samples that only one replicate has met; the scatter between blocks would not.
///
/// *Bound.* The estimate, at least 0, plus Student's one-sided 95 % quantile of standard errors;
/// its degrees of freedom are how many blocks the variance effectively comes from.
///
/// *Clipping.* Quality counts values clipped to [0,1], so X, U1 and U2 are. Clipping noise lowers
/// the mean of U by at most e = E max(U - 1, 0), and by at most 1 - E min(U, 1); the product of
/// both bounds the square of that bias, and U1 and U2 estimate it without bias. Its root is added
/// to the bound's. Where X is 1 or more it is not needed, as a lower U only raises the error. Light
/// beyond 2 counts as 2 in e, or else rare bright samples would be all that it tells.
///
/// **Valid**: statements on the picture's mean; what no sample of U1 and U2 met is not seen.
/// **Source**: products of independent residuals; Rousselle, Knaus & Zwicker 2012 and Zwicker et
/// al. 2015 survey error estimates from two buffers.
Certificate certificate_of(const Image& picture, const ReplicateFilm& film);

/// How well an error shall be known.
struct CertificateGoal {
  double mse = 0.0;                 // a bound at or under this is good enough: see `certified`
  double tightness = 1.3;           // and so is a bound at most this times the estimate
  std::uint32_t most_samples = 64;  // of a pixel in each replicate; at least kFirstCertificate
  std::uint32_t seed = 0;           // other than what the picture was made with
};
inline constexpr std::uint32_t kFirstCertificate = 4;

/// Traces both replicates of `picture` from `source`, doubling their samples from
/// kFirstCertificate until the goal is met or most_samples are traced. A bound at or under goal.mse
/// also has to be within four times the estimate, or a sixteenth of goal.mse: the estimate is worth
/// something by itself.
/// Throws: Error{cancelled}.
Certificate certified(const Image& picture, const SampleSource& source, const CertificateGoal& goal,
                      const RunControl& run);

}  // namespace fstop
