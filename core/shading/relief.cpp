#include "core/shading/relief.h"

#include <algorithm>
#include <cmath>

namespace fstop {
namespace {

constexpr float kSteepest = 1e6F;

// Within what can be squared; 0 for what is not a number.
float bounded(float slope) {
  return slope == slope ? std::clamp(slope, -kSteepest, kSteepest) : 0.0F;
}
Vec3f bounded(Vec3f a) { return {bounded(a.x), bounded(a.y), bounded(a.z)}; }

/// The relief of one material's lanes.
class Relief {
 public:
  Relief(const RayScene& scene, const LaneMask& lanes, const LaneFloats& footprint,
         LaneSurfaces& surfaces)
      : scene_(scene), lanes_(lanes), footprint_(footprint), surfaces_(surfaces) {
    along_normal_.fill(1.0F);
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (lanes[k] == 0) continue;
      outwards_[k] = surfaces.outside[k] != 0 ? surfaces.normal(k) : -surfaces.normal(k);
    }
  }

  void add(const NormalMap& map) {
    if (map.texture < 0) return;
    const Texture& texture = scene_.texture(map.texture);
    const auto scale = static_cast<float>(map.scale);
    LaneColors texels;
    texture.sample(lanes_, surfaces_.u, surfaces_.v, widths(texture), texels);
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (lanes_[k] == 0) continue;
      const Vec3f n = outwards_[k];
      const Vec3f u = surfaces_.du(k);
      const Vec3f v = surfaces_.dv(k);
      const float turn = dot(n, cross(u, v)) < 0.0F ? -1.0F : 1.0F;
      const Vec3f tangent = normalized(cross(v, n)) * turn;
      const Vec3f bitangent = cross(n, tangent) * turn;
      along_normal_[k] = std::clamp(2.0F * texels.b[k] - 1.0F, 0.0F, kSteepest);
      tilt_[k] = bounded(tangent * (scale * (2.0F * texels.r[k] - 1.0F)) +
                         bitangent * (scale * (2.0F * texels.g[k] - 1.0F)));
    }
  }

  void add(const BumpMap& map) {
    if (map.texture < 0) return;
    const Texture& texture = scene_.texture(map.texture);
    const auto scale = static_cast<float>(map.scale);
    const LaneFloats width = widths(texture);
    const LaneFloats along_u = slopes(texture, width, 0.5F / texture.width(), 0.0F);
    const LaneFloats along_v = slopes(texture, width, 0.0F, 0.5F / texture.height());
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (lanes_[k] == 0) continue;
      const Vec3f n = outwards_[k];
      const Vec3f gradient =
          bounded((surfaces_.du(k) * along_u[k] + surfaces_.dv(k) * along_v[k]) * scale);
      tilt_[k] = tilt_[k] - (gradient - n * dot(n, gradient)) * along_normal_[k];
    }
  }

  void tilt_normals() {
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (lanes_[k] == 0 || tilt_[k] == Vec3f{}) continue;
      const Vec3f tilted = normalized(outwards_[k] * along_normal_[k] + bounded(tilt_[k]));
      const Vec3f normal = surfaces_.outside[k] != 0 ? tilted : -tilted;
      surfaces_.normal_x[k] = normal.x;
      surfaces_.normal_y[k] = normal.y;
      surfaces_.normal_z[k] = normal.z;
    }
  }

 private:
  // Texels that a lookup averages over.
  LaneFloats widths(const Texture& texture) const {
    LaneFloats result = {};
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (lanes_[k] == 0) continue;
      result[k] = footprint_[k] * surfaces_.uv_per_metre[k] * texture.texels_per_uv();
    }
    return result;
  }

  LaneFloats heights(const Texture& texture, const LaneFloats& u, const LaneFloats& v,
                     const LaneFloats& width) const {
    LaneColors texels;
    texture.sample(lanes_, u, v, width, texels);
    LaneFloats result = {};
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (lanes_[k] != 0) result[k] = (texels.r[k] + texels.g[k] + texels.b[k]) / 3.0F;
    }
    return result;
  }

  // Differences of heights over the steps as they round, (half_u, half_v) half a texel.
  LaneFloats slopes(const Texture& texture, const LaneFloats& width, float half_u,
                    float half_v) const {
    LaneFloats low_u = {}, low_v = {}, high_u = {}, high_v = {};
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (lanes_[k] == 0) continue;
      const float texels = width[k] > 1.0F ? width[k] : 1.0F;
      low_u[k] = surfaces_.u[k] - texels * half_u;
      low_v[k] = surfaces_.v[k] - texels * half_v;
      high_u[k] = surfaces_.u[k] + texels * half_u;
      high_v[k] = surfaces_.v[k] + texels * half_v;
    }
    const LaneFloats low = heights(texture, low_u, low_v, width);
    LaneFloats result = heights(texture, high_u, high_v, width);
    for (std::size_t k = 0; k < kLanes; ++k) {
      const float step = high_u[k] - low_u[k] + (high_v[k] - low_v[k]);
      result[k] = step > 0.0F ? (result[k] - low[k]) / step : 0.0F;
    }
    return result;
  }

  const RayScene& scene_;
  const LaneMask& lanes_;
  const LaneFloats& footprint_;
  LaneSurfaces& surfaces_;
  std::array<Vec3f, kLanes> outwards_ = {};
  std::array<Vec3f, kLanes> tilt_ = {};
  LaneFloats along_normal_ = {};
};

}  // namespace

void add_relief(const RayScene& scene, const LaneFloats& footprint,
                LaneSurfaces& surfaces) noexcept {
  alignas(64) LaneMask done = {};
  for (std::size_t first = 0; first < kLanes; ++first) {
    if (done[first] != 0 || surfaces.material[first] < 0) continue;
    const std::int32_t number = surfaces.material[first];
    alignas(64) LaneMask lanes = {};
    for (std::size_t k = first; k < kLanes; ++k) {
      lanes[k] = surfaces.material[k] == number ? -1 : 0;
      done[k] |= lanes[k];
    }
    const Material& material = scene.material(number);
    const bool has_relief = material.bump.texture >= 0 || material.normal_map.texture >= 0;
    if (!has_relief) continue;
    Relief relief(scene, lanes, footprint, surfaces);
    relief.add(material.normal_map);
    relief.add(material.bump);
    relief.tilt_normals();
  }
}

}  // namespace fstop
