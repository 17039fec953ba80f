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

// One triangle's corners, under all lanes.
struct OneTriangle {
  std::array<float, 3> p[3] = {};
  std::array<float, 3> n[3] = {};
  std::array<float, 2> uv[3] = {};
};

// Numbers of the corners as lane k has them, for either kind.
template <typename Lanes>
FSTOP_KERNEL float at(const Lanes& lanes, std::size_t k) {
  return lanes[k];
}
FSTOP_KERNEL float at(float all, std::size_t) { return all; }

template <typename Corners>
FSTOP_KERNEL void interpolate_uv(const RayPacket& packet, const Corners& c, LaneSurfaces& s) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float b1 = packet.u[k];
    const float b2 = packet.v[k];
    const float b0 = 1.0F - b1 - b2;
    s.u[k] = b0 * at(c.uv[0][0], k) + b1 * at(c.uv[1][0], k) + b2 * at(c.uv[2][0], k);
    s.v[k] = b0 * at(c.uv[0][1], k) + b1 * at(c.uv[1][1], k) + b2 * at(c.uv[2][1], k);
  }
}

FSTOP_KERNEL float largest(float a, float b, float c) {
  return std::max(std::max(std::abs(a), std::abs(b)), std::abs(c));
}

// Position, normals and error of every lane, as if all were triangles; others are overwritten.
template <typename Corners>
FSTOP_KERNEL void interpolate_geometry(const RayPacket& packet, const Corners& c, LaneSurfaces& s) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float b1 = packet.u[k];
    const float b2 = packet.v[k];
    const float b0 = 1.0F - b1 - b2;
    const float e1x = at(c.p[1][0], k) - at(c.p[0][0], k);
    const float e1y = at(c.p[1][1], k) - at(c.p[0][1], k);
    const float e1z = at(c.p[1][2], k) - at(c.p[0][2], k);
    const float e2x = at(c.p[2][0], k) - at(c.p[0][0], k);
    const float e2y = at(c.p[2][1], k) - at(c.p[0][1], k);
    const float e2z = at(c.p[2][2], k) - at(c.p[0][2], k);
    float fx = e1y * e2z - e1z * e2y;
    float fy = e1z * e2x - e1x * e2z;
    float fz = e1x * e2y - e1y * e2x;
    const float length = std::sqrt(fx * fx + fy * fy + fz * fz);
    const float scale = length > 0.0F ? 1.0F / length : 1.0F;
    fx *= scale;
    fy *= scale;
    fz *= scale;
    const float nx = b0 * at(c.n[0][0], k) + b1 * at(c.n[1][0], k) + b2 * at(c.n[2][0], k);
    const float ny = b0 * at(c.n[0][1], k) + b1 * at(c.n[1][1], k) + b2 * at(c.n[2][1], k);
    const float nz = b0 * at(c.n[0][2], k) + b1 * at(c.n[1][2], k) + b2 * at(c.n[2][2], k);
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
    s.x[k] = b0 * at(c.p[0][0], k) + b1 * at(c.p[1][0], k) + b2 * at(c.p[2][0], k) + s.shift_x[k];
    s.y[k] = b0 * at(c.p[0][1], k) + b1 * at(c.p[1][1], k) + b2 * at(c.p[2][1], k) + s.shift_y[k];
    s.z[k] = b0 * at(c.p[0][2], k) + b1 * at(c.p[1][2], k) + b2 * at(c.p[2][2], k) + s.shift_z[k];
    const float reach =
        std::max(largest(at(c.p[0][0], k), at(c.p[0][1], k), at(c.p[0][2], k)),
                 std::max(largest(at(c.p[1][0], k), at(c.p[1][1], k), at(c.p[1][2], k)),
                          largest(at(c.p[2][0], k), at(c.p[2][1], k), at(c.p[2][2], k))));
    s.error[k] = kHitError * std::max(reach, largest(s.shift_x[k], s.shift_y[k], s.shift_z[k]));
  }
}

bool is_textured(const Material& material) {
  return material.emission.texture >= 0 || material.ambient.texture >= 0 ||
         material.diffuse.texture >= 0 || material.specular.texture >= 0 ||
         material.bump.texture >= 0 || material.normal_map.texture >= 0;
}

bool is_anisotropic(const Scene& scene, const ColorSource& source) {
  return source.texture >= 0 && scene.textures[static_cast<std::size_t>(source.texture)].filter ==
                                    TextureFilter::anisotropic;
}

bool needs_gradients(const Scene& scene, const Material& material) {
  return material.bump.texture >= 0 || material.normal_map.texture >= 0 ||
         is_anisotropic(scene, material.emission) || is_anisotropic(scene, material.ambient) ||
         is_anisotropic(scene, material.diffuse) || is_anisotropic(scene, material.specular);
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
            .textured = is_textured(material),
            .has_own_uv = !(maps_by_position(object.mapping) && is_textured(material)),
            .needs_gradients = needs_gradients(scene, material)};
    row.needs_geometry = row.needs_geometry || !row.has_own_uv || row.needs_gradients;
    has_maps_ = has_maps_ || !row.has_own_uv || row.needs_gradients;
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
    const bool is_sphere = row.positions == nullptr;
    if (!row.has_own_uv || (row.needs_gradients && is_sphere)) {
      row.map = static_cast<std::int32_t>(maps_.size());
      // A sphere's own coordinates are a mapping about its centre.
      maps_.emplace_back(
          row.has_own_uv ? SphericalMapping{.origin = std::get<SphereObject>(object.shape).center}
                         : object.mapping);
    }
    rows_.push_back(row);
  }
}

