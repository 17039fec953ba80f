#include "core/scene/mesh_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/geometry.h"

namespace fstop {
namespace {

template <std::size_t N>
bool is_finite(const std::array<float, N>& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

void check_vertices(const std::string& name, const Mesh& mesh, double max_coordinate) {
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    for (const float coordinate : mesh.positions[i]) {
      // Written so that NaN fails too.
      if (!(std::abs(double{coordinate}) <= max_coordinate)) {
        refuse_mesh(name, "vertex " + std::to_string(i) + " is not finite or lies beyond " +
                              std::to_string(max_coordinate) + " m");
      }
    }
  }
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
    if (!is_finite(mesh.normals[i])) {
      refuse_mesh(name, "the normal of vertex " + std::to_string(i) + " is not finite");
    }
  }
  for (std::size_t i = 0; i < mesh.uvs.size(); ++i) {
    if (!is_finite(mesh.uvs[i])) {
      refuse_mesh(name,
                  "the texture coordinates of vertex " + std::to_string(i) + " are not finite");
    }
  }
}

void check_indices(const std::string& name, const Mesh& mesh) {
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t index : mesh.triangles[i]) {
      if (index >= mesh.positions.size()) {
        refuse_mesh(name, "triangle " + std::to_string(i) + " asks for vertex " +
                              std::to_string(index) + " of " +
                              std::to_string(mesh.positions.size()));
      }
    }
  }
}

Vec3 vector_of(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

// Triangles of no area cannot be hit and have no normal.
void drop_flat_triangles(const std::string& name, Mesh& mesh) {
  std::erase_if(mesh.triangles, [&](const std::array<std::uint32_t, 3>& triangle) {
    const Vec3 a = vector_of(mesh.positions[triangle[0]]);
    const Vec3 b = vector_of(mesh.positions[triangle[1]]);
    const Vec3 c = vector_of(mesh.positions[triangle[2]]);
    return cross(b - a, c - a) == Vec3{};
  });
  if (mesh.triangles.empty()) refuse_mesh(name, "the file holds no triangle with an area");
}

void normalize_normals(const std::string& name, Mesh& mesh) {
  if (mesh.normals.empty()) return;
  std::vector<bool> directed(mesh.normals.size());
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
    std::array<float, 3>& normal = mesh.normals[i];
    const double length = norm(vector_of(normal));
    directed[i] = length > 0.0;
    if (!directed[i]) continue;
    for (float& part : normal) part = static_cast<float>(part / length);
  }
  for (const std::array<std::uint32_t, 3>& triangle : mesh.triangles) {
    for (const std::uint32_t index : triangle) {
      if (!directed[index]) {
        refuse_mesh(name, "the normal of vertex " + std::to_string(index) + " has length 0");
      }
    }
  }
}

std::string extension_of(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  std::string extension = dot == std::string::npos ? "" : name.substr(dot + 1);
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

Mesh decode(const std::string& name, std::span<const std::byte> bytes, const AssetLimits& limits) {
  const std::string extension = extension_of(name);
  if (extension == "obj") return decode_obj(name, bytes, limits);
  if (extension == "ply") return decode_ply(name, bytes, limits);
  if (extension == "gltf") return decode_gltf(name, bytes, limits, false);
  if (extension == "glb") return decode_gltf(name, bytes, limits, true);
  throw Error(ErrorCode::unsupported, name + ": meshes are .obj, .ply, .gltf or .glb files");
}

}  // namespace

void refuse_mesh(const std::string& name, const std::string& reason) {
  throw Error(ErrorCode::bad_geometry, name + ": " + reason);
}

Mesh decode_mesh(const std::string& name, std::span<const std::byte> bytes,
                 const AssetLimits& limits) {
  if (bytes.size() > limits.max_file_bytes) {
    refuse_mesh(name, "more than " + std::to_string(limits.max_file_bytes) + " bytes");
  }
  Mesh mesh = decode(name, bytes, limits);
  check_vertices(name, mesh, limits.max_coordinate);
  check_indices(name, mesh);
  drop_flat_triangles(name, mesh);
  normalize_normals(name, mesh);
  return mesh;
}

}  // namespace fstop
