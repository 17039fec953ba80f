#include "core/shading/illumination.h"

#include <algorithm>
#include <cmath>

#include "core/shading/lane_light.h"
#include "core/shading/light.h"
#include "core/shading/material.h"
#include "core/shading/relief.h"
#include "core/shading/texture_footprint.h"
#include "core/simd.h"

namespace fstop {
namespace {

void copy_lanes(const LaneMask& lanes, const LaneColors& from, LaneColors& to) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    to.r[k] = lanes[k] != 0 ? from.r[k] : to.r[k];
    to.g[k] = lanes[k] != 0 ? from.g[k] : to.g[k];
    to.b[k] = lanes[k] != 0 ? from.b[k] : to.b[k];
  }
}

bool is_black(const ColorSource& source) { return source.value == Rgb{0, 0, 0}; }

// Colours of one material's sources at a packet's surfaces. Keeps the last lookup: a material's
// sources often share one texture.
class MaterialColors {
 public:
  // `footprint`: the width in metres that a lookup averages over, lane by lane.
  MaterialColors(const RayScene& scene, const RayPacket& packet, const LaneSurfaces& surfaces,
                 const LaneFloats& footprint)
      : scene_(scene), packet_(packet), surfaces_(surfaces), footprint_(footprint) {}

  // `source` at the surfaces of `lanes`; other lanes of `colors` are unspecified.
  void at(const ColorSource& source, const LaneMask& lanes, LaneColors& colors) {
    if (source.texture < 0) {
      colors.r.fill(source.value[0]);
      colors.g.fill(source.value[1]);
      colors.b.fill(source.value[2]);
      return;
    }
    if (source.texture != texture_) look_up(source.texture, lanes);
    for (std::size_t k = 0; k < kLanes; ++k) {
      colors.r[k] = texels_.r[k] * source.value[0];
      colors.g[k] = texels_.g[k] * source.value[1];
      colors.b[k] = texels_.b[k] * source.value[2];
    }
  }
  // The next material has other lanes, so that nothing is kept.
  void next_material() noexcept { texture_ = -1; }

 private:
  void look_up(int number, const LaneMask& lanes) {
    const Texture& texture = scene_.texture(number);
    texture_ = number;
    if (texture.filter() == TextureFilter::anisotropic) {
      return sample_anisotropic(scene_, texture, lanes, packet_, surfaces_, footprint_, texels_);
    }
    const float scale = texture.texels_per_uv();
    alignas(64) LaneFloats texels;
    for (std::size_t k = 0; k < kLanes; ++k) {
      texels[k] = footprint_[k] * surfaces_.uv_per_metre[k] * scale;
    }
    texture.sample(lanes, surfaces_.u, surfaces_.v, texels, texels_);
  }

  const RayScene& scene_;
  const RayPacket& packet_;
  const LaneSurfaces& surfaces_;
  const LaneFloats& footprint_;
  int texture_ = -1;
  LaneColors texels_;
};

// What a packet's surfaces are made of, by material: their own light, and how they answer to
// others'.
class SurfaceColors {
 public:
  SurfaceColors(const ShadingInputs& in, const RayPacket& packet, const LaneFloats& footprint,
                const LaneSurfaces& surfaces)
      : in_(in),
        packet_(packet),
        surfaces_(surfaces),
        sources_(in.scene, packet, surfaces, footprint) {}

