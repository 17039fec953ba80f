#include "core/scene/mapping.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"
#include "core/fast_math.h"
#include "core/scene/lane_surfaces.h"
#include "core/simd.h"

namespace fstop {
namespace {

constexpr double kLargestCoordinate = 1e7;  // metres
constexpr float kPerTurn = 0.15915494F;     // 1/2pi
constexpr float kPerHalfTurn = 0.31830989F;
// Squares of distances that gradients divide by, relative to the origin's distance and in m^2.
constexpr float kNearestToAxis = 1e-12F;
constexpr float kNearestToOrigin = 1e-18F;

void require(bool holds, const char* what) {
  if (!holds) throw Error(ErrorCode::bad_geometry, std::string("a mapping's ") + what);
}

void require_finite(Vec3 a, const char* what) {
  const auto is_legal = [](double x) { return std::abs(x) <= kLargestCoordinate; };
  require(is_legal(a.x) && is_legal(a.y) && is_legal(a.z), what);  // false for NaN too
}

// The sine between two directions: below 1e-9 their normal is rounding noise.
bool span_area(Vec3 a, Vec3 b) { return norm(cross(a, b)) > 1e-9 * norm(a) * norm(b); }

}  // namespace

SurfaceMap::SurfaceMap(const Mapping& mapping) {
  std::visit(
      [this](const auto& kind) {
        if constexpr (requires { this->set(kind); }) set(kind);
      },
      mapping);
}

void SurfaceMap::set(const PlanarMapping& mapping) {
  require_finite(mapping.origin, "origin must be finite and at most 1e7 m from the world's");
  require_finite(mapping.edge_u, "edges must be finite and at most 1e7 m");
  require_finite(mapping.edge_v, "edges must be finite and at most 1e7 m");
  const double shortest = std::min(norm(mapping.edge_u), norm(mapping.edge_v));
  require(shortest >= kSmallestPeriod && span_area(mapping.edge_u, mapping.edge_v),
          "edges must span an area and be at least 1e-6 m long");
  // The dual basis: grad u . edge_u = 1, grad u . edge_v = 0, both in the edges' plane.
  const Vec3 normal = cross(mapping.edge_u, mapping.edge_v);
  const double per_square = 1.0 / dot(normal, normal);
  kind_ = Kind::planar;
  origin_ = to_float(mapping.origin);
  x_ = to_float(cross(mapping.edge_v, normal) * per_square);
  y_ = to_float(cross(normal, mapping.edge_u) * per_square);
}

void SurfaceMap::set(const SphericalMapping& mapping) {
  kind_ = Kind::spherical;
  set_frame(mapping.origin, mapping.axis, mapping.front, mapping.around);
}

void SurfaceMap::set(const CylindricalMapping& mapping) {
  require(mapping.height >= kSmallestPeriod && mapping.height <= kLargestCoordinate,
          "height must lie in 1e-6 to 1e7 m");
  kind_ = Kind::cylindrical;
  set_frame(mapping.origin, mapping.axis, mapping.front, mapping.around);
  per_height_ = static_cast<float>(1.0 / mapping.height);
}

void SurfaceMap::set_frame(Vec3 origin, Vec3 axis, Vec3 front, int around) {
  require_finite(origin, "origin must be finite and at most 1e7 m from the world's");
  require_finite(axis, "axis must be finite and at most 1e7 long");
  require_finite(front, "front must be finite and at most 1e7 long");
  require(norm(axis) > 0.0 && norm(front) > 0.0 && span_area(normalized(axis), normalized(front)),
          "axis and front must not be zero or parallel");
  require(around >= 1 && around <= kMostTurns, "turns must lie in 1 to 1000");
  const Vec3 y = normalized(axis);
  const Vec3 x = normalized(cross(y, normalized(front)));
  origin_ = to_float(origin);
  x_ = to_float(x);
  y_ = to_float(y);
  z_ = to_float(cross(x, y));
  around_ = static_cast<float>(around);
}

template <SurfaceMap::Kind kKind>
FSTOP_KERNEL UvPoint SurfaceMap::point_at(Vec3f q) const noexcept {
  UvPoint point;
  if constexpr (kKind == Kind::planar) {
    point.u = dot(q, x_);
    point.v = dot(q, y_);
    point.du = x_;
    point.dv = y_;
    return point;
  }
  const float x = dot(q, x_);
  const float y = dot(q, y_);
  const float z = dot(q, z_);
  const float from_axis = x * x + z * z;
  const float squared = from_axis + y * y;
  const float nearest = std::max(kNearestToAxis * squared, kNearestToOrigin);
  const float bounded = std::max(from_axis, nearest);
  point.u = around_ * (0.5F + fast_atan2(x, z) * kPerTurn);
  const float turn = around_ * kPerTurn / bounded;
  point.du = x_ * (turn * z) - z_ * (turn * x);
  if constexpr (kKind == Kind::cylindrical) {
    point.v = y * per_height_;
    point.dv = y_ * per_height_;
  } else {
    const float radius = std::sqrt(from_axis);
    point.v = 0.5F + fast_atan2(y, radius) * kPerHalfTurn;
    const float rise = kPerHalfTurn / std::max(squared, kNearestToOrigin);
    const float inwards = rise * y / std::sqrt(bounded);
    point.dv = y_ * (rise * radius) - x_ * (inwards * x) - z_ * (inwards * z);
  }
  return point;
}

UvPoint SurfaceMap::at(Vec3f point) const noexcept {
  switch (kind_) {
    case Kind::planar:
      return point_at<Kind::planar>(point - origin_);
    case Kind::spherical:
      return point_at<Kind::spherical>(point - origin_);
    case Kind::cylindrical:
      return point_at<Kind::cylindrical>(point - origin_);
  }
  return {};
}

// All lanes are computed, so that the loop has no branches; those not meant keep what they have.
template <SurfaceMap::Kind kKind>
FSTOP_KERNEL void SurfaceMap::fill_kind(const LaneMask& lanes, LaneSurfaces& s) const noexcept {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const Vec3f q = {s.x[k] - s.shift_x[k] - origin_.x, s.y[k] - s.shift_y[k] - origin_.y,
                     s.z[k] - s.shift_z[k] - origin_.z};
    const UvPoint point = point_at<kKind>(q);
    const float rate = uv_rate(point, {s.face_x[k], s.face_y[k], s.face_z[k]});
    const bool meant = lanes[k] != 0;
    s.u[k] = meant ? point.u : s.u[k];
    s.v[k] = meant ? point.v : s.v[k];
    s.uv_per_metre[k] = meant ? rate : s.uv_per_metre[k];
    s.du_x[k] = meant ? point.du.x : s.du_x[k];
    s.du_y[k] = meant ? point.du.y : s.du_y[k];
    s.du_z[k] = meant ? point.du.z : s.du_z[k];
    s.dv_x[k] = meant ? point.dv.x : s.dv_x[k];
    s.dv_y[k] = meant ? point.dv.y : s.dv_y[k];
    s.dv_z[k] = meant ? point.dv.z : s.dv_z[k];
  }
}

FSTOP_KERNEL void SurfaceMap::fill_any(const LaneMask& lanes, LaneSurfaces& s) const noexcept {
  switch (kind_) {
    case Kind::planar:
      return fill_kind<Kind::planar>(lanes, s);
    case Kind::spherical:
      return fill_kind<Kind::spherical>(lanes, s);
    case Kind::cylindrical:
      return fill_kind<Kind::cylindrical>(lanes, s);
  }
}

FSTOP_AVX512 void SurfaceMap::fill_wide(const LaneMask& lanes, LaneSurfaces& s) const noexcept {
  fill_any(lanes, s);
}

void SurfaceMap::fill(const LaneMask& lanes, LaneSurfaces& s) const noexcept {
  if (has_avx512()) return fill_wide(lanes, s);
  fill_any(lanes, s);
}

void SurfaceMap::fill_gradients(const LaneMask& lanes, LaneSurfaces& s) const noexcept {
  for (std::size_t k = 0; k < kLanes; ++k) {
    if (lanes[k] == 0) continue;
    const UvPoint point = at(s.position(k) - Vec3f{s.shift_x[k], s.shift_y[k], s.shift_z[k]});
    s.set_gradients(k, point.du, point.dv);
  }
}

}  // namespace fstop
