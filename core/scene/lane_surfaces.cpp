#include "core/scene/lane_surfaces.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/scene/ray_scene.h"
#include "core/simd.h"

namespace fstop {

// The corners of every lane's triangle: positions, vertex normals and texture coordinates.
struct alignas(64) SurfaceTable::Corners {
  using Lanes = std::array<float, kLanes>;
  // Not initialised, as only lanes that are loaded count: zeros would cost more than the loads.
  Lanes p[3][3];   // [corner][axis]
  Lanes n[3][3];   // zero where the triangle is flat
  Lanes uv[3][2];  // [corner][u, v]
};

namespace {

// The lanes that hit something.
struct LaneSet {
  bool any = false;
  std::size_t first = 0;
};

FSTOP_KERNEL void interpolate_uv(const RayPacket& packet,
                                 const std::array<float, kLanes> (&uv)[3][2], LaneSurfaces& s) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float b1 = packet.u[k];
    const float b2 = packet.v[k];
    const float b0 = 1.0F - b1 - b2;
    s.u[k] = b0 * uv[0][0][k] + b1 * uv[1][0][k] + b2 * uv[2][0][k];
    s.v[k] = b0 * uv[0][1][k] + b1 * uv[1][1][k] + b2 * uv[2][1][k];
  }
}

FSTOP_KERNEL float largest(float a, float b, float c) {
  return std::max(std::max(std::abs(a), std::abs(b)), std::abs(c));
}

// Position, normals and error of every lane, as if all were triangles; others are overwritten.
FSTOP_KERNEL void interpolate_geometry(const RayPacket& packet,
                                       const std::array<float, kLanes> (&p)[3][3],
                                       const std::array<float, kLanes> (&n)[3][3],
                                       LaneSurfaces& s) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float b1 = packet.u[k];
    const float b2 = packet.v[k];
    const float b0 = 1.0F - b1 - b2;
    const float e1x = p[1][0][k] - p[0][0][k];
    const float e1y = p[1][1][k] - p[0][1][k];
    const float e1z = p[1][2][k] - p[0][2][k];
    const float e2x = p[2][0][k] - p[0][0][k];
    const float e2y = p[2][1][k] - p[0][1][k];
    const float e2z = p[2][2][k] - p[0][2][k];
    float fx = e1y * e2z - e1z * e2y;
    float fy = e1z * e2x - e1x * e2z;
    float fz = e1x * e2y - e1y * e2x;
    const float length = std::sqrt(fx * fx + fy * fy + fz * fz);
    const float scale = length > 0.0F ? 1.0F / length : 1.0F;
    fx *= scale;
    fy *= scale;
    fz *= scale;
    const float nx = b0 * n[0][0][k] + b1 * n[1][0][k] + b2 * n[2][0][k];
    const float ny = b0 * n[0][1][k] + b1 * n[1][1][k] + b2 * n[2][1][k];
    const float nz = b0 * n[0][2][k] + b1 * n[1][2][k] + b2 * n[2][2][k];
    const float normal_length = std::sqrt(nx * nx + ny * ny + nz * nz);
    const float along = nx * fx + ny * fy + nz * fz;
    const bool smooth = normal_length > 0.0F;
    // The shading normal lies on the geometric one's side, and both on the ray's.
    const float towards = fx * packet.dir_x[k] + fy * packet.dir_y[k] + fz * packet.dir_z[k];
    const float side = towards > 0.0F ? -1.0F : 1.0F;
    const float turn = (along < 0.0F ? -side : side) / (smooth ? normal_length : 1.0F);
    s.outside[k] = towards > 0.0F ? 0 : -1;
    s.face_x[k] = side * fx;
    s.face_y[k] = side * fy;
    s.face_z[k] = side * fz;
    s.normal_x[k] = smooth ? turn * nx : side * fx;
    s.normal_y[k] = smooth ? turn * ny : side * fy;
    s.normal_z[k] = smooth ? turn * nz : side * fz;
    s.x[k] = b0 * p[0][0][k] + b1 * p[1][0][k] + b2 * p[2][0][k] + s.shift_x[k];
    s.y[k] = b0 * p[0][1][k] + b1 * p[1][1][k] + b2 * p[2][1][k] + s.shift_y[k];
    s.z[k] = b0 * p[0][2][k] + b1 * p[1][2][k] + b2 * p[2][2][k] + s.shift_z[k];
    const float reach = std::max(largest(p[0][0][k], p[0][1][k], p[0][2][k]),
                                 std::max(largest(p[1][0][k], p[1][1][k], p[1][2][k]),
                                          largest(p[2][0][k], p[2][1][k], p[2][2][k])));
    s.error[k] = kHitError * std::max(reach, largest(s.shift_x[k], s.shift_y[k], s.shift_z[k]));
  }
}

