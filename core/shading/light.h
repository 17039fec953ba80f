#pragma once

#include "core/scene/scene.h"

namespace fstop {

/// One light as a surface point receives it, before shadows.
struct IncidentLight {
  Vec3f to_light = {};        // unit
  float distance = 0.0F;      // metres; infinite for a directional light
  Rgb intensity = {0, 0, 0};  // f_radial * f_angular * the light's intensity
};

/// Only what single precision cannot hold is cut: squares of a million times this stay finite.
inline constexpr double kLargestAttenuation = 1e12;

/// 1/(a0 + a1 d + a2 d^2), d in metres; at most kLargestAttenuation.
float radial_attenuation(const Attenuation& attenuation, float distance) noexcept;

/// `light` at `position`; `u`, `v` in [0, 1) choose the point of an area light.
IncidentLight incident_light(const Light& light, Vec3f position, float u, float v) noexcept;

/// Whether incident_light depends on u and v.
bool is_area_light(const Light& light) noexcept;

}  // namespace fstop
