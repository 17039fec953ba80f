#pragma once

#include <algorithm>
#include <cmath>

#include "core/render/simulation.h"

namespace fstop {

/// Scenes of tests: bars before a wall of squares, all unlit and without filters of their own, so
/// that a picture's only error against geometric optics is its method's.

/// Squares of `cell` texels on a wall 6 m wide and 4 m high that faces the camera at `depth`.
inline Scene wall_scene(double depth, int cell = 4) {
  Scene scene;
  TextureSource squares{
      .name = "squares", .filter = TextureFilter::bilinear, .image = Image(96, 64, 3)};
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 96; ++x) {
      const bool light = ((x / cell + y / cell) & 1) != 0;
      squares.image.at(x, y)[0] = light ? 0.9F : 0.1F;
      squares.image.at(x, y)[1] = light ? 0.8F : 0.15F;
      squares.image.at(x, y)[2] = light ? 0.6F : 0.2F;
    }
  }
  scene.textures = {squares};
  scene.materials = {Material{.emission = {.value = {1, 1, 1}, .texture = 0}}};
  scene.objects = {
      {.shape = QuadObject{.corner = {-3, -2, -depth}, .edge_u = {6, 0, 0}, .edge_v = {0, 4, 0}}}};
  return scene;
}

/// Adds an upright bar, 2 m high.
inline void add_bar(Scene& scene, double left, double width, double depth, Rgb color) {
  scene.materials.push_back(Material{.emission = {.value = color}});
  scene.objects.push_back(
      {.shape =
           QuadObject{.corner = {left, -1, -depth}, .edge_u = {width, 0, 0}, .edge_v = {0, 2, 0}},
       .material = static_cast<int>(scene.materials.size()) - 1});
}

/// A 50 mm lens focused at 2 m, diffraction switched off.
inline SimulationSpec lens_shot(double f_number, int width, int height) {
  SimulationSpec spec;
  spec.camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = f_number}, .focus_distance = 2.0_m};
  spec.effects.diffraction = EffectChoice::off;
  spec.width = width;
  spec.height = height;
  return spec;
}

/// Lens sampling with as many samples of a pixel, apart from any seed that tests use.
inline Image truth_of(SimulationSpec spec, const RayScene& scene, int samples) {
  spec.quality = {.method = "lens-sampling", .samples = samples};
  spec.seed = 0x7e57U;
  return simulate(spec, scene, {}).color;
}

/// Mean squared difference, values clipped to [0,1].
inline double mse_of(const Image& a, const Image& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.pixels().size(); ++i) {
    const auto x = static_cast<double>(std::clamp(a.pixels()[i], 0.0F, 1.0F));
    const auto y = static_cast<double>(std::clamp(b.pixels()[i], 0.0F, 1.0F));
    sum += (x - y) * (x - y);
  }
  return sum / static_cast<double>(a.pixels().size());
}

}  // namespace fstop
