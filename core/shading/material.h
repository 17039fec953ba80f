#pragma once

#include <string>
#include <vector>

#include "core/scene/ray_scene.h"

namespace fstop {

constexpr Rgb operator+(const Rgb& a, const Rgb& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
constexpr Rgb operator*(const Rgb& a, const Rgb& b) {
  return {a[0] * b[0], a[1] * b[1], a[2] * b[2]};
}
constexpr Rgb operator*(const Rgb& a, float s) { return {a[0] * s, a[1] * s, a[2] * s}; }

/// The two factors of a light's geometry: max(N.L, 0), and (R.V)^n for phong or (N.H)^n for
/// blinn-phong. Both are 0 where N.L <= 0.
struct ReflectionTerms {
  float diffuse = 0.0F;
  float specular = 0.0F;
};

/// What no surface does but a material may ask for: giving more light than it gets, ambient +
/// diffuse + specular > 1 in some channel (of colours: textures are not looked through), or an
/// exponent n outside 0 to 100, whose highlight is smaller than any lamp's. A sentence for each of
/// the first few materials.
std::vector<std::string> material_warnings(const Scene& scene);

/// The two factors for `material`. All vectors of unit length, away from the surface. R is L
/// mirrored at N, H halves L and V. Source: Phong 1975; Blinn 1977.
ReflectionTerms reflection_terms(const Material& material, Vec3f normal, Vec3f to_light,
                                 Vec3f to_viewer) noexcept;

}  // namespace fstop
