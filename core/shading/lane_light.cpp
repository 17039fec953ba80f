#include "core/shading/lane_light.h"

#include <cmath>

#include "core/fast_math.h"
#include "core/shading/light.h"

namespace fstop {
namespace {

using Doubles = std::array<double, 3>;

FSTOP_KERNEL void point_toward(std::size_t k, float dx, float dy, float dz, LaneLight& out) {
  const float distance = std::sqrt(dx * dx + dy * dy + dz * dz);
  // A surface through the light: no direction, no light.
  const float scale = distance > 0.0F ? 1.0F / distance : 0.0F;
  out.x[k] = dx * scale;
  out.y[k] = dy * scale;
  out.z[k] = dz * scale;
  out.distance[k] = distance;
}

FSTOP_KERNEL void attenuate(const Doubles& a, LaneLight& out) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const double d = static_cast<double>(out.distance[k]);
    const double factor = 1.0 / (a[0] + a[1] * d + a[2] * d * d);
    const double bounded = factor < kLargestAttenuation ? factor : kLargestAttenuation;
    out.factor[k] = d > 0.0 ? static_cast<float>(bounded) : 0.0F;
  }
}

FSTOP_KERNEL void from_afar(Vec3f direction, LaneLight& out) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    out.x[k] = direction.x;
    out.y[k] = direction.y;
    out.z[k] = direction.z;
    out.distance[k] = kFar;
    out.factor[k] = 1.0F;
  }
}
FSTOP_AVX512 void from_afar_wide(Vec3f direction, LaneLight& out) { from_afar(direction, out); }

FSTOP_KERNEL void from_point(Vec3f source, const Doubles& attenuation, const LaneSurfaces& s,
                             LaneLight& out) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    point_toward(k, source.x - s.x[k], source.y - s.y[k], source.z - s.z[k], out);
  }
  attenuate(attenuation, out);
}
FSTOP_AVX512 void from_point_wide(Vec3f source, const Doubles& attenuation, const LaneSurfaces& s,
                                  LaneLight& out) {
  from_point(source, attenuation, s, out);
}

FSTOP_KERNEL void from_points(const std::array<LaneFloats, 3>& source, const Doubles& attenuation,
                              const LaneSurfaces& s, LaneLight& out) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    point_toward(k, source[0][k] - s.x[k], source[1][k] - s.y[k], source[2][k] - s.z[k], out);
  }
  attenuate(attenuation, out);
}
FSTOP_AVX512 void from_points_wide(const std::array<LaneFloats, 3>& source,
                                   const Doubles& attenuation, const LaneSurfaces& s,
                                   LaneLight& out) {
  from_points(source, attenuation, s, out);
}

// max(0, cos)^n, also for n = 0: nothing behind the lamp.
FSTOP_KERNEL void narrow_beam(Vec3f beam, float exponent, LaneLight& out) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float cosine = -(out.x[k] * beam.x + out.y[k] * beam.y + out.z[k] * beam.z);
    const float bounded = cosine < 1.0F ? cosine : 1.0F;
    out.factor[k] *= cosine > 0.0F ? fast_power(bounded, exponent) : 0.0F;
  }
}
FSTOP_AVX512 void narrow_beam_wide(Vec3f beam, float exponent, LaneLight& out) {
  narrow_beam(beam, exponent, out);
}

Doubles coefficients(const Attenuation& a) { return {a.a0, a.a1, a.a2}; }

struct LaneIncidence {
  const LaneSurfaces& surfaces;
  const LaneValues& u;
  const LaneValues& v;
  LaneLight& out;

  void operator()(const DirectionalLight& light) const {
    const Vec3f l = to_float(normalized(light.direction * -1.0));
    if (has_avx512()) return from_afar_wide(l, out);
    from_afar(l, out);
  }
  void operator()(const PointLight& light) const { point(light.position, light.attenuation); }
  void operator()(const SpotLight& light) const {
    point(light.position, light.attenuation);
    const Vec3f beam = to_float(normalized(light.direction));
    const auto exponent = static_cast<float>(light.exponent);
    if (has_avx512()) return narrow_beam_wide(beam, exponent, out);
    narrow_beam(beam, exponent, out);
  }
  void operator()(const AreaLight& light) const {
    alignas(64) std::array<LaneFloats, 3> source;
    for (std::size_t k = 0; k < kLanes; ++k) {
      const Vec3f p = to_float(light.corner + light.edge_u * u[k] + light.edge_v * v[k]);
      source[0][k] = p.x;
      source[1][k] = p.y;
      source[2][k] = p.z;
    }
    const Doubles a = coefficients(light.attenuation);
    if (has_avx512()) return from_points_wide(source, a, surfaces, out);
    from_points(source, a, surfaces, out);
  }
  void point(Vec3 position, const Attenuation& attenuation) const {
    const Vec3f source = to_float(position);
    const Doubles a = coefficients(attenuation);
    if (has_avx512()) return from_point_wide(source, a, surfaces, out);
    from_point(source, a, surfaces, out);
  }
};

FSTOP_KERNEL void diffuse_terms(const LitLanes& lit, const LaneSurfaces& s, const LaneLight& light,
                                LaneTerms& terms) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float cosine =
        s.normal_x[k] * light.x[k] + s.normal_y[k] * light.y[k] + s.normal_z[k] * light.z[k];
    terms.diffuse[k] = lit.mask[k] != 0 && cosine > 0.0F ? cosine : 0.0F;
    terms.specular[k] = 0.0F;
  }
}

