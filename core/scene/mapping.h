#pragma once

#include "core/scene/ray_packet.h"
#include "core/scene/scene.h"

namespace fstop {

struct LaneSurfaces;

/// Planar, spherical or cylindrical.
inline bool maps_by_position(const Mapping& mapping) noexcept {
  return !std::holds_alternative<OwnMapping>(mapping) &&
         !std::holds_alternative<ScreenMapping>(mapping);
}

/// Edges and heights of mappings are at least as long, metres.
inline constexpr double kSmallestPeriod = 1e-6;
/// A texture goes round at most as often.
inline constexpr int kMostTurns = 1000;

/// Texture coordinates at a point, and their gradients in space, 1/metre.
struct UvPoint {
  float u = 0.0F;
  float v = 0.0F;
  Vec3f du = {};
  Vec3f dv = {};
};

/// How fast uv runs over a surface of unit normal n, 1/metre: sqrt |n . (grad u x grad v)|, the
/// square root of the ratio of areas.
inline float uv_rate(const UvPoint& point, Vec3f normal) noexcept {
  return std::sqrt(std::abs(dot(normal, cross(point.du, point.dv))));
}

/// A mapping by a point's position, ready for lookups. With q from the origin and x, y, z its
/// parts along axis x front, the axis and the front:
///
///     planar:      q = u edge_u + v edge_v + w n
///     spherical:   u = m (1/2 + atan2(x, z)/2pi), v = 1/2 + atan2(y, sqrt(x^2 + z^2))/pi
///     cylindrical: u likewise, v = y/height
///
/// m whole: a repeated texture has no seam. Points on the axis have u = m/2; gradients there are
/// those of a millionth of the distance off it.
class SurfaceMap {
 public:
  /// `mapping` is one that maps_by_position.
  /// Throws: Error{bad_geometry} for positions that are not finite, edges that span no area, a
  ///         front along the axis, lengths below kSmallestPeriod, turns outside 1 to kMostTurns.
  explicit SurfaceMap(const Mapping& mapping);

  /// At a point of the object, at time 0.
  UvPoint at(Vec3f point) const noexcept;

  /// Sets u, v, their gradients and uv_per_metre of `lanes` from their positions and faces.
  void fill(const LaneMask& lanes, LaneSurfaces& surfaces) const noexcept;
  /// Sets the gradients alone.
  void fill_gradients(const LaneMask& lanes, LaneSurfaces& surfaces) const noexcept;

 private:
  enum class Kind { planar, spherical, cylindrical };

  void set(const PlanarMapping& mapping);
  void set(const SphericalMapping& mapping);
  void set(const CylindricalMapping& mapping);
  void set_frame(Vec3 origin, Vec3 axis, Vec3 front, int around);
  template <Kind kKind>
  UvPoint point_at(Vec3f from_origin) const noexcept;
  template <Kind kKind>
  void fill_kind(const LaneMask& lanes, LaneSurfaces& surfaces) const noexcept;
  void fill_any(const LaneMask& lanes, LaneSurfaces& surfaces) const noexcept;
  void fill_wide(const LaneMask& lanes, LaneSurfaces& surfaces) const noexcept;

  Kind kind_ = Kind::planar;
  Vec3f origin_ = {};
  Vec3f x_ = {};  // planar: the gradients of u and v
  Vec3f y_ = {};
  Vec3f z_ = {};
  float around_ = 1.0F;
  float per_height_ = 1.0F;  // 1/metre
};

}  // namespace fstop
