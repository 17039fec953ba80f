#include "core/shading/ray_tree.h"

#include <algorithm>
#include <cmath>

#include "core/shading/material.h"

namespace fstop {
namespace {

// A place in the tree of rays: which sample it belongs to and how much it still counts.
struct Branch {
  int lane = 0;
  int depth = 0;
  float weight = 1.0F;
  float path_length = 0.0F;
  float time = 0.0F;
};

class Tree {
 public:
  Tree(const ShadingInputs& in, std::uint64_t& rays) : in_(in), rays_(rays) {}

  // The whole light of a surface whose local light is known.
  Rgb complete(const Surface& surface, Vec3f direction, const Rgb& local, const Branch& branch) {
    const Material& material = in_.scene.material(surface);
    const auto reflection = static_cast<float>(material.reflection);
    const auto transmission = static_cast<float>(material.transmission);
    Rgb color = local;
    const float kept = transmission > 0.0F && !material.ior ? 1.0F - transmission : 1.0F;
    if (reflection > 0.0F) {
      const Vec3f mirror = mirrored(direction, surface.shading_normal);
      color = color + follow(surface, mirror, child(branch, kept * reflection)) * reflection;
    }
    color = color * kept;
    if (transmission > 0.0F) {
      const Vec3f onwards = material.ior ? bent(surface, direction, *material.ior) : direction;
      color = color + follow(surface, onwards, child(branch, transmission)) * transmission;
    }
    return color;
  }

 private:
  static Branch child(const Branch& parent, float share) {
    Branch branch = parent;
    branch.weight *= share;
    ++branch.depth;
    return branch;
  }

  static Vec3f bent(const Surface& surface, Vec3f direction, double ior) {
    const auto index = static_cast<float>(ior);
    const float eta = surface.from_outside ? 1.0F / index : index;
    Vec3f result;
    if (refracted(direction, surface.shading_normal, eta, result)) return result;
    return mirrored(direction, surface.shading_normal);
  }

  Rgb follow(const Surface& surface, Vec3f direction, const Branch& branch) {
    const bool counts = branch.weight >= kSmallestBranch && branch.depth <= kDeepestBranch;
    if (!counts || ++branches_ > kMostBranches) return {0, 0, 0};
    const float side = dot(surface.geometric_normal, direction) >= 0.0F ? 1.0F : -1.0F;
    const Vec3f origin = surface.position + surface.geometric_normal * (side * surface.error);
    RayPacket packet;
    packet.set(0, origin, normalized(direction), kFar, branch.time);
    in_.scene.intersect_one(packet);
    ++rays_;
    ShadingInputs inputs = in_;
    const auto lane = static_cast<std::size_t>(branch.lane);
    inputs.keys.pixel[0] = in_.keys.pixel[lane];
    inputs.keys.index[0] = in_.keys.index[lane];
    inputs.depth = branch.depth;
    std::array<Surface, kLanes> surfaces;
    LaneColors colors;
    alignas(64) LaneMask first = {-1};
    shade_locally(inputs, packet, first, branch.path_length, surfaces, colors, rays_);
    const Rgb local = colors.get(0);
    if (!packet.hit(0)) return local;
    Branch next = branch;
    next.path_length += packet.far[0];
    return complete(surfaces[0], packet.direction(0), local, next);
  }

  const ShadingInputs& in_;
  std::uint64_t& rays_;
  int branches_ = 0;
};

}  // namespace

void shade(const ShadingInputs& in, const RayPacket& packet, const LaneMask& valid,
           LaneColors& colors, std::uint64_t& rays) noexcept {
  std::array<Surface, kLanes> surfaces;
  shade_locally(in, packet, valid, 0.0F, surfaces, colors, rays);
  for (int lane = 0; lane < kLanes; ++lane) {
    const auto k = static_cast<std::size_t>(lane);
    if (valid[k] == 0 || !packet.hit(lane)) continue;
    const Material& material = in.scene.material(surfaces[k]);
    if (!(material.reflection > 0.0 || material.transmission > 0.0)) continue;
    const Branch root{.lane = lane, .path_length = packet.far[k], .time = packet.time[k]};
    colors.set(
        lane, Tree(in, rays).complete(surfaces[k], packet.direction(lane), colors.get(lane), root));
  }
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
