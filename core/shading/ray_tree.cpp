#include "core/shading/ray_tree.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/sampling/stream.h"
#include "core/shading/material.h"

namespace fstop {
namespace {

alignas(64) constexpr LaneFloats kNoPath = {};

// Where a branch leads.
enum class Turn : std::uint32_t { mirrored, onwards, scattered };

// How a packet came to where it is.
struct Way {
  int depth = 0;
  // Of all turns: branches of one depth decide independently. Where they shared their chances, all
  // would live or die together, and few samples would hold most of the light.
  std::uint32_t turns = 0x9a74'0000U;
  bool scattered = false;  // a diffuse surface lies before
  // Lanes, by bits, that have met thin sheets alone and are not to see the background.
  std::uint32_t without_background = 0;

  Way after(Turn turn, bool by_chance, std::uint32_t sheets) const {
    return {depth + 1, hash_of(turns, static_cast<std::uint32_t>(turn)), by_chance,
            turn == Turn::onwards ? without_background & sheets : 0U};
  }
};

// The packets of one tree of rays: every lane follows its own sample, all lanes bounce together.
class PacketTree {
 public:
  PacketTree(const ShadingInputs& in, std::uint64_t& rays)
      : in_(in),
        rays_(rays),
        is_global_(in.illumination == Illumination::global),
        smallest_(kSmallestBranch / in.brightest),
        deepest_(in.illumination == Illumination::local ? in.depth : kDeepestBranch) {}

  // The whole light along every valid lane of a traced packet. `weight`: how much a lane's light
  // still counts; `path_length`: metres before this packet.
  void shade(const RayPacket& packet, const LaneMask& valid, const LaneFloats& weight,
             const LaneFloats& path_length, const Way& way, LaneColors& colors) {
    LaneSurfaces surfaces;
    LaneColors diffuse;
    ShadingInputs inputs = in_;
    inputs.depth = way.depth;
    inputs.without_background = way.without_background;
    shade_locally(inputs, packet, valid, path_length, surfaces, colors, rays_,
                  is_global_ ? &diffuse : nullptr);
    Shares shares;
    const bool branches = shares_of(packet, surfaces, shares);
    if (!branches && !is_global_) return;
    alignas(64) LaneFloats length;
    for (std::size_t k = 0; k < kLanes; ++k) length[k] = path_length[k] + packet.far[k];
    const Bounce from{packet, surfaces, weight, length, way};
    if (is_global_) scatter(from, diffuse, shares.kept, colors);
    if (shares.any_reflection) {
      LaneColors light;
      follow(from, shares.kept_reflection, mirrors(from), Turn::mirrored, light);
      add(shares.reflection, light, colors);
    }
    if (!shares.any_transmission) return;
    for (std::size_t k = 0; k < kLanes; ++k) {
      colors.r[k] *= shares.kept[k];
      colors.g[k] *= shares.kept[k];
      colors.b[k] *= shares.kept[k];
    }
    LaneColors light;
    follow(from, shares.transmission, onwards(from), Turn::onwards, light, shares.sheets);
    add(shares.transmission, light, colors);
  }

 private:
  struct alignas(64) Shares {
    LaneFloats reflection = {};
    LaneFloats kept_reflection = {};  // what of it is not hidden by transmission
    LaneFloats transmission = {};
    LaneFloats kept = {};
    std::uint32_t sheets = 0;  // lanes, by bits
    bool any_reflection = false;
    bool any_transmission = false;
  };
  struct alignas(64) Directions {
    LaneFloats x = {}, y = {}, z = {};
    void set(std::size_t k, Vec3f d) {
      x[k] = d.x;
      y[k] = d.y;
      z[k] = d.z;
    }
    Vec3f get(std::size_t k) const { return {x[k], y[k], z[k]}; }
  };
  // Where branches start: a packet, what it hit, and what its light counts.
  struct Bounce {
    const RayPacket& packet;
    const LaneSurfaces& surfaces;
    const LaneFloats& weight;
    const LaneFloats& path_length;
    Way way = {};
  };