struct Kernels {
  void (*uv)(const RayPacket&, const std::array<float, kLanes> (&)[3][2], LaneSurfaces&);
  void (*geometry)(const RayPacket&, const std::array<float, kLanes> (&)[3][3],
                   const std::array<float, kLanes> (&)[3][3], LaneSurfaces&);
};

void uv_narrow(const RayPacket& packet, const std::array<float, kLanes> (&uv)[3][2],
               LaneSurfaces& s) {
  interpolate_uv(packet, uv, s);
}
FSTOP_AVX512 void uv_wide(const RayPacket& packet, const std::array<float, kLanes> (&uv)[3][2],
                          LaneSurfaces& s) {
  interpolate_uv(packet, uv, s);
}
void geometry_narrow(const RayPacket& packet, const std::array<float, kLanes> (&p)[3][3],
                     const std::array<float, kLanes> (&n)[3][3], LaneSurfaces& s) {
  interpolate_geometry(packet, p, n, s);
}
FSTOP_AVX512 void geometry_wide(const RayPacket& packet, const std::array<float, kLanes> (&p)[3][3],
                                const std::array<float, kLanes> (&n)[3][3], LaneSurfaces& s) {
  interpolate_geometry(packet, p, n, s);
}

Kernels kernels() noexcept {
  if (has_avx512()) return {uv_wide, geometry_wide};
  return {uv_narrow, geometry_narrow};
}

template <std::size_t N>
void spread(std::array<float, kLanes> (&lanes)[3][N], std::size_t from) {
  for (auto& corner : lanes) {
    for (auto& axis : corner) axis.fill(axis[from]);
  }
}

bool is_textured(const Material& material) {
  return material.emission.texture >= 0 || material.ambient.texture >= 0 ||
         material.diffuse.texture >= 0 || material.specular.texture >= 0;
}

}  // namespace

SurfaceTable::SurfaceTable(const Scene& scene,
                           const std::vector<std::vector<float>>& uv_per_metre) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    const Material& material = scene.materials[static_cast<std::size_t>(object.material)];
    Row row{.uv_per_metre = uv_per_metre[i].data(),
            .velocity = to_float(object.velocity * kLongestShutter),
            .material = object.material,
            .needs_geometry = material.model != ShadingModel::unlit || material.reflection > 0.0 ||
                              material.transmission > 0.0,
            .textured = is_textured(material)};
    moves_ = moves_ || object.velocity != Vec3{};
    if (const auto* shape = std::get_if<MeshObject>(&object.shape)) {
      row.positions = shape->mesh.positions.data();
      row.triangles = shape->mesh.triangles.data();
      if (!shape->mesh.uvs.empty()) row.uvs = shape->mesh.uvs.data();
      const bool smooth = shape->interpolation == Interpolation::phong;
      if (smooth && !shape->mesh.normals.empty()) row.normals = shape->mesh.normals.data();
    } else {
      const auto& sphere = std::get<SphereObject>(object.shape);
      row.center = to_float(sphere.center);
      row.radius = static_cast<float>(sphere.radius);
    }
    rows_.push_back(row);
  }
}

void SurfaceTable::load(const Row& row, std::uint32_t primitive, bool geometry, std::size_t lane,
                        Corners& corners) const noexcept {
  constexpr std::array<float, 3> kNone = {0.0F, 0.0F, 0.0F};
  const auto& t = row.triangles[primitive];
  for (std::size_t c = 0; c < 3; ++c) {
    corners.uv[c][0][lane] = row.uvs != nullptr ? row.uvs[t[c]][0] : 0.0F;
    corners.uv[c][1][lane] = row.uvs != nullptr ? row.uvs[t[c]][1] : 0.0F;
    if (!geometry) continue;
    const auto& p = row.positions[t[c]];
    const auto& n = row.normals != nullptr ? row.normals[t[c]] : kNone;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      corners.p[c][axis][lane] = p[axis];
      corners.n[c][axis][lane] = n[axis];
    }
  }
}

