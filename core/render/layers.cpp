#include "core/render/layers.h"

#include <algorithm>

namespace fstop {
namespace {

constexpr Length kLeastDepth = Length::si(1e-9);

void fill_packet(const Shot& shot, const PinholeCamera& camera, int x, int y,
                 GeometryLayers& layers) {
  RayPacket packet;
  alignas(64) LaneMask valid = {};
  const int count = std::min(kLanes, shot.sensor.width - x);
  for (int lane = 0; lane < count; ++lane) {
    const Ray ray = camera.ray({x + lane + 0.5, y + 0.5}, {});
    packet.set(lane, to_float(ray.origin), to_float(ray.direction), kFar, 0.0F);
    valid[static_cast<std::size_t>(lane)] = -1;
  }
  shot.scene->intersect(packet, valid, Coherence::coherent);
  for (int lane = 0; lane < count; ++lane) {
    Length depth = kInfinitelyFar;
    Length distance = kInfinitelyFar;
    Vec3f normal = {};
    if (packet.hit(lane)) {
      const Surface surface = shot.scene->surface(packet, lane);
      const Vec3f p = surface.position;
      const Vec3 offset = Vec3{p.x, p.y, p.z} - camera.pose().position();
      depth = Length::si(dot(offset, camera.pose().forward()));
      distance = Length::si(norm(offset));
      normal = surface.shading_normal;
    }
    *layers.depth.at(x + lane, y) = static_cast<float>(depth.si());
    *layers.distance.at(x + lane, y) = static_cast<float>(distance.si());
    // A surface through the pupil itself has depth 0, where blur has no value: the least depth.
    const Length seen = std::max(depth, kLeastDepth);
    *layers.coc.at(x + lane, y) =
        static_cast<float>(blur_diameter(shot.camera, seen) / shot.sensor.pixel_pitch);
    float* n = layers.normal.at(x + lane, y);
    n[0] = normal.x;
    n[1] = normal.y;
    n[2] = normal.z;
  }
}

}  // namespace

GeometryLayers geometry_layers(const Shot& shot, const RunControl& run) {
  const int width = shot.sensor.width;
  const int height = shot.sensor.height;
  GeometryLayers layers{.depth = Image(width, height, 1),
                        .distance = Image(width, height, 1),
                        .coc = Image(width, height, 1),
                        .normal = Image(width, height, 3)};
  const PinholeCamera camera = central_projection(shot.camera, shot.sensor);
  parallel_for(run, height, [&](int y) {
    for (int x = 0; x < width; x += kLanes) fill_packet(shot, camera, x, y, layers);
  });
  return layers;
}

}  // namespace fstop