  bool shares_of(const RayPacket& packet, const LaneSurfaces& surfaces, Shares& shares) const {
    for (std::size_t k = 0; k < kLanes; ++k) {
      shares.kept[k] = 1.0F;
      if (surfaces.material[k] < 0) continue;
      const Material& material = in_.scene.material(surfaces.material[k]);
      auto reflection = static_cast<float>(material.reflection);
      auto transmission = static_cast<float>(material.transmission);
      if (material.fresnel && material.ior) {
        const Vec3f direction = packet.direction(static_cast<int>(k));
        const float cosine = -dot(direction, surfaces.normal(k));
        const float eta = relative_index(*material.ior, surfaces.outside[k] != 0);
        const float reflectance = fresnel_reflectance(std::clamp(cosine, 0.0F, 1.0F), eta);
        reflection *= reflectance;
        transmission *= 1.0F - reflectance;
      }
      const bool sheet = transmission > 0.0F && !material.ior;
      shares.kept[k] = sheet ? 1.0F - transmission : 1.0F;
      shares.sheets |= static_cast<std::uint32_t>(sheet) << k;
      shares.reflection[k] = reflection;
      shares.kept_reflection[k] = shares.kept[k] * reflection;
      shares.transmission[k] = transmission;
      shares.any_reflection = shares.any_reflection || reflection > 0.0F;
      shares.any_transmission = shares.any_transmission || transmission > 0.0F;
    }
    return shares.any_reflection || shares.any_transmission;
  }

  static float relative_index(double ior, bool from_outside) {
    const auto index = static_cast<float>(ior);
    return from_outside ? 1.0F / index : index;
  }

  Directions mirrors(const Bounce& from) const {
    Directions result;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (from.surfaces.material[k] < 0) continue;
      result.set(k, mirrored(from.packet.direction(static_cast<int>(k)), from.surfaces.normal(k)));
    }
    spread(from, &Material::reflection_exponent, Turn::mirrored, result);
    return result;
  }

  // Lanes of a glossy or frosted material look about their ideal direction, on its side of the
  // surface.
  void spread(const Bounce& from, std::optional<double> Material::*exponent, Turn turn,
              Directions& directions) const {
    LaneValues u, v;
    bool drawn = false;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (from.surfaces.material[k] < 0) continue;
      const auto& lobe = in_.scene.material(from.surfaces.material[k]).*exponent;
      if (!lobe) continue;
      if (!drawn) {
        draw(from.way, turn, u, v);
        drawn = true;
      }
      const Vec3f ideal = normalized(directions.get(k));
      const Vec3f chosen = lobe_direction(ideal, static_cast<float>(*lobe),
                                          static_cast<float>(u[k]), static_cast<float>(v[k]));
      directions.set(k, on_side_of(ideal, from.surfaces.face(k), chosen));
    }
  }

  // `direction`, mirrored at the face where it lies on the other side than `side`.
  static Vec3f on_side_of(Vec3f side, Vec3f face, Vec3f direction) {
    return dot(direction, face) * dot(side, face) < 0.0F ? mirrored(direction, face) : direction;
  }

  // Keys of the coordinates that one turn takes: of a stream of its own, so that where a path turns
  // and which point of a light it meets next are independent.
  SampleKeys keys_of(const Way& way, Turn turn) const {
    return stream_keys(in_.keys, hash_of(way.turns, static_cast<std::uint32_t>(turn)));
  }

  void draw(const Way& way, Turn turn, LaneValues& u, LaneValues& v) const {
    const SampleKeys keys = keys_of(way, turn);
    in_.sequence.fill(keys, Dimension::light_u, u);
    in_.sequence.fill(keys, Dimension::light_v, v);
  }

