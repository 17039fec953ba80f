#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace fstop {

/// Bounds on what a file may hold; every limit is checked before memory is taken for it.
struct AssetLimits {
  std::size_t max_file_bytes = 0;
  std::size_t max_triangles = 0;  // and three times as many vertices
  std::size_t max_texture_pixels = 0;
  double max_coordinate = 0.0;  // metres
  // Of all files of a scene, a file counted for each object or texture that uses it.
  std::size_t max_scene_triangles = std::numeric_limits<std::size_t>::max();
  std::size_t max_scene_texture_pixels = std::numeric_limits<std::size_t>::max();
};

/// The bytes of the file a scene calls `name`.
/// Throws: Error{not_found, bad_path, io_failure, over_budget}.
using AssetReader = std::function<std::vector<std::byte>(const std::string& name)>;

/// Reads assets below `folder`: regular files of at most `limits.max_file_bytes`. A name is a
/// relative path of letters, digits, '.', '_', '-' and '/'; one that is absolute or empty, has a
/// '..' part or leads through a link out of the folder is refused (bad_path). Holds no open file.
AssetReader folder_assets(std::filesystem::path folder, AssetLimits limits);

/// The triangles of an OBJ, PLY or glTF (.gltf with embedded buffers, .glb) file, told apart by
/// the extension of `name`. Polygons are split into fans; of glTF the default scene's triangle
/// primitives are joined, nodes' transforms are applied (one that mirrors turns the winding, so
/// that the outside stays outside) and v is turned so that it points up. Triangles without area
/// are dropped. Normals have length 1; if one vertex has none, the mesh has none, and so with uv.
/// Valid: static meshes; skins, morph weights, sparse accessors and strips are refused, materials,
///        cameras and pictures inside a mesh file are passed over.
/// Throws: Error{bad_geometry} naming the file and what is wrong (truncated, index out of range,
///         non-finite vertex, no triangle, over a limit); Error{unsupported} for other extensions.
/// Source: Wavefront Advanced Visualizer manual, appendix B1; Turk 1994 (PLY); Khronos glTF 2.0.
Mesh decode_mesh(const std::string& name, std::span<const std::byte> bytes,
                 const AssetLimits& limits);

/// Linear RGB of a PNG, JPEG or EXR file, recognised by its first bytes; grey becomes RGB, alpha
/// is dropped. Row 0 at the top; Exif orientation is not applied. `color_space` says how the
/// stored values are encoded; EXR is always linear, its data window is the image.
/// Throws: Error{bad_image} naming the file: truncated or damaged, over a limit, of another kind,
///         non-finite samples.
/// Source: IEC 61966-2-1:1999 (sRGB).
Image decode_texture(const std::string& name, std::span<const std::byte> bytes,
                     ColorSpace color_space, const AssetLimits& limits);

/// The alpha of the same files, 1 channel, 0 to 1 (PNG) or as stored (EXR's A); empty where the
/// file has none. Throws: as decode_texture.
Image decode_alpha(const std::string& name, std::span<const std::byte> bytes,
                   const AssetLimits& limits);

/// Fills every mesh and texture image of `scene`; the same file is read once.
/// Throws: what `read`, decode_mesh and decode_texture throw, and Error{over_budget} where the
///         scene as a whole has too much; every message names the file.
void load_assets(Scene& scene, const AssetReader& read, const AssetLimits& limits);

}  // namespace fstop