void SurfaceTable::fill_sphere(const Row& row, const RayPacket& packet, std::size_t k,
                               LaneSurfaces& s) const noexcept {
  const int lane = static_cast<int>(k);
  const Vec3f center = row.center + Vec3f{s.shift_x[k], s.shift_y[k], s.shift_z[k]};
  const Vec3f outwards =
      normalized(packet.origin(lane) + packet.direction(lane) * packet.far[k] - center);
  s.uv_per_metre[k] = row.uv_per_metre[0];
  if (row.textured) {
    s.u[k] = 0.5F + std::atan2(outwards.x, outwards.z) * 0.15915494F;
    s.v[k] = 0.5F + std::asin(std::clamp(outwards.y, -1.0F, 1.0F)) * 0.31830989F;
  }
  if (!row.needs_geometry) return;
  const Vec3f p = center + outwards * row.radius;
  const bool outside = !(dot(outwards, packet.direction(lane)) > 0.0F);
  const Vec3f face = outside ? outwards : -outwards;
  s.x[k] = p.x;
  s.y[k] = p.y;
  s.z[k] = p.z;
  s.face_x[k] = s.normal_x[k] = face.x;
  s.face_y[k] = s.normal_y[k] = face.y;
  s.face_z[k] = s.normal_z[k] = face.z;
  s.outside[k] = outside ? -1 : 0;
  // A grazing hit's distance is uncertain by the square root of a rounding of the radius.
  const float reach = std::max({std::abs(center.x), std::abs(center.y), std::abs(center.z)});
  s.error[k] = kHitError * (reach + 8.0F * row.radius + packet.far[k]);
}

void SurfaceTable::fill(const RayPacket& packet, const LaneMask& valid,
                        LaneSurfaces& s) const noexcept {
  // One triangle under all lanes: its corners are loaded once.
  LaneSet lanes;
  bool uniform = true;
  bool all_triangles = true;
  for (std::size_t k = 0; k < kLanes; ++k) {
    if (valid[k] == 0 || packet.object[k] == kNoHit) {
      s.material[k] = -1;
      all_triangles = false;
      continue;
    }
    if (!lanes.any) lanes.first = k;
    lanes.any = true;
    uniform = uniform && packet.object[k] == packet.object[lanes.first] &&
              packet.primitive[k] == packet.primitive[lanes.first];
    const Row& row = rows_[packet.object[k]];
    s.material[k] = row.material;
    all_triangles = all_triangles && row.positions != nullptr;
  }
  if (!lanes.any) return;
  Corners corners;
  // What lies in memory by chance may be denormal numbers, which are slow.
  if (!all_triangles) std::memset(&corners, 0, sizeof corners);
  bool any_uv = false;
  bool any_geometry = false;
  bool any_sphere = false;
  for (std::size_t k = lanes.first; k < kLanes; ++k) {
    if (s.material[k] < 0) continue;
    const Row& row = rows_[packet.object[k]];
    any_geometry = any_geometry || row.needs_geometry;
    if (row.positions == nullptr) {
      any_sphere = true;
    } else {
      any_uv = any_uv || row.textured;
      load(row, packet.primitive[k], row.needs_geometry, k, corners);
      s.uv_per_metre[k] = row.uv_per_metre[packet.primitive[k]];
    }
    if (uniform) break;
  }
  if (uniform && !any_sphere) {
    if (any_uv) spread(corners.uv, lanes.first);
    if (any_geometry) spread(corners.p, lanes.first);
    if (any_geometry) spread(corners.n, lanes.first);
    s.uv_per_metre.fill(s.uv_per_metre[lanes.first]);
  }
  if (moves_) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (s.material[k] < 0) continue;
      const Vec3f shift = rows_[packet.object[k]].velocity * packet.time[k];
      s.shift_x[k] = shift.x;
      s.shift_y[k] = shift.y;
      s.shift_z[k] = shift.z;
    }
  }
  const Kernels run = kernels();
  if (any_uv) run.uv(packet, corners.uv, s);
  if (any_geometry) run.geometry(packet, corners.p, corners.n, s);
  if (!any_sphere) return;
  for (std::size_t k = lanes.first; k < kLanes; ++k) {
    if (s.material[k] < 0) continue;
    const Row& row = rows_[packet.object[k]];
    if (row.positions == nullptr) fill_sphere(row, packet, k, s);
  }
}

}  // namespace fstop
