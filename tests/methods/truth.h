#pragma once

#include <array>

#include "core/render/simulation.h"

namespace fstop {

/// How far a picture is from the full model, told by two references of other seeds.
struct TrueError {
  double rmse = 0.0;     // the references' own noise taken out
  double scatter = 0.0;  // standard error of `rmse` from that noise
};

/// What a shot converges to: two independent pictures R, S of plain lens sampling - every pixel as
/// many samples, texture lookups of almost no width - by which a picture's mean squared error is
///
///     E (X - R)(X - S) = (X - T)^2
///
/// without the references' variance, as their noises are independent of each other. All values are
/// clipped to [0,1], as max_error counts them.
///
/// Valid: where rays are the full model: diffraction off, or its loss far below what is measured.
class Truth {
 public:
  /// Samples until the mean of both references has a standard error below `noise`, or
  /// `most_samples` a pixel in each.
  Truth(const SimulationSpec& spec, const RayScene& scene, double noise, int most_samples,
        const RunControl& run);

  TrueError error_of(const Image& picture) const;
  /// Standard error of the mean of both references.
  double noise() const { return noise_; }
  int samples() const { return samples_; }

 private:
  std::array<Image, 2> references_ = {};
  double noise_ = 1.0;
  int samples_ = 0;
};

}  // namespace fstop
