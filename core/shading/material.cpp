#include "core/shading/material.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

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

std::vector<std::string> material_warnings(const Scene& scene) {
  constexpr std::size_t kMost = 8;
  // Shares written in decimals may add up to a rounding above 1.
  constexpr double kSlack = 1e-6;
  std::vector<std::string> warnings;
  for (const Material& material : scene.materials) {
    if (warnings.size() >= kMost) break;
    char text[32];
    const double passed_on = material.reflection + material.transmission;
    if (material.ior && !material.fresnel && passed_on > 1.0 + kSlack) {
      std::snprintf(text, sizeof text, "%.3g", passed_on);
      warnings.push_back("material " + material.name + ": reflection + transmission is " + text +
                         ", more light than a surface gets");
    }
    if (material.model == ShadingModel::unlit) continue;
    double largest = 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
      double sum = 0.0;
      for (const ColorSource* source : {&material.ambient, &material.diffuse, &material.specular}) {
        if (source->texture < 0) sum += double{source->value[c]};
      }
      largest = std::max(largest, sum);
    }
    if (largest > 1.0 + kSlack) {
      std::snprintf(text, sizeof text, "%.3g", largest);
      warnings.push_back("material " + material.name + ": ambient + diffuse + specular is " + text +
                         ", more light than a surface gets");
    }
    if (material.shininess > 100.0) {
      std::snprintf(text, sizeof text, "%.4g", material.shininess);
      warnings.push_back("material " + material.name + ": shininess " + text +
                         " lies outside 0 to 100, where highlights look like those of lamps");
    }
  }
  return warnings;
}

}  // namespace fstop
