#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/scene.h"

namespace fstop {

/// Triangles that hang together by edges, wherever their corners coincide.
struct MeshIsland {
  std::vector<std::uint32_t> triangles = {};  // in ascending order
  /// 1: it encloses a volume and the winding's normals point out; -1: they point in; 0: it has
  /// borders, or its winding is not consistent.
  int outwards = 0;
};

/// The islands of a mesh whose indices are in range, in the order of their first triangles.
std::vector<MeshIsland> mesh_islands(const Mesh& mesh);

/// The mesh of some triangles alone, without what only shading needs.
Mesh selected(const Mesh& mesh, const std::vector<std::uint32_t>& triangles);

}  // namespace fstop
