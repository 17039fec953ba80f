#include "core/shading/light.h"

#include <algorithm>
#include <cmath>

#include "core/scene/ray_packet.h"
#include "core/shading/material.h"

namespace fstop {
namespace {

// Light that comes from one place, spread to all sides.
IncidentLight from_point(Vec3f source, const Attenuation& attenuation, const Rgb& intensity,
                         Vec3f position) {
  const Vec3f offset = source - position;
  const float distance = norm(offset);
  if (!(distance > 0.0F)) return {};  // a surface through the light: no direction, no light
  const float radial = radial_attenuation(attenuation, distance);
  return {.to_light = offset * (1.0F / distance),
          .distance = distance,
          .intensity = intensity * radial};
}

struct Incidence {
  Vec3f position = {};
  Rgb intensity = {};
  float u = 0.0F;
  float v = 0.0F;

  IncidentLight operator()(const DirectionalLight& light) const {
    return {.to_light = to_float(normalized(light.direction * -1.0)),
            .distance = kFar,
            .intensity = intensity};
  }
  IncidentLight operator()(const PointLight& light) const {
    return from_point(to_float(light.position), light.attenuation, intensity, position);
  }
  IncidentLight operator()(const SpotLight& light) const {
    IncidentLight result =
        from_point(to_float(light.position), light.attenuation, intensity, position);
    const float cosine = -dot(result.to_light, to_float(normalized(light.direction)));
    const auto exponent = static_cast<float>(light.exponent);
    // max(0, cos)^n also for n = 0: nothing behind the lamp.
    const float angular = cosine > 0.0F ? std::pow(cosine, exponent) : 0.0F;
    result.intensity = result.intensity * angular;
    return result;
  }
  IncidentLight operator()(const AreaLight& light) const {
    const Vec3 point = light.corner + light.edge_u * u + light.edge_v * v;
    return from_point(to_float(point), light.attenuation, intensity, position);
  }
};

}  // namespace

float radial_attenuation(const Attenuation& attenuation, float distance) noexcept {
  const double d = distance;
  const double factor = 1.0 / (attenuation.a0 + attenuation.a1 * d + attenuation.a2 * d * d);
  return static_cast<float>(std::min(factor, kLargestAttenuation));
}

IncidentLight incident_light(const Light& light, Vec3f position, float u, float v) noexcept {
  return std::visit(Incidence{.position = position, .intensity = light.intensity, .u = u, .v = v},
                    light.kind);
}

bool is_area_light(const Light& light) noexcept {
  return std::holds_alternative<AreaLight>(light.kind);
}

}  // namespace fstop
