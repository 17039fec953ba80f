#pragma once

#include <cmath>

#include "core/units.h"

namespace fstop {

struct Vec2 {
  double x = 0.0;
  double y = 0.0;

  friend constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
  friend constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
  friend constexpr Vec2 operator*(Vec2 a, double s) { return {a.x * s, a.y * s}; }
  friend constexpr bool operator==(const Vec2&, const Vec2&) = default;
};

struct Vec3 {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;

  constexpr Vec3 operator-() const { return {-x, -y, -z}; }
  friend constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3 operator*(Vec3 a, double s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3 operator*(double s, Vec3 a) { return a * s; }
  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
};

constexpr double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(Vec3 a) { return std::sqrt(dot(a, a)); }
inline Vec3 normalized(Vec3 a) { return a * (1.0 / norm(a)); }

/// Vec3 in single precision: for hit points, normals and shading, where Embree's own floats end.
struct Vec3f {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;

  constexpr Vec3f operator-() const { return {-x, -y, -z}; }
  friend constexpr Vec3f operator+(Vec3f a, Vec3f b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3f operator-(Vec3f a, Vec3f b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3f operator*(Vec3f a, float s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3f operator*(float s, Vec3f a) { return a * s; }
  friend constexpr bool operator==(const Vec3f&, const Vec3f&) = default;
};

constexpr float dot(Vec3f a, Vec3f b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3f cross(Vec3f a, Vec3f b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float norm(Vec3f a) { return std::sqrt(dot(a, a)); }
/// Unit length; the zero vector stays zero.
inline Vec3f normalized(Vec3f a) {
  const float length = norm(a);
  return length > 0.0F ? a * (1.0F / length) : a;
}
constexpr Vec3f to_float(Vec3 a) {
  return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}

/// Half a line: `origin` in metres, `direction` of unit length unless a function says otherwise.
struct Ray {
  Vec3 origin = {};
  Vec3 direction = {0.0, 0.0, 1.0};
};

/// A rigid transform from a camera's frame (x right, y down, z forward; metres) to the world.
class Pose {
 public:
  /// At the world's origin, axes parallel: x right, y down, z forward.
  constexpr Pose() = default;

  /// At `position`, looking at `target`, `up` upwards in the image.
  /// Throws: Error{outside_domain} if target equals position or up is parallel to the line of
  /// sight.
  static Pose looking_at(Vec3 position, Vec3 target, Vec3 up);

  constexpr Vec3 vector(Vec3 camera) const {
    return right_ * camera.x + down_ * camera.y + forward_ * camera.z;
  }
  constexpr Vec3 point(Vec3 camera) const { return position_ + vector(camera); }
  /// The camera-frame coordinates of a world point: the inverse of `point`.
  constexpr Vec3 from_world(Vec3 world) const {
    const Vec3 offset = world - position_;
    return {dot(right_, offset), dot(down_, offset), dot(forward_, offset)};
  }
  constexpr Vec3 position() const { return position_; }
  constexpr Vec3 forward() const { return forward_; }

 private:
  Vec3 position_ = {};
  Vec3 right_ = {1.0, 0.0, 0.0};
  Vec3 down_ = {0.0, 1.0, 0.0};
  Vec3 forward_ = {0.0, 0.0, 1.0};
};

}  // namespace fstop
