// What mappings and relief ask of a packet's surfaces beside what every surface has.
#include "core/scene/lane_surfaces.h"

namespace fstop {

// Both are linear over a triangle: with e1, e2 its edges and n = e1 x e2,
// grad = du1 (e2 x n)/n^2 + du2 (n x e1)/n^2. Zero where there is no uv, or no area.
void SurfaceTable::set_triangle_gradients(const Row& row, std::uint32_t primitive, std::size_t k,
                                          LaneSurfaces& s) const noexcept {
  const auto& t = row.triangles[primitive];
  const auto at = [&](std::uint32_t i) {
    const auto& p = row.positions[i];
    return Vec3f{p[0], p[1], p[2]};
  };
  const Vec3f e1 = at(t[1]) - at(t[0]);
  const Vec3f e2 = at(t[2]) - at(t[0]);
  const Vec3f normal = cross(e1, e2);
  const float squared = dot(normal, normal);
  if (row.uvs == nullptr || !(squared > 0.0F)) return s.set_gradients(k, {}, {});
  const Vec3f along_e1 = cross(e2, normal) * (1.0F / squared);
  const Vec3f along_e2 = cross(normal, e1) * (1.0F / squared);
  const auto gradient = [&](std::size_t c) {
    const float first = row.uvs[t[1]][c] - row.uvs[t[0]][c];
    const float second = row.uvs[t[2]][c] - row.uvs[t[0]][c];
    return along_e1 * first + along_e2 * second;
  };
  s.set_gradients(k, gradient(0), gradient(1));
}

void SurfaceTable::follow_maps(const RayPacket& packet, LaneSurfaces& s) const noexcept {
  alignas(64) LaneMask done = {};
  for (std::size_t first = 0; first < kLanes; ++first) {
    if (done[first] != 0 || s.material[first] < 0) continue;
    const std::uint32_t object = packet.object[first];
    const Row& row = rows_[object];
    alignas(64) LaneMask lanes = {};
    for (std::size_t k = first; k < kLanes; ++k) {
      lanes[k] = s.material[k] >= 0 && packet.object[k] == object ? -1 : 0;
      done[k] |= lanes[k];
    }
    if (row.map >= 0) {
      const SurfaceMap& map = maps_[static_cast<std::size_t>(row.map)];
      if (row.has_own_uv) {
        map.fill_gradients(lanes, s);
      } else {
        map.fill(lanes, s);
      }
    } else if (row.needs_gradients) {
      for (std::size_t k = first; k < kLanes; ++k) {
        if (lanes[k] != 0) set_triangle_gradients(row, packet.primitive[k], k, s);
      }
    }
  }
}

}  // namespace fstop