FSTOP_KERNEL void specular_terms(const LitLanes& lit, const LaneSurfaces& s,
                                 const RayPacket& packet, const LaneLight& light,
                                 LaneTerms& terms) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float vx = -packet.dir_x[k];
    const float vy = -packet.dir_y[k];
    const float vz = -packet.dir_z[k];
    const float n_v = s.normal_x[k] * vx + s.normal_y[k] * vy + s.normal_z[k] * vz;
    const float l_v = light.x[k] * vx + light.y[k] * vy + light.z[k] * vz;
    const float mirrored = 2.0F * terms.diffuse[k] * n_v - l_v;
    // |L + V| of two unit vectors; L is the zero vector only where the diffuse term is 0.
    const float half = std::sqrt(2.0F + 2.0F * (l_v > -1.0F ? l_v : -1.0F));
    const float halfway = (terms.diffuse[k] + n_v) / (half > 1e-6F ? half : 1e-6F);
    const float base = lit.blinn[k] != 0 ? halfway : mirrored;
    const float bounded = base < 1.0F ? base : 1.0F;
    const float shine = base > 0.0F ? fast_power(bounded, lit.shininess[k]) : 0.0F;
    terms.specular[k] = terms.diffuse[k] > 0.0F ? shine : 0.0F;
  }
}

FSTOP_KERNEL void all_terms(const LitLanes& lit, const LaneSurfaces& s, const RayPacket& packet,
                            const LaneLight& light, LaneTerms& terms) {
  diffuse_terms(lit, s, light, terms);
  if (lit.any_specular) specular_terms(lit, s, packet, light, terms);
}
FSTOP_AVX512 void all_terms_wide(const LitLanes& lit, const LaneSurfaces& s,
                                 const RayPacket& packet, const LaneLight& light,
                                 LaneTerms& terms) {
  all_terms(lit, s, packet, light, terms);
}

FSTOP_KERNEL void shares(const LitLanes& lit, const LaneLight& light, const LaneTerms& terms,
                         const Rgb& intensity, LaneColors& share, LaneMask& asked) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float d = terms.diffuse[k];
    const float s = terms.specular[k];
    const float f = light.factor[k];
    const float r = f * intensity[0] * (lit.diffuse.r[k] * d + lit.specular.r[k] * s);
    const float g = f * intensity[1] * (lit.diffuse.g[k] * d + lit.specular.g[k] * s);
    const float b = f * intensity[2] * (lit.diffuse.b[k] * d + lit.specular.b[k] * s);
    const bool counts = (r != 0.0F) | (g != 0.0F) | (b != 0.0F);
    share.r[k] = r;
    share.g[k] = g;
    share.b[k] = b;
    asked[k] = lit.mask[k] != 0 && counts ? -1 : 0;
  }
}

// A shadow ray leaves on the light's side, so that it does not meet its own triangle.
FSTOP_KERNEL void aim(const LaneSurfaces& s, const RayPacket& packet, const LaneLight& light,
                      RayPacket& shadow) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float towards =
        s.face_x[k] * light.x[k] + s.face_y[k] * light.y[k] + s.face_z[k] * light.z[k];
    const float off = towards >= 0.0F ? s.error[k] : -s.error[k];
    shadow.org_x[k] = s.x[k] + s.face_x[k] * off;
    shadow.org_y[k] = s.y[k] + s.face_y[k] * off;
    shadow.org_z[k] = s.z[k] + s.face_z[k] * off;
    shadow.dir_x[k] = light.x[k];
    shadow.dir_y[k] = light.y[k];
    shadow.dir_z[k] = light.z[k];
    shadow.near[k] = 0.0F;
    shadow.far[k] = light.distance[k] * (1.0F - 1e-5F);
    shadow.time[k] = packet.time[k];
    shadow.mask[k] = 0xffffffffU;
    shadow.flags[k] = 0;
    shadow.id[k] = 0;
  }
}

FSTOP_KERNEL void cast(const LitLanes& lit, const LaneSurfaces& s, const RayPacket& packet,
                       const LaneLight& light, const LaneTerms& terms, const Rgb& intensity,
                       LaneColors& share, RayPacket& shadow, LaneMask& asked) {
  shares(lit, light, terms, intensity, share, asked);
  aim(s, packet, light, shadow);
}
FSTOP_AVX512 void cast_wide(const LitLanes& lit, const LaneSurfaces& s, const RayPacket& packet,
                            const LaneLight& light, const LaneTerms& terms, const Rgb& intensity,
                            LaneColors& share, RayPacket& shadow, LaneMask& asked) {
  cast(lit, s, packet, light, terms, intensity, share, shadow, asked);
}

}  // namespace

void incident_light(const Light& light, const LaneSurfaces& surfaces, const LaneValues& u,
                    const LaneValues& v, LaneLight& result) noexcept {
  std::visit(LaneIncidence{surfaces, u, v, result}, light.kind);
}

void reflection_terms(const LitLanes& lit, const LaneSurfaces& surfaces, const RayPacket& packet,
                      const LaneLight& light, LaneTerms& terms) noexcept {
  if (has_avx512()) return all_terms_wide(lit, surfaces, packet, light, terms);
  all_terms(lit, surfaces, packet, light, terms);
}

void cast_shadow_rays(const LitLanes& lit, const LaneSurfaces& surfaces, const RayPacket& packet,
                      const LaneLight& light, const LaneTerms& terms, const Rgb& intensity,
                      LaneColors& share, RayPacket& shadow, LaneMask& asked) noexcept {
  if (has_avx512()) {
    cast_wide(lit, surfaces, packet, light, terms, intensity, share, shadow, asked);
  } else {
    cast(lit, surfaces, packet, light, terms, intensity, share, shadow, asked);
  }
}

}  // namespace fstop
