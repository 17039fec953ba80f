#include "core/shading/material.h"

#include <algorithm>
#include <cmath>

namespace fstop {

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
