#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/camera/film_projection.h"
#include "core/sampling/sequence.h"
#include "core/scene/ray_scene.h"

namespace fstop {

/// Points of an emitter as points of the pupil see them, one a lane; camera frame, metres.
struct EmitterPoints {
  alignas(64) LaneValues x = {};
  alignas(64) LaneValues y = {};
  alignas(64) LaneValues z = {};
  alignas(64) LaneValues distance = {};  // from the point of the pupil
  /// Pixels of sharp image that the lane stands for: the film's area per area of the surface over
  /// the density that the point was chosen with. 0 where the surface is turned away.
  alignas(64) LaneValues weight_px = {};
  alignas(64) std::array<std::uint32_t, kLanes> primitive = {};
  alignas(64) std::array<float, kLanes> b1 = {};  // of triangles, as Surface::b1
  alignas(64) std::array<float, kLanes> b2 = {};
};

/// Chooses points of one emitter for one camera. Where P has the area density p, a sample stands
/// for
///
///     dq/dA / p = (v/p')^2 |N.D| / (r^2 cos^3(alpha)) / p     pixels,
///
/// D the unit direction from the pupil's point, r the distance, alpha the angle to the axis, p'
/// the pixel pitch; for fixed L the film is the picture of a plane (FilmProjection).
/// Spheres are chosen from evenly over the solid angle that they fill as seen from the pupil's
/// point, so that all samples weigh alike but for cos^3; triangles by their area as the pupil's
/// centre sees it, then evenly.
class EmitterSampler {
 public:
  /// All of the emitter lies before the pupil.
  EmitterSampler(const RayScene& scene, const Emitter& emitter, const FilmProjection& film);

  /// Points seen from (lens_x, lens_y), metres on the pupil, for (u, v) in the unit square.
  void sample(const LaneValues& lens_x, const LaneValues& lens_y, const LaneValues& u,
              const LaneValues& v, EmitterPoints& points) const noexcept;

  /// How far a sphere is from a point of the pupil.
  double nearest(double lens_x, double lens_y) const noexcept {
    return norm(center_ - Vec3{lens_x, lens_y, 0.0}) - radius_;
  }

 private:
  struct Triangle {
    Vec3 a = {};
    Vec3 ab = {};
    Vec3 ac = {};
    Vec3 normal = {};              // unit; away from a closed surface
    double inverse_density = 0.0;  // of area, square metres
    std::uint32_t primitive = 0;
  };

  void add_triangles(const RayScene& scene, const Emitter& emitter);
  void sample_sphere(const LaneValues& lens_x, const LaneValues& lens_y, const LaneValues& u,
                     const LaneValues& v, EmitterPoints& points) const noexcept;
  void sample_triangles(const LaneValues& lens_x, const LaneValues& lens_y, const LaneValues& u,
                        const LaneValues& v, EmitterPoints& points) const noexcept;

  FilmProjection film_;
  Vec3 center_ = {};  // camera frame
  double radius_ = 0.0;
  bool one_sided_ = false;
  std::vector<Triangle> triangles_;
  std::vector<double> upto_;  // share of the choices up to and with each triangle
};

}  // namespace fstop
