#include "core/shading/texture_footprint.h"

#include <algorithm>
#include <cmath>

namespace fstop {

void place_on_film(const ShadingInputs& in, const RayPacket& packet, LaneSurfaces& surfaces,
                   LaneFloats& footprint) noexcept {
  for (std::size_t k = 0; k < kLanes; ++k) {
    if (surfaces.material[k] < 0 || !in.scene.is_on_screen(packet.object[k])) continue;
    surfaces.u[k] = in.film != nullptr ? in.film->u[k] : 0.0F;
    surfaces.v[k] = in.film != nullptr ? in.film->v[k] : 0.0F;
    surfaces.uv_per_metre[k] = 1.0F;
    footprint[k] = in.film != nullptr ? in.film->lookup_width : 0.0F;
  }
}

TexelEllipse ellipse_of(float uu, float uv, float vv) noexcept {
  const float mean = 0.5F * (uu + vv);
  const float half = 0.5F * (uu - vv);
  const float radius = std::sqrt(half * half + uv * uv);
  TexelEllipse ellipse{.major = std::sqrt(mean + radius),
                       .minor = std::sqrt(std::max(0.0F, mean - radius))};
  // Of the two columns of M less the smaller eigenvalue, the longer: both lie along the axis.
  const float along_u = half >= 0.0F ? radius + half : uv;
  const float along_v = half >= 0.0F ? uv : radius - half;
  const float length = std::sqrt(along_u * along_u + along_v * along_v);
  if (length > 0.0F) {
    ellipse.major_u = along_u / length;
    ellipse.major_v = along_v / length;
  }
  return ellipse;
}

namespace {

constexpr float kSmallestCosine = 1.0F / 64.0F;

TexelEllipse ellipse_on_surface(Vec3f direction, Vec3f normal, Vec3f du, Vec3f dv, float width) {
  const float along = dot(direction, normal);
  const float cosine = std::max(std::abs(along), kSmallestCosine);
  const Vec3f slant = (direction - normal * along) * (1.0F / cosine);
  const Vec3f u = (du - normal * dot(normal, du)) * width;
  const Vec3f v = (dv - normal * dot(normal, dv)) * width;
  const float slant_u = dot(slant, u);
  const float slant_v = dot(slant, v);
  return ellipse_of(dot(u, u) + slant_u * slant_u, dot(u, v) + slant_u * slant_v,
                    dot(v, v) + slant_v * slant_v);
}

// Every lane's probes: where the first lies, the way to the next, and how many.
struct Probes {
  LaneFloats u = {}, v = {};
  LaneFloats step_u = {}, step_v = {};
  LaneFloats width = {};  // texels
  std::array<int, kLanes> count = {};

  void set(std::size_t k, const TexelEllipse& ellipse, const Texture& texture, float at_u,
           float at_v) {
    const float ratio = ellipse.major / std::max(ellipse.minor, 1.0F);
    // False for what is not a number.
    const int wanted = ratio > 1.0F ? static_cast<int>(std::min(ratio, 1e3F) + 0.999F) : 1;
    count[k] = std::min(wanted, kMostProbes);
    const float step = ellipse.major / static_cast<float>(count[k]);
    width[k] = std::max(ellipse.minor, step);
    step_u[k] = step * ellipse.major_u / texture.width();
    step_v[k] = step * ellipse.major_v / texture.height();
    const float back = 0.5F * static_cast<float>(count[k] - 1);
    u[k] = at_u - back * step_u[k];
    v[k] = at_v - back * step_v[k];
  }
};

}  // namespace

void sample_anisotropic(const RayScene& scene, const Texture& texture, const LaneMask& lanes,
                        const RayPacket& packet, const LaneSurfaces& surfaces,
                        const LaneFloats& footprint, LaneColors& colors) noexcept {
  Probes probes;
  int most = 0;
  for (std::size_t k = 0; k < kLanes; ++k) {
    if (lanes[k] == 0) continue;
    TexelEllipse ellipse;
    if (scene.is_on_screen(packet.object[k])) {
      const float u = footprint[k] * texture.width();
      const float v = footprint[k] * texture.height();
      ellipse = ellipse_of(u * u, 0.0F, v * v);
    } else {
      ellipse = ellipse_on_surface(packet.direction(static_cast<int>(k)), surfaces.face(k),
                                   surfaces.du(k) * texture.width(),
                                   surfaces.dv(k) * texture.height(), footprint[k]);
    }
    probes.set(k, ellipse, texture, surfaces.u[k], surfaces.v[k]);
    most = std::max(most, probes.count[k]);
  }
  colors = {};
  LaneColors probe;
  for (int i = 0; i < most; ++i) {
    alignas(64) LaneMask asked = {};
    for (std::size_t k = 0; k < kLanes; ++k) asked[k] = i < probes.count[k] ? lanes[k] : 0;
    texture.sample(asked, probes.u, probes.v, probes.width, probe);
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (asked[k] == 0) continue;
      const float share = 1.0F / static_cast<float>(probes.count[k]);
      colors.r[k] += share * probe.r[k];
      colors.g[k] += share * probe.g[k];
      colors.b[k] += share * probe.b[k];
      probes.u[k] += probes.step_u[k];
      probes.v[k] += probes.step_v[k];
    }
  }
}

}  // namespace fstop
