#include "core/shading/ray_tree.h"

#include <algorithm>
#include <cmath>

#include "core/shading/material.h"

namespace fstop {
namespace {

alignas(64) constexpr LaneFloats kNoPath = {};

// The packets of one tree of rays: every lane follows its own sample, all lanes bounce together.
class PacketTree {
 public:
  PacketTree(const ShadingInputs& in, std::uint64_t& rays) : in_(in), rays_(rays) {}

  // The whole light along every valid lane of a traced packet. `weight`: how much a lane's light
  // still counts; `path_length`: metres before this packet.
  void shade(const RayPacket& packet, const LaneMask& valid, const LaneFloats& weight,
             const LaneFloats& path_length, int depth, LaneColors& colors) {
    LaneSurfaces surfaces;
    ShadingInputs inputs = in_;
    inputs.depth = depth;
    shade_locally(inputs, packet, valid, path_length, surfaces, colors, rays_);
    Shares shares;
    if (!shares_of(surfaces, shares)) return;
    alignas(64) LaneFloats length;
    for (std::size_t k = 0; k < kLanes; ++k) length[k] = path_length[k] + packet.far[k];
    const Bounce from{packet, surfaces, weight, length, depth};
    if (shares.any_reflection) {
      LaneColors light;
      follow(from, shares.kept_reflection, mirrors(from), light);
      add(shares.reflection, light, colors);
    }
    if (!shares.any_transmission) return;
    for (std::size_t k = 0; k < kLanes; ++k) {
      colors.r[k] *= shares.kept[k];
      colors.g[k] *= shares.kept[k];
      colors.b[k] *= shares.kept[k];
    }
    LaneColors light;
    follow(from, shares.transmission, onwards(from), light);
    add(shares.transmission, light, colors);
  }

 private:
  struct alignas(64) Shares {
    LaneFloats reflection = {};
    LaneFloats kept_reflection = {};  // what of it is not hidden by transmission
    LaneFloats transmission = {};
    LaneFloats kept = {};
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
    int depth = 0;
  };

  bool shares_of(const LaneSurfaces& surfaces, Shares& shares) const {
    for (std::size_t k = 0; k < kLanes; ++k) {
      shares.kept[k] = 1.0F;
      if (surfaces.material[k] < 0) continue;
      const Material& material = in_.scene.material(surfaces.material[k]);
      const auto reflection = static_cast<float>(material.reflection);
      const auto transmission = static_cast<float>(material.transmission);
      const bool sheet = transmission > 0.0F && !material.ior;
      shares.kept[k] = sheet ? 1.0F - transmission : 1.0F;
      shares.reflection[k] = reflection;
      shares.kept_reflection[k] = shares.kept[k] * reflection;
      shares.transmission[k] = transmission;
      shares.any_reflection = shares.any_reflection || reflection > 0.0F;
      shares.any_transmission = shares.any_transmission || transmission > 0.0F;
    }
    return shares.any_reflection || shares.any_transmission;
  }

  static Directions mirrors(const Bounce& from) {
    Directions result;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (from.surfaces.material[k] < 0) continue;
      result.set(k, mirrored(from.packet.direction(static_cast<int>(k)), from.surfaces.normal(k)));
    }
    return result;
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
    return result;
  }

  static Vec3f bent(Vec3f direction, Vec3f normal, double ior, bool from_outside) {
    const auto index = static_cast<float>(ior);
    const float eta = from_outside ? 1.0F / index : index;
    Vec3f result;
    if (refracted(direction, normal, eta, result)) return result;
    return mirrored(direction, normal);
  }

  // Light from `directions`, of the lanes whose `share` is worth following; black in others.
  void follow(const Bounce& from, const LaneFloats& share, const Directions& directions,
              LaneColors& light) {
    RayPacket packet;
    alignas(64) LaneMask valid = {};
    alignas(64) LaneFloats weight = {};
    bool any = false;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (from.surfaces.material[k] < 0 || !(share[k] > 0.0F)) continue;
      weight[k] = from.weight[k] * share[k];
      const bool counts = weight[k] >= kSmallestBranch && from.depth < kDeepestBranch;
      if (!counts || ++branches_[k] > kMostBranches) continue;
      valid[k] = -1;
      any = true;
      ++rays_;
      const Vec3f direction = normalized(directions.get(k));
      const Vec3f face = from.surfaces.face(k);
      const float side = dot(face, direction) >= 0.0F ? 1.0F : -1.0F;
      const Vec3f origin = from.surfaces.position(k) + face * (side * from.surfaces.error[k]);
      packet.set(static_cast<int>(k), origin, direction, kFar, from.packet.time[k]);
    }
    if (!any) return;
    in_.scene.intersect(packet, valid, Coherence::incoherent);
    shade(packet, valid, weight, from.path_length, from.depth + 1, light);
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (valid[k] == 0) light.set(static_cast<int>(k), {0, 0, 0});
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
  std::array<int, kLanes> branches_ = {};
};

}  // namespace

void shade(const ShadingInputs& in, const RayPacket& packet, const LaneMask& valid,
           LaneColors& colors, std::uint64_t& rays) noexcept {
  if (!in.scene.branches()) {
    LaneSurfaces surfaces;
    shade_locally(in, packet, valid, kNoPath, surfaces, colors, rays);
    return;
  }
  alignas(64) LaneFloats weight;
  weight.fill(1.0F);
  PacketTree(in, rays).shade(packet, valid, weight, kNoPath, in.depth, colors);
}

BranchBound branch_bound(const std::vector<Material>& materials) {
  BranchBound bound{.error = kSmallestBranch};
  for (const Material& material : materials) {
    const double transmission = material.transmission;
    const bool is_sheet = transmission > 0.0 && !material.ior;
    const double reflection = (is_sheet ? 1.0 - transmission : 1.0) * material.reflection;
    bound.forks = bound.forks || (reflection > 0.0 && transmission > 0.0);
    bound.error = std::max(bound.error, std::pow(std::max(reflection, transmission),
                                                 static_cast<double>(kDeepestBranch)));
  }
  return bound;
}

bool refracted(Vec3f incident, Vec3f normal, float eta, Vec3f& direction) noexcept {
  const float cosine = -dot(incident, normal);
  const float sine_squared = eta * eta * (1.0F - cosine * cosine);
  if (sine_squared > 1.0F) return false;
  direction = incident * eta + normal * (eta * cosine - std::sqrt(1.0F - sine_squared));
  return true;
}

Vec3f mirrored(Vec3f incident, Vec3f normal) noexcept {
  return incident - normal * (2.0F * dot(incident, normal));
}

}  // namespace fstop