  // Adds what all other surfaces send to the diffuse colours `diffuse`, which a sheet keeps a part
  // of.
  void scatter(const Bounce& from, LaneColors& diffuse, const LaneFloats& kept,
               LaneColors& colors) {
    alignas(64) LaneFloats share;
    bool any = false;
    for (std::size_t k = 0; k < kLanes; ++k) {
      // Above 1 light would grow with every bounce, without end.
      diffuse.r[k] = std::min(diffuse.r[k], 1.0F);
      diffuse.g[k] = std::min(diffuse.g[k], 1.0F);
      diffuse.b[k] = std::min(diffuse.b[k], 1.0F);
      share[k] = kept[k] * std::max({diffuse.r[k], diffuse.g[k], diffuse.b[k]});
      any = any || share[k] > 0.0F;
    }
    if (!any) return;
    LaneValues u, v;
    draw(from.way, Turn::scattered, u, v);
    Directions directions;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (!(share[k] > 0.0F)) continue;
      const Vec3f normal = from.surfaces.normal(k);
      // Of power 1 the lobe is the cosine's.
      const Vec3f chosen =
          lobe_direction(normal, 1.0F, static_cast<float>(u[k]), static_cast<float>(v[k]));
      directions.set(k, on_side_of(normal, from.surfaces.face(k), chosen));
    }
    LaneColors light;
    follow(from, share, directions, Turn::scattered, light);
    for (std::size_t k = 0; k < kLanes; ++k) {
      colors.r[k] += diffuse.r[k] * light.r[k];
      colors.g[k] += diffuse.g[k] * light.g[k];
      colors.b[k] += diffuse.b[k] * light.b[k];
    }
  }

  Directions onwards(const Bounce& from) const {
    Directions result;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (from.surfaces.material[k] < 0) continue;
      const Vec3f direction = from.packet.direction(static_cast<int>(k));
      const Material& material = in_.scene.material(from.surfaces.material[k]);
      const bool outside = from.surfaces.outside[k] != 0;
      result.set(k, material.ior ? bent(direction, from.surfaces.normal(k), *material.ior, outside)
                                 : direction);
    }
    spread(from, &Material::transmission_exponent, Turn::onwards, result);
    return result;
  }

  static Vec3f bent(Vec3f direction, Vec3f normal, double ior, bool from_outside) {
    Vec3f result;
    if (refracted(direction, normal, relative_index(ior, from_outside), result)) return result;
    return mirrored(direction, normal);
  }

  // Light from `directions`, of the lanes whose `share` is worth following; black in others.
  void follow(const Bounce& from, const LaneFloats& share, const Directions& directions, Turn turn,
              LaneColors& light, std::uint32_t sheets = 0) {
    RayPacket packet;
    alignas(64) LaneMask valid = {};
    alignas(64) LaneFloats weight = {};
    const bool by_chance = is_global_ && (from.way.scattered || turn == Turn::scattered);
    bool any = false;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (from.surfaces.material[k] < 0 || !(share[k] > 0.0F)) continue;
      weight[k] = from.weight[k] * share[k];
      const bool counts = (by_chance || weight[k] >= smallest_) && from.way.depth < deepest_;
      if (!counts || ++branches_[k] > kMostBranches) {
        if (in_.cut != nullptr) (*in_.cut)[k] += weight[k] * in_.brightest;
        continue;
      }
      valid[k] = -1;
      any = true;
    }
    alignas(64) LaneFloats gain;
    if (any && by_chance) any = play_roulette(from.way, turn, valid, weight, gain);
    if (!any) return;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (valid[k] == 0) continue;
      ++rays_;
      const Vec3f direction = normalized(directions.get(k));
      const Vec3f face = from.surfaces.face(k);
      const float side = dot(face, direction) >= 0.0F ? 1.0F : -1.0F;
      const Vec3f origin = from.surfaces.position(k) + face * (side * from.surfaces.error[k]);
      packet.set(static_cast<int>(k), origin, direction, kFar, from.packet.time[k]);
    }
    in_.scene.intersect(packet, valid, Coherence::incoherent);
    shade(packet, valid, weight, from.path_length, from.way.after(turn, by_chance, sheets), light);
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (valid[k] == 0) light.set(static_cast<int>(k), {0, 0, 0});
    }
    if (by_chance) brighten(gain, light);
  }

  // Ends light branches by chance; those that stay weigh kCertainBranch, and `gain` is what their
  // light counts more. False where all lanes have ended.
  bool play_roulette(const Way& way, Turn turn, LaneMask& valid, LaneFloats& weight,
                     LaneFloats& gain) const {
    gain.fill(1.0F);
    bool any_light = false;
    for (std::size_t k = 0; k < kLanes; ++k) {
      any_light = any_light || (valid[k] != 0 && weight[k] < kCertainBranch);
    }
    if (!any_light) return true;
    const SampleKeys keys = keys_of(way, turn);
    bool any = false;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (valid[k] != 0 && weight[k] < kCertainBranch) {
        const float chance = weight[k] / kCertainBranch;
        valid[k] = in_.sequence.decision(keys.pixel[k], keys.index[k]) < chance ? -1 : 0;
        gain[k] = 1.0F / chance;
        weight[k] = kCertainBranch;
      }
      any = any || valid[k] != 0;
    }
    return any;
  }

  static void brighten(const LaneFloats& gain, LaneColors& light) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      light.r[k] *= gain[k];
      light.g[k] *= gain[k];
      light.b[k] *= gain[k];
    }
  }

  static void add(const LaneFloats& share, const LaneColors& light, LaneColors& colors) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      colors.r[k] += share[k] * light.r[k];
      colors.g[k] += share[k] * light.g[k];
      colors.b[k] += share[k] * light.b[k];
    }
  }

  const ShadingInputs& in_;
  std::uint64_t& rays_;
  bool is_global_;
  float smallest_;  // branch that is followed
  int deepest_;
  std::array<int, kLanes> branches_ = {};
};

}  // namespace

void shade(const ShadingInputs& in, const RayPacket& packet, const LaneMask& valid,
           LaneColors& colors, std::uint64_t& rays) noexcept {
  if (!in.scene.branches() && in.illumination != Illumination::global) {
    LaneSurfaces surfaces;
    shade_locally(in, packet, valid, kNoPath, surfaces, colors, rays);
    return;
  }
  alignas(64) LaneFloats weight;
  weight.fill(1.0F);
  PacketTree(in, rays).shade(packet, valid, weight, kNoPath,
                             {.depth = in.depth, .without_background = in.without_background},
                             colors);
}

