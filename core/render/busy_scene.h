#pragma once

#include "core/scene/scene.h"

namespace fstop {

/// Of tests: a wall with a hard pattern, a mirror ball, a glass sheet, an area light: every kind of
/// sample.
inline Scene busy_scene() {
  Scene scene;
  TextureSource checker{.name = "checker", .image = Image(64, 64, 3)};
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      for (int c = 0; c < 3; ++c) checker.image.at(x, y)[c] = ((x / 4 + y / 4) & 1) ? 0.9F : 0.1F;
    }
  }
  scene.textures = {checker};
  scene.materials = {Material{.model = ShadingModel::phong,
                              .ambient = {.value = {1, 1, 1}},
                              .diffuse = {.value = {0.8F, 0.8F, 0.8F}, .texture = 0}},
                     Material{.model = ShadingModel::phong,
                              .diffuse = {.value = {0.2F, 0.1F, 0.1F}},
                              .specular = {.value = {0.5F, 0.5F, 0.5F}},
                              .shininess = 40,
                              .reflection = 0.5},
                     Material{.emission = {.value = {0.0F, 0.2F, 0.1F}}, .transmission = 0.6}};
  scene.objects = {
      {.shape = QuadObject{.corner = {-3, -2, -5}, .edge_u = {6, 0, 0}, .edge_v = {0, 4, 0}}},
      {.shape = SphereObject{.center = {0.1, 0, -2}, .radius = 0.2}, .material = 1},
      {.shape =
           QuadObject{.corner = {-0.5, -0.3, -1}, .edge_u = {0.4, 0, 0}, .edge_v = {0, 0.6, 0}},
       .material = 2}};
  scene.lights = {
      {.kind = AreaLight{.corner = {-1, 3, 0}, .edge_u = {2, 0, 0}, .edge_v = {0, 0, 1}},
       .intensity = {0.9F, 0.9F, 0.9F}}};
  scene.ambient_light = {0.1F, 0.1F, 0.1F};
  scene.background = {0.3F, 0.4F, 0.6F};
  return scene;
}

}  // namespace fstop
