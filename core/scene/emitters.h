#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/scene/scene.h"
#include "core/scene/texture.h"

namespace fstop {

/// Emitters are told apart in ray masks by groups 1 to kEmitterGroups; bit 0 is everything else.
inline constexpr int kEmitterGroups = 31;

/// A bright thing at rest: a sphere, or triangles of one mesh that hang together.
struct Emitter {
  std::uint32_t object = 0;
  std::vector<std::uint32_t> triangles = {};  // of the object's mesh; empty: a sphere
  int outwards = 0;     // as MeshIsland::outwards; 1 for a sphere: only its outside is seen
  bool flat = false;    // triangles in one plane
  Vec3 center = {};     // of a sphere around it, world, metres
  double radius = 0.0;  // of that sphere, metres
  double area = 0.0;    // square metres; of triangles, one side
  Rgb radiance = {};    // emission, averaged over the area
  int group = 1;

  std::uint32_t mask() const noexcept { return std::uint32_t{1} << group; }
};

/// The objects of a scene, and the islands of its meshes, that may be emitters of small bright
/// points: their material emits, neither reflects nor transmits (camera rays follow mirrors and
/// glass), they do not move, and the brightest channel of their mean emission exceeds 1, the
/// white of a relative exposure: what is darker can only be wrong by as much as any surface. In a
/// scene without such light, made for an exposure in ISO, it exceeds 1/16 of the brightest
/// emission. Meshes of over 2^20 triangles are left to camera rays. Quads are meshes by now;
/// indices are in range. In the order of objects and triangles, groups assigned.
std::vector<Emitter> find_emitters(const Scene& scene, std::span<const Texture> textures);

/// Numbers groups from 1 so that emitters of a group are alike in size and lie near each other:
/// the set that is spread most, in octaves of size or in the scene's extent, is halved until
/// there are kEmitterGroups or none is spread.
void assign_groups(std::span<Emitter> emitters);

/// The largest channel of what the materials emit and of the background; textures still have their
/// images.
float brightest_radiance(const Scene& scene);

}  // namespace fstop
