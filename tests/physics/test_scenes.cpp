#include "tests/physics/test_scenes.h"

#include <algorithm>
#include <stdexcept>

namespace fstop {

SimulationSpec lens_shot(double f_number, Length pitch, int width, int height) {
  SimulationSpec spec;
  spec.camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = f_number}, .focus_distance = 2.0_m};
  spec.camera.sensor_width = pitch * width;
  spec.camera.sensor_height = pitch * height;
  spec.width = width;
  spec.height = height;
  return spec;
}

SimulationSpec pinhole_shot(Length diameter, Length pitch, int width, int height) {
  SimulationSpec spec = lens_shot(1.0, pitch, width, height);
  spec.camera.optics = PinholeSpec{.image_distance = 50.0_mm, .diameter = diameter};
  return spec;
}

Object glowing_quad(Vec3 corner, Vec3 edge_u, Vec3 edge_v) {
  return {.shape = QuadObject{.corner = corner, .edge_u = edge_u, .edge_v = edge_v}, .material = 0};
}

Object glowing_square(const SimulationSpec& shot, Length depth, double side_px) {
  const Length pitch = shot.camera.sensor_width / shot.width;
  const double side = side_px * (pitch * (depth / sensor_distance(shot.camera))).si();
  return glowing_quad({-side / 2, -side / 2, -depth.si()}, {side, 0, 0}, {0, side, 0});
}

Scene glowing_scene(std::vector<Object> objects) {
  Scene scene;
  scene.materials = {Material{.name = "glow", .emission = {.value = {1.0F, 1.0F, 1.0F}}}};
  scene.objects = std::move(objects);
  return scene;
}

Image finished_exr(const SimulationSpec& spec, const RayScene& scene, int threads) {
  WorkerPool workers(threads);
  RunControl run;
  run.workers = &workers;
  const Photograph photograph = simulate(spec, scene, run);
  const Picture picture{.layers = {{.channel_names = {"R", "G", "B"}, .image = photograph.color}}};
  const Picture read = decode(encode(picture, ImageFormat::exr));
  // The codec may order channels as the file does: pick R, G and B by name.
  Image image(spec.width, spec.height, 3);
  int found = 0;
  for (const ImageLayer& layer : read.layers) {
    for (std::size_t c = 0; c < layer.channel_names.size(); ++c) {
      const auto target = std::string("RGB").find(layer.channel_names[c]);
      if (layer.channel_names[c].size() != 1 || target == std::string::npos) continue;
      ++found;
      for (int y = 0; y < spec.height; ++y) {
        for (int x = 0; x < spec.width; ++x) image.at(x, y)[target] = layer.image.at(x, y)[c];
      }
    }
  }
  if (found != 3) throw std::runtime_error("the EXR lacks R, G or B");
  return image;
}

}  // namespace fstop