BranchBound branch_bound(const std::vector<Material>& materials, Illumination illumination,
                         double brightest) {
  const bool is_local = illumination == Illumination::local;
  BranchBound bound{.error = is_local ? 0.0 : double{kSmallestBranch}};
  for (const Material& material : materials) {
    const double transmission = material.transmission;
    const bool is_sheet = transmission > 0.0 && !material.ior;
    const double reflection = (is_sheet ? 1.0 - transmission : 1.0) * material.reflection;
    bound.forks = bound.forks || (reflection > 0.0 && transmission > 0.0);
    double heaviest = std::max(reflection, transmission);
    if (illumination == Illumination::global && material.model != ShadingModel::unlit) {
      const Rgb& diffuse = material.diffuse.value;
      const double albedo = std::min(1.0, double{std::max({diffuse[0], diffuse[1], diffuse[2]})});
      heaviest = std::max(heaviest, albedo);  // as scatter() counts it
    }
    const double left =
        is_local ? reflection + transmission : std::pow(heaviest, double{kDeepestBranch});
    bound.error = std::max(bound.error, std::min(1.0, brightest * left));
  }
  bound.forks = bound.forks && !is_local;
  return bound;
}

double most_rays_of_a_point(const Scene& scene) {
  double most = 1.0;
  for (const Material& material : scene.materials) {
    const double reflection = material.reflection;
    const double transmission = material.transmission;
    if (!(reflection > 0.0 && transmission > 0.0)) continue;
    // Depth by depth: weights reflection^i transmission^j, binomial(i + j, i) of each.
    std::vector<double> paths = {1.0};  // by i
    double branches = 1.0;
    for (int depth = 1; depth <= kDeepestBranch && branches < double{kMostBranches}; ++depth) {
      std::vector<double> next(paths.size() + 1, 0.0);
      double followed = 0.0;
      for (std::size_t i = 0; i < paths.size(); ++i) {
        next[i] += paths[i];
        next[i + 1] += paths[i];
      }
      for (std::size_t i = 0; i < next.size(); ++i) {
        const double weight =
            std::pow(reflection, double(i)) * std::pow(transmission, double(depth) - double(i));
        if (weight < double{kSmallestBranch}) next[i] = 0.0;
        followed += next[i];
      }
      if (followed <= 0.0) break;
      branches += followed;
      paths = std::move(next);
    }
    most = std::max(most, std::min(branches, double{kMostBranches}));
  }
  return most * (1.0 + static_cast<double>(scene.lights.size()));
}

float brightest_value(const RayScene& scene, double exposure) noexcept {
  return static_cast<float>(std::max(1.0, exposure * double{scene.brightest()}));
}

bool refracted(Vec3f incident, Vec3f normal, float eta, Vec3f& direction) noexcept {
  const float cosine = -dot(incident, normal);
  const float sine_squared = eta * eta * (1.0F - cosine * cosine);
  if (sine_squared > 1.0F) return false;
  direction = incident * eta + normal * (eta * cosine - std::sqrt(1.0F - sine_squared));
  return true;
}

float fresnel_reflectance(float cosine, float eta) noexcept {
  const float sine_squared = eta * eta * (1.0F - cosine * cosine);
  if (sine_squared >= 1.0F) return 1.0F;
  const float beyond = std::sqrt(1.0F - sine_squared);
  const float across = (eta * cosine - beyond) / (eta * cosine + beyond);
  const float along = (cosine - eta * beyond) / (cosine + eta * beyond);
  return 0.5F * (across * across + along * along);
}

Vec3f lobe_direction(Vec3f axis, float exponent, float u, float v) noexcept {
  const float cosine = std::pow(1.0F - u, 1.0F / (exponent + 1.0F));
  const float sine = std::sqrt(std::max(0.0F, 1.0F - cosine * cosine));
  const float turn = 2.0F * std::numbers::pi_v<float> * v;
  const Vec3f least = std::abs(axis.x) < 0.6F ? Vec3f{1, 0, 0} : Vec3f{0, 1, 0};
  const Vec3f right = normalized(cross(axis, least));
  const Vec3f up = cross(right, axis);
  return axis * cosine + right * (sine * std::cos(turn)) + up * (sine * std::sin(turn));
}

Vec3f mirrored(Vec3f incident, Vec3f normal) noexcept {
  return incident - normal * (2.0F * dot(incident, normal));
}

}  // namespace fstop