  /// `lit` may be null where there are no lights.
  void find(LaneColors& colors, LitLanes* lit) {
    if (surfaces_.only_material >= 0) return find_one(surfaces_.only_material, colors, lit);
    alignas(64) LaneMask done = {};
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (done[k] != 0 || surfaces_.material[k] < 0) continue;
      const std::int32_t number = surfaces_.material[k];
      for (std::size_t i = 0; i < kLanes; ++i) {
        done[i] |= surfaces_.material[i] == number ? -1 : 0;
      }
      find_one(number, colors, lit);
    }
  }

 private:
  void find_one(std::int32_t number, LaneColors& colors, LitLanes* lit) {
    alignas(64) LaneMask lanes;
    for (std::size_t k = 0; k < kLanes; ++k) lanes[k] = surfaces_.material[k] == number ? -1 : 0;
    add(in_.scene.material(number), lanes, colors, lit);
  }

  void add(const Material& material, const LaneMask& lanes, LaneColors& colors, LitLanes* lit) {
    sources_.next_material();
    const bool everywhere = surfaces_.all_hit && surfaces_.only_material >= 0;
    if (everywhere && material.model == ShadingModel::unlit) {
      return sources_.at(material.emission, lanes, colors);
    }
    LaneColors color;
    sources_.at(material.emission, lanes, color);
    if (material.model == ShadingModel::unlit) return copy_lanes(lanes, color, colors);
    const Rgb& ambient_light = in_.scene.scene().ambient_light;
    const bool has_ambient = in_.illumination != Illumination::global;
    if (has_ambient && !is_black(material.ambient) && ambient_light != Rgb{0, 0, 0}) {
      LaneColors ambient;
      sources_.at(material.ambient, lanes, ambient);
      for (std::size_t k = 0; k < kLanes; ++k) {
        color.r[k] += ambient.r[k] * ambient_light[0];
        color.g[k] += ambient.g[k] * ambient_light[1];
        color.b[k] += ambient.b[k] * ambient_light[2];
      }
    }
    copy_lanes(lanes, color, colors);
    if (lit != nullptr) add_answer(material, lanes, *lit);
  }

  // How a material's lanes answer to light.
  void add_answer(const Material& material, const LaneMask& lanes, LitLanes& lit) {
    LaneColors answer;
    sources_.at(material.diffuse, lanes, answer);
    copy_lanes(lanes, answer, lit.diffuse);
    if (!is_black(material.specular)) {
      sources_.at(material.specular, lanes, answer);
      copy_lanes(lanes, answer, lit.specular);
      lit.any_specular = true;
    }
    lit.any = true;
    const std::int32_t blinn = material.model == ShadingModel::blinn_phong ? -1 : 0;
    const auto shininess = static_cast<float>(material.shininess);
    for (std::size_t k = 0; k < kLanes; ++k) {
      lit.mask[k] |= lanes[k];
      lit.blinn[k] = lanes[k] != 0 ? blinn : lit.blinn[k];
      lit.shininess[k] = lanes[k] != 0 ? shininess : lit.shininess[k];
      if (lanes[k] == 0) continue;
      lit.any_gouraud =
          lit.any_gouraud || in_.scene.interpolation(packet_.object[k]) == Interpolation::gouraud;
    }
  }

  const ShadingInputs& in_;
  const RayPacket& packet_;
  const LaneSurfaces& surfaces_;
  MaterialColors sources_;
};

// Dim light is traced at least this often.
constexpr float kLeastChance = 0.125F;

// One light's share of every lit lane, and the shadow rays that decide whether it arrives.
class LightPass {
 public:
  LightPass(const ShadingInputs& in, const RayPacket& packet, const LaneSurfaces& surfaces,
            const LitLanes& lit)
      : in_(in), packet_(packet), surfaces_(surfaces), lit_(lit) {}

  void run(const Light& light, std::uint32_t light_number, LaneColors& colors,
           std::uint64_t& rays) {
    if (is_area_light(light)) choose_light_points(light_number);
    LaneLight incident;
    LaneTerms terms;
    incident_light(light, surfaces_, u_, v_, incident);
    reflection_terms(lit_, surfaces_, packet_, incident, terms);
    if (lit_.any_gouraud) interpolate_corners(light, terms);
    alignas(64) LaneMask asked;
    cast_shadow_rays(lit_, surfaces_, packet_, incident, terms, light.intensity, share_, shadow_,
                     asked);
    if (!is_traced(asked, light_number)) return;
    std::uint64_t count = 0;
    for (const std::int32_t lane : asked) count += lane != 0 ? 1U : 0U;
    if (count == 0) return;
    rays += count;
    if (in_.scene.has_thin_sheets()) {
      add_filtered(asked, colors);
    } else {
      add_unoccluded(asked, colors);
    }
  }

