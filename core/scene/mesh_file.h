#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "core/scene/scene_file.h"

namespace fstop {

// The formats behind decode_mesh, which checks what they give: positions, normals, indices.
// Each keeps to limits.max_triangles before it takes memory; `name` is for messages.

/// Wavefront OBJ: v, vt, vn and f (any form of index, also negative); other statements are
/// passed over. Vertices are made once for each (v, vt, vn).
Mesh decode_obj(const std::string& name, std::span<const std::byte> bytes,
                const AssetLimits& limits);

/// PLY 1.0, ASCII or binary of either byte order: x y z, nx ny nz, and u v, s t or
/// texture_u texture_v of the vertices; faces as vertex_indices or vertex_index.
Mesh decode_ply(const std::string& name, std::span<const std::byte> bytes,
                const AssetLimits& limits);

/// glTF 2.0: the nodes of the default scene; `binary` says .glb. Nothing outside `bytes` is read.
Mesh decode_gltf(const std::string& name, std::span<const std::byte> bytes,
                 const AssetLimits& limits, bool binary);

/// Throws: Error{bad_geometry} "`name`: `reason`".
[[noreturn]] void refuse_mesh(const std::string& name, const std::string& reason);

}  // namespace fstop
