#include "tests/bench/bench_scenes.h"

#include <cmath>
#include <numbers>

namespace fstop {
namespace {

TextureSource checker(int size, int squares) {
  TextureSource texture{.name = "checker", .image = Image(size, size, 3)};
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const bool bright = ((x * squares / size + y * squares / size) & 1) != 0;
      for (int c = 0; c < 3; ++c) texture.image.at(x, y)[c] = bright ? 0.8F : 0.15F;
    }
  }
  return texture;
}

Material textured(ShadingModel model) {
  Material material{.model = model};
  ColorSource& color = model == ShadingModel::unlit ? material.emission : material.diffuse;
  color = {.value = {1.0F, 1.0F, 1.0F}, .texture = 0};
  return material;
}

Object quad(Vec3 corner, Vec3 u, Vec3 v) {
  return {.shape = QuadObject{.corner = corner, .edge_u = u, .edge_v = v}, .material = 0};
}

Object sphere_of_triangles(Vec3 center, double radius, int rings) {
  Mesh mesh;
  const int sectors = 2 * rings;
  for (int i = 0; i <= rings; ++i) {
    for (int j = 0; j <= sectors; ++j) {
      const double polar = std::numbers::pi * i / rings;
      const double around = 2.0 * std::numbers::pi * j / sectors;
      const Vec3 normal{std::sin(polar) * std::cos(around), std::cos(polar),
                        std::sin(polar) * std::sin(around)};
      const Vec3f p = to_float(center + normal * radius);
      const Vec3f n = to_float(normal);
      mesh.positions.push_back({p.x, p.y, p.z});
      mesh.normals.push_back({n.x, n.y, n.z});
      mesh.uvs.push_back({static_cast<float>(j) / static_cast<float>(sectors),
                          1.0F - static_cast<float>(i) / static_cast<float>(rings)});
    }
  }
  const auto columns = static_cast<std::uint32_t>(sectors + 1);
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(rings); ++i) {
    for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(sectors); ++j) {
      const std::uint32_t a = i * columns + j;
      if (i > 0) mesh.triangles.push_back({a, a + 1, a + columns + 1});
      if (i + 1 < static_cast<std::uint32_t>(rings)) {
        mesh.triangles.push_back({a, a + columns + 1, a + columns});
      }
    }
  }
  return {.shape = MeshObject{.file = "sphere", .mesh = std::move(mesh)}, .material = 0};
}

}  // namespace

Scene bench_slats() {
  Scene scene;
  scene.textures = {checker(1024, 64)};
  scene.materials = {textured(ShadingModel::unlit)};
  scene.objects.push_back(quad({-3, -2, -6}, {6, 0, 0}, {0, 4, 0}));
  for (int i = 0; i < 3; ++i) {
    scene.objects.push_back(quad({-0.6 + 0.42 * i, -0.2, -2}, {0.36, 0, 0}, {0, 0.4, 0}));
  }
  for (int i = 0; i < 13; ++i) {
    scene.objects.push_back(quad({-0.3 + 0.048 * i, -0.25, -0.8}, {0.006, 0, 0}, {0, 0.5, 0}));
  }
  return scene;
}

Scene bench_mesh(ShadingModel model) {
  Scene scene;
  scene.textures = {checker(1024, 64)};
  scene.materials = {textured(model)};
  scene.objects.push_back(quad({-8, -0.3, 0.5}, {16, 0, 0}, {0, 0, -16}));
  for (int i = 0; i < 48; ++i) {
    const double depth = 0.9 * std::pow(8.0 / 0.9, i / 47.0);
    const double across = 0.3 * depth * (2.0 * std::fmod(i * 0.618034, 1.0) - 1.0);
    scene.objects.push_back(sphere_of_triangles({across, -0.3 + 0.05 * (1 + i % 4), -depth},
                                                0.07 + 0.01 * (i % 3), 23));
  }
  Light sun{.kind = DirectionalLight{.direction = {0.4, -0.8, -0.4}},
            .intensity = {0.9F, 0.9F, 0.85F}};
  scene.lights = {sun};
  scene.background = {0.4F, 0.5F, 0.7F};
  return scene;
}

}  // namespace fstop