 private:
  // Russian roulette for a whole packet (Arvo & Kirk 1990); those that stay are brightened.
  bool is_traced(const LaneMask& asked, std::uint32_t light_number) {
    if (in_.certain_light <= 0.0F) return true;
    float brightest = 0.0F;
    for (std::size_t k = 0; k < kLanes; ++k) {
      const float share = std::max(share_.r[k], std::max(share_.g[k], share_.b[k]));
      brightest = std::max(brightest, asked[k] != 0 ? share : 0.0F);
    }
    if (brightest >= in_.certain_light) return true;
    const float chance = std::max(kLeastChance, brightest / in_.certain_light);
    const std::uint32_t stream = hash_of(
        in_.keys.pixel[0], 0x5d0U + light_number + 4096U * static_cast<std::uint32_t>(in_.depth));
    if (in_.sequence.decision(stream, in_.keys.index[0]) >= chance) return false;
    const float more = 1.0F / chance;
    for (std::size_t k = 0; k < kLanes; ++k) {
      share_.r[k] *= more;
      share_.g[k] *= more;
      share_.b[k] *= more;
    }
    return true;
  }

  void choose_light_points(std::uint32_t light_number) {
    SampleKeys keys = in_.keys;
    for (std::uint32_t& pixel : keys.pixel) {
      pixel = hash_of(pixel, light_number + 4096U * static_cast<std::uint32_t>(in_.depth));
    }
    in_.sequence.fill(keys, Dimension::light_u, u_);
    in_.sequence.fill(keys, Dimension::light_v, v_);
  }

  // Gouraud: the factors at the three corners, unshadowed, interpolated to the hit point.
  void interpolate_corners(const Light& light, LaneTerms& terms) const {
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (lit_.mask[k] == 0) continue;
      if (in_.scene.interpolation(packet_.object[k]) != Interpolation::gouraud) continue;
      const int lane = static_cast<int>(k);
      const Surface surface = in_.scene.surface(packet_, lane);
      const Vec3f eye = packet_.origin(lane);
      const std::array<Corner, 3> corners = in_.scene.corners(surface);
      const std::array<float, 3> weights = {1.0F - surface.b1 - surface.b2, surface.b1, surface.b2};
      ReflectionTerms sum;
      for (std::size_t i = 0; i < 3; ++i) {
        const IncidentLight incident = incident_light(
            light, corners[i].position, static_cast<float>(u_[k]), static_cast<float>(v_[k]));
        const ReflectionTerms at_corner =
            reflection_terms(in_.scene.material(surface), corners[i].normal, incident.to_light,
                             normalized(eye - corners[i].position));
        sum.diffuse += weights[i] * at_corner.diffuse;
        sum.specular += weights[i] * at_corner.specular;
      }
      terms.diffuse[k] = sum.diffuse;
      terms.specular[k] = sum.specular;
    }
  }

  void add_unoccluded(const LaneMask& asked, LaneColors& colors) {
    in_.scene.occlude(shadow_, asked, Coherence::coherent);
    for (std::size_t k = 0; k < kLanes; ++k) {
      const bool arrives = (asked[k] != 0) & (shadow_.far[k] >= 0.0F);
      colors.r[k] += arrives ? share_.r[k] : 0.0F;
      colors.g[k] += arrives ? share_.g[k] : 0.0F;
      colors.b[k] += arrives ? share_.b[k] : 0.0F;
    }
  }

  void add_filtered(const LaneMask& asked, LaneColors& colors) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (asked[k] == 0) continue;
      const int lane = static_cast<int>(k);
      const float passed = in_.scene.transmittance(shadow_.origin(lane), shadow_.direction(lane),
                                                   shadow_.far[k], shadow_.time[k]);
      colors.r[k] += passed * share_.r[k];
      colors.g[k] += passed * share_.g[k];
      colors.b[k] += passed * share_.b[k];
    }
  }

  const ShadingInputs& in_;
  const RayPacket& packet_;
  const LaneSurfaces& surfaces_;
  const LitLanes& lit_;
  RayPacket shadow_ = {};
  LaneColors share_ = {};
  LaneValues u_ = {};
  LaneValues v_ = {};
};