FSTOP_KERNEL void SurfaceTable::load(const Row& row, std::uint32_t primitive, bool geometry,
                                     std::size_t lane, Corners& corners) const noexcept {
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

// All lanes that hit lie on one triangle: its corners are loaded once.
FSTOP_KERNEL void SurfaceTable::fill_triangle(const Row& row, std::uint32_t primitive,
                                              const RayPacket& packet,
                                              LaneSurfaces& s) const noexcept {
  const auto& t = row.triangles[primitive];
  OneTriangle corners;
  s.uv_per_metre.fill(row.uv_per_metre[primitive]);
  if (row.textured && row.uvs != nullptr) {
    for (std::size_t c = 0; c < 3; ++c) corners.uv[c] = row.uvs[t[c]];
    interpolate_uv(packet, corners, s);
  } else if (row.textured) {
    s.u.fill(0.0F);
    s.v.fill(0.0F);
  }
  if (!row.needs_geometry) return;
  for (std::size_t c = 0; c < 3; ++c) {
    corners.p[c] = row.positions[t[c]];
    if (row.normals != nullptr) corners.n[c] = row.normals[t[c]];
  }
  interpolate_geometry(packet, corners, s);
}

// Lanes from `first` on that hit different triangles, or spheres.
FSTOP_KERNEL void SurfaceTable::fill_lanes(const RayPacket& packet, std::size_t first,
                                           LaneSurfaces& s) const noexcept {
  bool any_uv = false;
  bool any_geometry = false;
  bool any_sphere = false;
  Corners corners;
  for (std::size_t k = first; k < kLanes; ++k) {
    if (s.material[k] < 0) continue;
    any_sphere = any_sphere || rows_[packet.object[k]].positions == nullptr;
  }
  // What lies in memory by chance may be denormal numbers, which are slow.
  if (!s.all_hit || any_sphere) std::memset(&corners, 0, sizeof corners);
  for (std::size_t k = first; k < kLanes; ++k) {
    if (s.material[k] < 0) continue;
    const Row& row = rows_[packet.object[k]];
    if (row.positions == nullptr) continue;
    any_uv = any_uv || row.textured;
    any_geometry = any_geometry || row.needs_geometry;
    load(row, packet.primitive[k], row.needs_geometry, k, corners);
    s.uv_per_metre[k] = row.uv_per_metre[packet.primitive[k]];
  }
  if (any_uv) interpolate_uv(packet, corners, s);
  if (any_geometry) interpolate_geometry(packet, corners, s);
  if (!any_sphere) return;
  for (std::size_t k = first; k < kLanes; ++k) {
    if (s.material[k] < 0) continue;
    const Row& row = rows_[packet.object[k]];
    if (row.positions == nullptr) fill_sphere(row, packet, k, s);
  }
}

FSTOP_KERNEL void SurfaceTable::fill_any(const RayPacket& packet, const LaneMask& valid,
                                         LaneSurfaces& s) const noexcept {
  alignas(64) LaneMask hit;
  std::int32_t some = 0;
  std::int32_t every = -1;
  for (std::size_t k = 0; k < kLanes; ++k) {
    hit[k] = packet.object[k] != kNoHit ? valid[k] : 0;
    some |= hit[k];
    every &= hit[k];
  }
  s.all_hit = every != 0;
  s.only_material = -1;
  if (some == 0) return s.material.fill(-1);
  std::size_t first = 0;
  while (hit[first] == 0) ++first;
  const std::uint32_t object = packet.object[first];
  const std::uint32_t primitive = packet.primitive[first];
  std::uint32_t other_object = 0;
  std::uint32_t other_primitive = 0;
  for (std::size_t k = 0; k < kLanes; ++k) {
    const auto mask = static_cast<std::uint32_t>(hit[k]);
    other_object |= mask & (packet.object[k] ^ object);
    other_primitive |= mask & (packet.primitive[k] ^ primitive);
  }
  const Row& row = rows_[object];
  if (other_object == 0) {
    s.only_material = row.material;
    for (std::size_t k = 0; k < kLanes; ++k) s.material[k] = hit[k] != 0 ? row.material : -1;
  } else {
    bool one = true;
    for (std::size_t k = 0; k < kLanes; ++k) {
      s.material[k] = hit[k] != 0 ? rows_[packet.object[k]].material : -1;
      one = one && (hit[k] == 0 || s.material[k] == row.material);
    }
    if (one) s.only_material = row.material;
  }
  if (moves_) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (hit[k] == 0) continue;
      const Vec3f shift = rows_[packet.object[k]].velocity * packet.time[k];
      s.shift_x[k] = shift.x;
      s.shift_y[k] = shift.y;
      s.shift_z[k] = shift.z;
    }
  }
  if ((other_object | other_primitive) == 0 && row.positions != nullptr) {
    fill_triangle(row, primitive, packet, s);
  } else {
    fill_lanes(packet, first, s);
  }
  if (has_maps_) follow_maps(packet, s);
}

FSTOP_AVX512 void SurfaceTable::fill_wide(const RayPacket& packet, const LaneMask& valid,
                                          LaneSurfaces& surfaces) const noexcept {
  fill_any(packet, valid, surfaces);
}

void SurfaceTable::fill(const RayPacket& packet, const LaneMask& valid,
                        LaneSurfaces& surfaces) const noexcept {
  if (has_avx512()) return fill_wide(packet, valid, surfaces);
  fill_any(packet, valid, surfaces);
}

}  // namespace fstop
