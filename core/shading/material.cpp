#include "core/shading/material.h"

#include <algorithm>
#include <cmath>

namespace fstop {

void MaterialColors::at(const ColorSource& source, const LaneMask& lanes,
                        LaneColors& colors) noexcept {
  if (source.texture < 0) {
    colors.r.fill(source.value[0]);
    colors.g.fill(source.value[1]);
    colors.b.fill(source.value[2]);
    return;
  }
  if (source.texture != texture_) {
    const Texture& texture = scene_.texture(source.texture);
    alignas(64) LaneFloats texels;
    for (std::size_t k = 0; k < kLanes; ++k) {
      texels[k] = footprint_[k] * surfaces_.uv_per_metre[k] * texture.texels_per_uv();
    }
    texture.sample(lanes, surfaces_.u, surfaces_.v, texels, texels_);
    texture_ = source.texture;
  }
  for (std::size_t k = 0; k < kLanes; ++k) {
    colors.r[k] = texels_.r[k] * source.value[0];
    colors.g[k] = texels_.g[k] * source.value[1];
    colors.b[k] = texels_.b[k] * source.value[2];
  }
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
