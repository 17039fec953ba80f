#pragma once

#include <vector>

#include "core/film/replicate_film.h"
#include "core/render/block_tracer.h"
#include "core/render/bokeh_splatting.h"

namespace fstop {

/// Splats through the pupil of `camera`; makes the rays of `samples` pass through what is splatted.
/// Both must outlive it.
struct Splatting {
  Splatting(const Camera& camera, std::uint32_t seed, SampleSource& samples);
  Splatting(const Splatting&) = delete;
  Splatting& operator=(const Splatting&) = delete;

  EmitterChoice choice;
  SplatSource source;
  /// Null where nothing is splatted.
  const SplatSource* light() const noexcept { return choice.emitters.empty() ? nullptr : &source; }
};

/// The light of small bright emitters, splatted for each replicate of a picture by as many points
/// of each emitter as a goal asks for.
class SplattedLight {
 public:
  explicit SplattedLight(const SplatSource& source) : source_(source) {}

  /// Splats until the mean square error of the two replicates' mean, values clipped to [-1,1], is
  /// below `goal_mse`, by at most `most_points` points, and puts the light into `film`. Returns
  /// that error.
  ///
  /// E_i light of emitter i, in pixels times value, told by M_i points leaves an error of E_i^2/M_i
  /// over all pixels (independent points; nets do better), so that M_i goes with E_i. What is
  /// measured decides: points are doubled, joining those there are, until it keeps the goal.
  double splat(double goal_mse, double most_points, ReplicateFilm& film, const RunControl& run);

  std::uint64_t rays() const noexcept { return rays_; }

 private:
  // Points of each emitter.
  std::vector<std::uint32_t> counts(double goal_mse, double scale) const;
  // Brings the light of all emitters to `counts`, the doubled ones and others at the fewest.
  void splat_to(const std::vector<std::uint32_t>& counts, const RunControl& run);
  double measured_mse(ReplicateFilm& film) const;

  SplatSource source_;
  std::vector<std::uint32_t> done_ = {};  // points of each emitter
  // By replicate: of emitters that double, and of those at the fewest points.
  std::vector<SplatImage> growing_ = {};
  std::vector<SplatImage> resting_ = {};
  std::uint64_t rays_ = 0;
};

}  // namespace fstop
