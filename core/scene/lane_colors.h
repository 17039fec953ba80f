#pragma once

#include "core/scene/ray_packet.h"
#include "core/scene/scene.h"

namespace fstop {

/// Radiance or reflectance of every lane, linear Rec. 709.
struct LaneColors {
  alignas(64) std::array<float, kLanes> r = {};
  alignas(64) std::array<float, kLanes> g = {};
  alignas(64) std::array<float, kLanes> b = {};

  void set(int lane, const Rgb& color) noexcept {
    const auto k = static_cast<std::size_t>(lane);
    r[k] = color[0];
    g[k] = color[1];
    b[k] = color[2];
  }
  Rgb get(int lane) const noexcept {
    const auto k = static_cast<std::size_t>(lane);
    return {r[k], g[k], b[k]};
  }
};

}  // namespace fstop
