#include "core/scene/vertex_normals.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <span>
#include <tuple>

#include "core/error.h"

namespace fstop {
namespace {

// Faces turn by exactly the crease angle where a model is made of regular steps: those count as
// smooth, whatever single precision makes of them.
constexpr double kSlack = 1e-5;

Vec3 vec(const std::array<float, 3>& p) { return {double{p[0]}, double{p[1]}, double{p[2]}}; }

struct Face {
  Vec3 normal = {};  // unit; zero: no area
  std::array<double, 3> angle = {};
};

double angle_between(Vec3 a, Vec3 b) {
  const double lengths = norm(a) * norm(b);
  return lengths > 0.0 ? std::acos(std::clamp(dot(a, b) / lengths, -1.0, 1.0)) : 0.0;
}

Face face_of(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  std::array<Vec3, 3> p;
  for (std::size_t i = 0; i < 3; ++i) p[i] = vec(mesh.positions[triangle[i]]);
  Face face;
  const Vec3 area = cross(p[1] - p[0], p[2] - p[0]);
  if (norm(area) > 0.0) face.normal = normalized(area);
  for (std::size_t i = 0; i < 3; ++i) {
    face.angle[i] = angle_between(p[(i + 1) % 3] - p[i], p[(i + 2) % 3] - p[i]);
  }
  return face;
}

struct Corner {
  std::uint32_t face = 0;
  std::uint32_t number = 0;  // of the triangle's three
};

// The corners at each position: of the sorted list those that stand together.
class SharedPositions {
 public:
  explicit SharedPositions(const Mesh& mesh) : mesh_(mesh) {
    corners_.reserve(3 * mesh.triangles.size());
    for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
      for (std::uint32_t i = 0; i < 3; ++i) corners_.push_back({f, i});
    }
    std::ranges::sort(corners_, {}, [&](const Corner& corner) { return key_of(corner); });
  }

  // Calls visit(corners) for each position.
  template <typename Visit>
  void for_each(const Visit& visit) const {
    for (auto first = corners_.begin(); first != corners_.end();) {
      const auto end = std::find_if(first, corners_.end(), [&](const Corner& corner) {
        return position(corner) != position(*first);
      });
      visit(std::span(first, end));
      first = end;
    }
  }

 private:
  const std::array<float, 3>& position(const Corner& corner) const {
    return mesh_.positions[mesh_.triangles[corner.face][corner.number]];
  }
  std::tuple<float, float, float, std::uint32_t> key_of(const Corner& corner) const {
    const auto& p = position(corner);
    return {p[0], p[1], p[2], corner.face};
  }

  const Mesh& mesh_;
  std::vector<Corner> corners_;
};

// Vertices of the result, made as corners ask for them.
class SplitVertices {
 public:
  explicit SplitVertices(const Mesh& mesh) : mesh_(mesh) { result_.triangles = mesh.triangles; }

  void set(const Corner& corner, Vec3 normal) {
    const std::uint32_t vertex = mesh_.triangles[corner.face][corner.number];
    const std::array<float, 3> n = {static_cast<float>(normal.x), static_cast<float>(normal.y),
                                    static_cast<float>(normal.z)};
    const auto bits = std::bit_cast<std::array<std::uint32_t, 3>>(n);
    const auto [place, is_new] = numbers_.try_emplace(
        std::tuple(vertex, bits), static_cast<std::uint32_t>(result_.positions.size()));
    if (is_new) {
      result_.positions.push_back(mesh_.positions[vertex]);
      result_.normals.push_back(n);
      if (!mesh_.uvs.empty()) result_.uvs.push_back(mesh_.uvs[vertex]);
    }
    result_.triangles[corner.face][corner.number] = place->second;
  }
  Mesh mesh() && { return std::move(result_); }

 private:
  const Mesh& mesh_;
  Mesh result_ = {};
  std::map<std::tuple<std::uint32_t, std::array<std::uint32_t, 3>>, std::uint32_t> numbers_ = {};
};

}  // namespace

Mesh with_averaged_normals(const Mesh& mesh, double crease_angle) {
  std::vector<Face> faces;
  faces.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) faces.push_back(face_of(mesh, triangle));
  const double least_cosine = std::cos(std::min(crease_angle + kSlack, std::acos(-1.0)));

  SplitVertices vertices(mesh);
  SharedPositions(mesh).for_each([&](std::span<const Corner> corners) {
    if (corners.size() > kMostFacesOfAVertex) {
      throw Error(ErrorCode::bad_geometry,
                  "more than " + std::to_string(kMostFacesOfAVertex) + " faces meet at one vertex");
    }
    for (const Corner& corner : corners) {
      const Vec3 own = faces[corner.face].normal;
      Vec3 sum = {};
      for (const Corner& other : corners) {
        const Face& face = faces[other.face];
        if (dot(own, face.normal) >= least_cosine)
          sum = sum + face.normal * face.angle[other.number];
      }
      vertices.set(corner, norm(sum) > 0.0 ? normalized(sum) : own);
    }
  });
  return std::move(vertices).mesh();
}

}  // namespace fstop
