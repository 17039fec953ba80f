// Mesh files: glTF, PLY, OBJ. What comes out can be handed to the ray tracer.
#include <array>
#include <cmath>
#include <string>

#include "core/error.h"
#include "core/scene/scene_file.h"
#include "tests/fuzz/fuzz_target.h"

namespace fstop::test {
namespace {

constexpr std::array kNames = {"m.glb", "m.gltf", "m.ply", "m.obj"};
constexpr AssetLimits kLimits{.max_file_bytes = std::size_t{1} << 20,
                              .max_triangles = 20'000,
                              .max_texture_pixels = 1,
                              .max_coordinate = 1e7};

template <typename Vectors>
bool all_finite(const Vectors& vectors) {
  for (const auto& vector : vectors) {
    for (const float part : vector) {
      if (!std::isfinite(part)) return false;
    }
  }
  return true;
}

void check(const Mesh& mesh) {
  require(!mesh.triangles.empty(), "a mesh has triangles");
  require(mesh.triangles.size() <= kLimits.max_triangles, "no more than the limit");
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t index : triangle)
      require(index < mesh.positions.size(), "triangles have vertices that are there");
  }
  require(all_finite(mesh.positions) && all_finite(mesh.normals) && all_finite(mesh.uvs),
          "numbers are finite");
  const auto fits = [&](std::size_t count) { return count == 0 || count == mesh.positions.size(); };
  require(fits(mesh.normals.size()) && fits(mesh.uvs.size()), "all vertices have it, or none");
}

}  // namespace
}  // namespace fstop::test

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fstop::test;
  Input input(data, size);
  const char* name = kNames[input.choice() % kNames.size()];
  try {
    check(fstop::decode_mesh(name, input.bytes(), kLimits));
  } catch (const fstop::Error& error) {
    require(error.code() != fstop::ErrorCode::internal, "a mesh is refused, not stumbled over");
  }
  return 0;
}
