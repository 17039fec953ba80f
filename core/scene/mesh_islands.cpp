#include "core/scene/mesh_islands.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <unordered_map>

#include "core/geometry.h"

namespace fstop {
namespace {

// The lowest index of a vertex in the same place, for every vertex.
std::vector<std::uint32_t> welded(const Mesh& mesh) {
  std::vector<std::uint32_t> order(mesh.positions.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
    const auto& p = mesh.positions[a];
    const auto& q = mesh.positions[b];
    return p != q ? p < q : a < b;
  });
  std::vector<std::uint32_t> same(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool repeats = i > 0 && mesh.positions[order[i]] == mesh.positions[order[i - 1]];
    same[order[i]] = repeats ? same[order[i - 1]] : order[i];
  }
  return same;
}

struct Edge {
  std::uint32_t low = 0;
  std::uint32_t high = 0;
  std::uint32_t triangle = 0;
  bool ascends = false;  // the triangle goes from low to high

  bool joins(const Edge& other) const { return low == other.low && high == other.high; }
};

std::vector<Edge> edges_of(const Mesh& mesh) {
  const std::vector<std::uint32_t> same = welded(mesh);
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = same[t[k]];
      const std::uint32_t b = same[t[(k + 1) % 3]];
      if (a == b) continue;
      edges.push_back({std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(i), a < b});
    }
  }
  std::ranges::sort(edges, [](const Edge& a, const Edge& b) {
    return std::array{a.low, a.high, a.triangle} < std::array{b.low, b.high, b.triangle};
  });
  return edges;
}

// Which triangles hang together; the root of a set is its first triangle.
class Joined {
 public:
  explicit Joined(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t i, std::uint32_t j) {
    const std::uint32_t a = root(i);
    const std::uint32_t b = root(j);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

// Six times the volume that a closed surface encloses; its sign tells which way it is wound.
double signed_volume(const Mesh& mesh, const std::vector<std::uint32_t>& triangles) {
  const auto at = [&](std::uint32_t i) {
    const auto& p = mesh.positions[i];
    return Vec3{double{p[0]}, double{p[1]}, double{p[2]}};
  };
  // Seen from a corner of its own: small things far from the origin keep their digits.
  const Vec3 origin = at(mesh.triangles[triangles.front()][0]);
  double sum = 0.0;
  for (const std::uint32_t i : triangles) {
    const auto& t = mesh.triangles[i];
    sum += dot(at(t[0]) - origin, cross(at(t[1]) - origin, at(t[2]) - origin));
  }
  return sum;
}

}  // namespace

std::vector<MeshIsland> mesh_islands(const Mesh& mesh) {
  const std::vector<Edge> edges = edges_of(mesh);
  Joined joined(mesh.triangles.size());
  std::vector<char> open(mesh.triangles.size());
  for (std::size_t begin = 0; begin < edges.size();) {
    std::size_t end = begin + 1;
    while (end < edges.size() && edges[end].joins(edges[begin])) ++end;
    const bool is_closed = end - begin == 2 && edges[begin].ascends != edges[begin + 1].ascends;
    for (std::size_t i = begin; i < end; ++i) {
      joined.join(edges[begin].triangle, edges[i].triangle);
      if (!is_closed) open[edges[i].triangle] = 1;
    }
    begin = end;
  }
  std::vector<MeshIsland> islands;
  std::vector<std::size_t> island_of_root(mesh.triangles.size());
  std::vector<char> is_open;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const std::uint32_t root = joined.root(i);
    if (root == i) {
      island_of_root[i] = islands.size();
      islands.emplace_back();
      is_open.push_back(0);
    }
    const std::size_t island = island_of_root[root];
    islands[island].triangles.push_back(i);
    is_open[island] = is_open[island] != 0 || open[i] != 0 ? 1 : 0;
  }
  for (std::size_t i = 0; i < islands.size(); ++i) {
    if (is_open[i] != 0) continue;
    const double volume = signed_volume(mesh, islands[i].triangles);
    islands[i].outwards = volume > 0.0 ? 1 : volume < 0.0 ? -1 : 0;
  }
  return islands;
}

Mesh selected(const Mesh& mesh, const std::vector<std::uint32_t>& triangles) {
  Mesh part;
  std::unordered_map<std::uint32_t, std::uint32_t> renumbered;
  for (const std::uint32_t i : triangles) {
    std::array<std::uint32_t, 3> corners = mesh.triangles[i];
    for (std::uint32_t& corner : corners) {
      const auto next = static_cast<std::uint32_t>(part.positions.size());
      const auto [known, is_new] = renumbered.try_emplace(corner, next);
      if (is_new) part.positions.push_back(mesh.positions[corner]);
      corner = known->second;
    }
    part.triangles.push_back(corners);
  }
  return part;
}

}  // namespace fstop
