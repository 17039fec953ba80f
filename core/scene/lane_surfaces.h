#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/mapping.h"
#include "core/scene/ray_packet.h"
#include "core/scene/scene.h"

namespace fstop {

/// The surfaces that a packet's lanes have hit, lane by lane, as `Surface` tells them of one ray.
struct alignas(64) LaneSurfaces {
  template <typename T>
  using Lanes = std::array<T, kLanes>;

  Lanes<std::int32_t> material = {};  // index into Scene::materials; -1: nothing was hit
  std::int32_t only_material = -1;    // of all lanes that hit; -1: nothing was hit, or several
  bool all_hit = false;
  // Not initialised: zeros would cost more than the surfaces. Texture coordinates hold where the
  // material has a texture, the rest where it answers to lights, reflects or transmits.
  Lanes<float> u, v, uv_per_metre;
  // Gradients of u and v in space, 1/metre: where a texture is anisotropic or gives relief.
  Lanes<float> du_x, du_y, du_z, dv_x, dv_y, dv_z;
  Lanes<float> x, y, z;                       // position, world, metres
  Lanes<float> face_x, face_y, face_z;        // geometric normal, on the ray's side
  Lanes<float> normal_x, normal_y, normal_z;  // shading normal, turned with it
  Lanes<float> error;                         // metres: new rays start this far off the surface
  Lanes<float> shift_x = {}, shift_y = {}, shift_z = {};  // how far the object moved, metres
  Lanes<std::int32_t> outside;  // -1 where the winding's normal pointed to the ray's origin

  Vec3f position(std::size_t k) const noexcept { return {x[k], y[k], z[k]}; }
  Vec3f face(std::size_t k) const noexcept { return {face_x[k], face_y[k], face_z[k]}; }
  Vec3f normal(std::size_t k) const noexcept { return {normal_x[k], normal_y[k], normal_z[k]}; }
  Vec3f du(std::size_t k) const noexcept { return {du_x[k], du_y[k], du_z[k]}; }
  Vec3f dv(std::size_t k) const noexcept { return {dv_x[k], dv_y[k], dv_z[k]}; }
  void set_gradients(std::size_t k, Vec3f du, Vec3f dv) noexcept {
    du_x[k] = du.x;
    du_y[k] = du.y;
    du_z[k] = du.z;
    dv_x[k] = dv.x;
    dv_y[k] = dv.y;
    dv_z[k] = dv.z;
  }
};

/// How far hit points may be off, relative to the largest coordinate involved: about 30 roundings
/// of 2^-24 by interpolation and Embree's own arithmetic.
inline constexpr float kHitError = 2e-6F;

/// A scene's objects as packets are interpolated on them: where their corners lie in memory.
/// Points into the scene, which must stay where it is.
class SurfaceTable {
 public:
  SurfaceTable() = default;
  /// Quads are meshes already. `uv_per_metre`: by object, by triangle, as RayScene keeps it.
  SurfaceTable(const Scene& scene, const std::vector<std::vector<float>>& uv_per_metre);

  /// Fills `surfaces` of every valid lane of a traced packet.
  void fill(const RayPacket& packet, const LaneMask& valid, LaneSurfaces& surfaces) const noexcept;

 private:
  struct Row {
    const std::array<float, 3>* positions = nullptr;  // null: a sphere
    const std::array<float, 3>* normals = nullptr;    // null: flat
    const std::array<float, 2>* uvs = nullptr;        // null: no texture coordinates
    const std::array<std::uint32_t, 3>* triangles = nullptr;
    const float* uv_per_metre = nullptr;
    Vec3f velocity = {};
    Vec3f center = {};
    float radius = 0.0F;
    std::int32_t material = 0;
    bool needs_geometry = false;  // lit, mirroring or transparent
    bool textured = false;
    std::int32_t map = -1;   // index into maps_
    bool has_own_uv = true;  // else the map tells them
    bool needs_gradients = false;
  };
  struct Corners;

  void fill_any(const RayPacket& packet, const LaneMask& valid,
                LaneSurfaces& surfaces) const noexcept;
  void fill_wide(const RayPacket& packet, const LaneMask& valid,
                 LaneSurfaces& surfaces) const noexcept;
  void fill_triangle(const Row& row, std::uint32_t primitive, const RayPacket& packet,
                     LaneSurfaces& surfaces) const noexcept;
  void fill_lanes(const RayPacket& packet, std::size_t first,
                  LaneSurfaces& surfaces) const noexcept;
  void load(const Row& row, std::uint32_t primitive, bool geometry, std::size_t lane,
            Corners& corners) const noexcept;
  void fill_sphere(const Row& row, const RayPacket& packet, std::size_t lane,
                   LaneSurfaces& surfaces) const noexcept;
  // The coordinates and gradients that the scene's mappings and reliefs ask for.
  void follow_maps(const RayPacket& packet, LaneSurfaces& surfaces) const noexcept;
  void set_triangle_gradients(const Row& row, std::uint32_t primitive, std::size_t lane,
                              LaneSurfaces& surfaces) const noexcept;

  std::vector<Row> rows_ = {};
  std::vector<SurfaceMap> maps_ = {};
  bool moves_ = false;
  bool has_maps_ = false;  // or gradients
};

}  // namespace fstop
