#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "core/geometry.h"
#include "core/sampling/sequence.h"

namespace fstop {

inline constexpr std::uint32_t kNoHit = 0xffffffffU;

/// kLanes rays in the memory layout of Embree's packets (asserted in ray_scene.cpp), each with
/// the place where it first meets a surface. Directions have unit length, so `far` is a
/// distance in metres after a hit.
struct alignas(64) RayPacket {
  template <typename T>
  using Lanes = std::array<T, kLanes>;

  Lanes<float> org_x = {}, org_y = {}, org_z = {}, near = {};
  Lanes<float> dir_x = {}, dir_y = {}, dir_z = {}, time = {};
  Lanes<float> far = {};
  Lanes<std::uint32_t> mask = {}, id = {}, flags = {};
  Lanes<float> normal_x = {}, normal_y = {}, normal_z = {};
  Lanes<float> u = {}, v = {};
  Lanes<std::uint32_t> primitive = {}, object = {}, instance = {};

  /// Makes lane `i` a ray from `origin` along `direction` up to `distance`, with no hit yet.
  void set(int i, Vec3f origin, Vec3f direction, float distance, float at_time) noexcept {
    const auto k = static_cast<std::size_t>(i);
    org_x[k] = origin.x;
    org_y[k] = origin.y;
    org_z[k] = origin.z;
    dir_x[k] = direction.x;
    dir_y[k] = direction.y;
    dir_z[k] = direction.z;
    near[k] = 0.0F;
    far[k] = distance;
    time[k] = at_time;
    mask[k] = 0xffffffffU;
    object[k] = kNoHit;
    instance[k] = kNoHit;
  }
  Vec3f origin(int i) const noexcept {
    const auto k = static_cast<std::size_t>(i);
    return {org_x[k], org_y[k], org_z[k]};
  }
  Vec3f direction(int i) const noexcept {
    const auto k = static_cast<std::size_t>(i);
    return {dir_x[k], dir_y[k], dir_z[k]};
  }
  bool hit(int i) const noexcept { return object[static_cast<std::size_t>(i)] != kNoHit; }
};

inline constexpr float kFar = std::numeric_limits<float>::infinity();

/// Which lanes are traced: all bits set or zero.
using LaneMask = std::array<std::int32_t, kLanes>;

}  // namespace fstop