FSTOP_KERNEL void shade_any(const ShadingInputs& in, const RayPacket& packet, const LaneMask& valid,
                            const LaneFloats& path_length, LaneSurfaces& surfaces,
                            LaneColors& colors, std::uint64_t& rays, LaneColors* diffuse) {
  const Scene& scene = in.scene.scene();
  in.scene.surfaces(packet, valid, surfaces);
  colors.r.fill(scene.background[0]);
  colors.g.fill(scene.background[1]);
  colors.b.fill(scene.background[2]);
  if (in.without_background != 0) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      const float kept = (in.without_background >> k & 1U) != 0 ? 0.0F : 1.0F;
      colors.r[k] *= kept;
      colors.g[k] *= kept;
      colors.b[k] *= kept;
    }
  }
  alignas(64) LaneFloats footprint;
  for (std::size_t k = 0; k < kLanes; ++k) {
    footprint[k] = in.footprint_rate * (path_length[k] + packet.far[k]);
  }
  if (in.pencil != nullptr) {
    const PencilWidths& pencil = *in.pencil;
    for (std::size_t k = 0; k < kLanes; ++k) {
      const float depth = pencil.cosines[k] * (path_length[k] + packet.far[k]);
      const float width = pencil.width * std::abs(1.0F - depth * pencil.vergence);
      footprint[k] = std::max(footprint[k], width);
    }
  }
  if (in.scene.has_screen_maps()) place_on_film(in, packet, surfaces, footprint);
  if (in.scene.has_relief()) add_relief(in.scene, footprint, surfaces);
  SurfaceColors own(in, packet, footprint, surfaces);
  if (!in.scene.lit() && diffuse == nullptr) return own.find(colors, nullptr);
  LitLanes lit;
  own.find(colors, &lit);
  if (diffuse != nullptr) *diffuse = lit.diffuse;
  if (!lit.any) return;
  LightPass pass(in, packet, surfaces, lit);
  std::uint32_t number = 0;
  for (const Light& light : scene.lights) pass.run(light, number++, colors, rays);
}

// Flattened, so that all of it is compiled for wide vectors.
[[gnu::flatten]] FSTOP_AVX512 void shade_wide(const ShadingInputs& in, const RayPacket& packet,
                                              const LaneMask& valid, const LaneFloats& path_length,
                                              LaneSurfaces& surfaces, LaneColors& colors,
                                              std::uint64_t& rays, LaneColors* diffuse) {
  shade_any(in, packet, valid, path_length, surfaces, colors, rays, diffuse);
}

}  // namespace

void diffuse_colors(const ShadingInputs& in, const RayPacket& packet, const LaneMask& valid,
                    LaneSurfaces& surfaces, LaneColors& diffuse) noexcept {
  in.scene.surfaces(packet, valid, surfaces);
  alignas(64) LaneFloats footprint = {};
  if (in.scene.has_screen_maps()) place_on_film(in, packet, surfaces, footprint);
  if (in.scene.has_relief()) add_relief(in.scene, footprint, surfaces);
  LaneColors own;
  LitLanes lit;
  SurfaceColors(in, packet, footprint, surfaces).find(own, &lit);
  diffuse = lit.diffuse;
}

void shade_locally(const ShadingInputs& in, const RayPacket& packet, const LaneMask& valid,
                   const LaneFloats& path_length, LaneSurfaces& surfaces, LaneColors& colors,
                   std::uint64_t& rays, LaneColors* diffuse) noexcept {
  if (has_avx512()) {
    return shade_wide(in, packet, valid, path_length, surfaces, colors, rays, diffuse);
  }
  shade_any(in, packet, valid, path_length, surfaces, colors, rays, diffuse);
}

}  // namespace fstop
