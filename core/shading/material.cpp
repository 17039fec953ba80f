#include "core/shading/material.h"

#include <algorithm>
#include <cmath>

namespace fstop {

Rgb color_at(const RayScene& scene, const ColorSource& source, const Surface& surface,
             float footprint) noexcept {
  if (source.texture < 0) return source.value;
  const Texture& texture = scene.texture(source.texture);
  const float texels = footprint * surface.uv_per_metre * texture.texels_per_uv();
  return texture.sample(surface.u, surface.v, texels) * source.value;
}

ReflectionTerms reflection_terms(const Material& material, Vec3f normal, Vec3f to_light,
                                 Vec3f to_viewer) noexcept {
  const float cosine = dot(normal, to_light);
  if (!(cosine > 0.0F)) return {};
  float base = 0.0F;
  if (material.model == ShadingModel::blinn_phong) {
    base = dot(normal, normalized(to_light + to_viewer));
  } else {
    base = 2.0F * cosine * dot(normal, to_viewer) - dot(to_light, to_viewer);
  }
  const float shine = base > 0.0F ? std::pow(base, static_cast<float>(material.shininess)) : 0.0F;
  return {.diffuse = cosine, .specular = shine};
}

}  // namespace fstop
