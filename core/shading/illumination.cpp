#include "core/shading/illumination.h"

#include <cmath>

#include "core/shading/light.h"
#include "core/shading/material.h"

namespace fstop {
namespace {

// A lane whose surface answers to lights.
struct LitLane {
  int lane = 0;
  const Material* material = nullptr;
  Rgb diffuse = {};
  Rgb specular = {};
  Vec3f to_viewer = {};
  Interpolation interpolation = Interpolation::phong;
};

struct LitLanes {
  std::array<LitLane, kLanes> lanes = {};
  int count = 0;
};

// Gouraud: the factors at the three corners, unshadowed, interpolated to the hit point.
ReflectionTerms gouraud_terms(const RayScene& scene, const Light& light, const LitLane& lit,
                              const Surface& surface, Vec3f eye, float u, float v) {
  const std::array<Corner, 3> corners = scene.corners(surface);
  const std::array<float, 3> weights = {1.0F - surface.b1 - surface.b2, surface.b1, surface.b2};
  ReflectionTerms sum;
  for (std::size_t i = 0; i < 3; ++i) {
    const IncidentLight incident = incident_light(light, corners[i].position, u, v);
    const ReflectionTerms terms = reflection_terms(
        *lit.material, corners[i].normal, incident.to_light, normalized(eye - corners[i].position));
    sum.diffuse += weights[i] * terms.diffuse;
    sum.specular += weights[i] * terms.specular;
  }
  return sum;
}

// One light's share of every lit lane, and the shadow rays that decide whether it arrives.
class LightPass {
 public:
  LightPass(const ShadingInputs& in, const RayPacket& packet,
            const std::array<Surface, kLanes>& surfaces, const LitLanes& lit)
      : in_(in), packet_(packet), surfaces_(surfaces), lit_(lit) {}

  void run(const Light& light, std::uint32_t light_number, LaneColors& colors,
           std::uint64_t& rays) {
    if (is_area_light(light)) choose_light_points(light_number);
    valid_ = {};
    for (int i = 0; i < lit_.count; ++i)
      prepare(light, lit_.lanes[static_cast<std::size_t>(i)], rays);
    if (in_.scene.has_thin_sheets()) {
      add_filtered(colors);
    } else {
      add_unoccluded(colors);
    }
  }

 private:
  void choose_light_points(std::uint32_t light_number) {
    SampleKeys keys = in_.keys;
    for (std::uint32_t& pixel : keys.pixel) {
      pixel = hash_of(pixel, light_number + 4096U * static_cast<std::uint32_t>(in_.depth));
    }
    in_.sequence.fill(keys, Dimension::light_u, u_);
    in_.sequence.fill(keys, Dimension::light_v, v_);
  }

  void prepare(const Light& light, const LitLane& lit, std::uint64_t& rays) {
    const auto k = static_cast<std::size_t>(lit.lane);
    const Surface& surface = surfaces_[k];
    const auto u = static_cast<float>(u_[k]);
    const auto v = static_cast<float>(v_[k]);
    const IncidentLight incident = incident_light(light, surface.position, u, v);
    const ReflectionTerms terms =
        lit.interpolation == Interpolation::gouraud
            ? gouraud_terms(in_.scene, light, lit, surface, packet_.origin(lit.lane), u, v)
            : reflection_terms(*lit.material, surface.shading_normal, incident.to_light,
                               lit.to_viewer);
    const Rgb light_share =
        incident.intensity * (lit.diffuse * terms.diffuse + lit.specular * terms.specular);
    if (light_share[0] == 0.0F && light_share[1] == 0.0F && light_share[2] == 0.0F) return;
    share_[k] = light_share;
    valid_[k] = -1;
    ++rays;
    // The shadow ray leaves on the light's side, so that it does not meet its own triangle.
    const float side = dot(surface.geometric_normal, incident.to_light) >= 0.0F ? 1.0F : -1.0F;
    const Vec3f origin = surface.position + surface.geometric_normal * (side * surface.error);
    shadow_.set(lit.lane, origin, incident.to_light, incident.distance * (1.0F - 1e-5F),
                packet_.time[k]);
  }

  void add(std::size_t k, float factor, LaneColors& colors) {
    colors.r[k] += factor * share_[k][0];
    colors.g[k] += factor * share_[k][1];
    colors.b[k] += factor * share_[k][2];
  }

  void add_unoccluded(LaneColors& colors) {
    in_.scene.occlude(shadow_, valid_, Coherence::coherent);
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (valid_[k] != 0 && shadow_.far[k] >= 0.0F) add(k, 1.0F, colors);
    }
  }

  void add_filtered(LaneColors& colors) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (valid_[k] == 0) continue;
      const int lane = static_cast<int>(k);
      add(k,
          in_.scene.transmittance(shadow_.origin(lane), shadow_.direction(lane), shadow_.far[k],
                                  shadow_.time[k]),
          colors);
    }
  }

  const ShadingInputs& in_;
  const RayPacket& packet_;
  const std::array<Surface, kLanes>& surfaces_;
  const LitLanes& lit_;
  RayPacket shadow_ = {};
  alignas(64) LaneMask valid_ = {};
  std::array<Rgb, kLanes> share_ = {};
  LaneValues u_ = {};
  LaneValues v_ = {};
};

}  // namespace

void shade_locally(const ShadingInputs& in, const RayPacket& packet, const LaneMask& valid,
                   float path_length, std::array<Surface, kLanes>& surfaces, LaneColors& colors,
                   std::uint64_t& rays) noexcept {
  const Scene& scene = in.scene.scene();
  LitLanes lit;
  for (int lane = 0; lane < kLanes; ++lane) {
    const auto k = static_cast<std::size_t>(lane);
    if (valid[k] == 0) continue;
    if (!packet.hit(lane)) {
      colors.set(lane, scene.background);
      continue;
    }
    surfaces[k] = in.scene.surface(packet, lane);
    const Surface& surface = surfaces[k];
    const Material& material = in.scene.material(surface);
    const float footprint = in.footprint_rate * (path_length + packet.far[k]);
    Rgb color = color_at(in.scene, material.emission, surface, footprint);
    if (material.model != ShadingModel::unlit) {
      color =
          color + color_at(in.scene, material.ambient, surface, footprint) * scene.ambient_light;
      lit.lanes[static_cast<std::size_t>(lit.count++)] = {
          .lane = lane,
          .material = &material,
          .diffuse = color_at(in.scene, material.diffuse, surface, footprint),
          .specular = color_at(in.scene, material.specular, surface, footprint),
          .to_viewer = -packet.direction(lane),
          .interpolation = in.scene.interpolation(surface)};
    }
    colors.set(lane, color);
  }
  if (lit.count == 0 || scene.lights.empty()) return;
  LightPass pass(in, packet, surfaces, lit);
  std::uint32_t number = 0;
  for (const Light& light : scene.lights) pass.run(light, number++, colors, rays);
}

}  // namespace fstop
