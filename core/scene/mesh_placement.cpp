#include "core/scene/mesh_placement.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"

namespace fstop {
namespace {

struct Box {
  std::array<double, 3> low = {};
  std::array<double, 3> high = {};
};

Box bounds_of(const Mesh& mesh) {
  Box box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] =
        std::ranges::minmax(mesh.positions, {}, [=](const auto& point) { return point[axis]; });
    box.low[axis] = low[axis];
    box.high[axis] = high[axis];
  }
  return box;
}

}  // namespace

void place(Mesh& mesh, const Placement& placement) {
  if (mesh.positions.empty())
    throw Error(ErrorCode::bad_geometry, "the mesh has no vertices to be placed");
  const Box box = bounds_of(mesh);
  double largest = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    largest = std::max(largest, box.high[axis] - box.low[axis]);
  if (!(largest > 0.0))
    throw Error(ErrorCode::bad_geometry, "the mesh has no extent to be placed by");
  const double scale = placement.size / largest;
  const double cosine = std::cos(placement.turn);
  const double sine = std::sin(placement.turn);
  const auto turned = [&](double x, double y, double z) {
    return Vec3{cosine * x + sine * z, y, cosine * z - sine * x};
  };
  const auto centred = [&](const std::array<float, 3>& point, std::size_t axis) {
    return scale * (point[axis] - 0.5 * (box.low[axis] + box.high[axis]));
  };
  for (std::array<float, 3>& point : mesh.positions) {
    const Vec3 moved =
        placement.center + turned(centred(point, 0), centred(point, 1), centred(point, 2));
    point = {static_cast<float>(moved.x), static_cast<float>(moved.y), static_cast<float>(moved.z)};
  }
  for (std::array<float, 3>& normal : mesh.normals) {
    const Vec3 n = turned(normal[0], normal[1], normal[2]);
    normal = {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)};
  }
}

}  // namespace fstop
