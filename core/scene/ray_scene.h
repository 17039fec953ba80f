#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "core/scene/emitters.h"
#include "core/scene/lane_surfaces.h"
#include "core/scene/ray_packet.h"
#include "core/scene/scene.h"
#include "core/scene/texture.h"

struct RTCGeometryTy;

namespace fstop {

/// A point of a surface as a ray sees it.
struct Surface {
  Vec3f position = {};
  Vec3f geometric_normal = {};  // unit, on the ray's side
  Vec3f shading_normal = {};    // unit, turned with the geometric one
  float u = 0.0F;
  float v = 0.0F;
  float uv_per_metre = 0.0F;  // how fast uv runs here: square root of the ratio of areas
  float error = 0.0F;         // metres: new rays start this far off the surface
  std::uint32_t object = kNoHit;
  std::uint32_t primitive = 0;
  float b1 = 0.0F;  // barycentric weights of a triangle's second and third corner
  float b2 = 0.0F;
  Vec3f shift = {};          // how far the object has moved, metres
  bool from_outside = true;  // the winding's normal pointed towards the ray's origin
};

/// A triangle's corner, for interpolations done at corners.
struct Corner {
  Vec3f position = {};
  Vec3f normal = {};  // unit, turned to the ray's side
};

enum class Coherence { coherent, incoherent };

/// A scene ready to be traced by Embree. Immutable, shared between threads.
class RayScene {
 public:
  /// `scene` has its assets loaded (load_assets).
  /// Throws: Error{bad_geometry} for what cannot be built (no triangle, bad index, non-finite or
  ///         too large coordinates), Error{unsupported} for texture filters of later versions,
  ///         Error{over_budget} when Embree runs out of memory.
  explicit RayScene(Scene scene);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  const Scene& scene() const noexcept { return scene_; }
  const Texture& texture(int index) const noexcept {
    return textures_[static_cast<std::size_t>(index)];
  }
  /// Small bright things that may be splatted; rays whose mask lacks the bit of their group
  /// pass through them (Emitter::mask). All other surfaces have bit 0.
  const std::vector<Emitter>& emitters() const noexcept { return emitters_; }
  bool moves() const noexcept { return moves_; }
  /// There are lights, and surfaces that answer to them.
  bool lit() const noexcept { return lit_; }
  /// The largest channel of what surfaces emit and of the background.
  float brightest() const noexcept { return brightest_; }
  /// Something reflects or transmits.
  bool branches() const noexcept { return branches_; }
  /// Some object's textures are fixed to the picture; and which.
  bool has_screen_maps() const noexcept { return has_screen_maps_; }
  bool is_on_screen(std::uint32_t object) const noexcept {
    return has_screen_maps_ &&
           std::holds_alternative<ScreenMapping>(scene_.objects[object].mapping);
  }
  /// Some surface has a bump or a normal map.
  bool has_relief() const noexcept { return has_relief_; }
  /// Something lets light through straight on, so that shadow rays need transmittance().
  bool has_thin_sheets() const noexcept { return has_thin_sheets_; }

  /// Finds the first hit of every valid lane, at `packet.time`, the time after the shutter
  /// opens as a share of kLongestShutter, 0 to 1.
  void intersect(RayPacket& packet, const LaneMask& valid, Coherence coherence) const noexcept;
  /// Sets `far` of every valid lane to -infinity where anything lies between near and far.
  void occlude(RayPacket& packet, const LaneMask& valid, Coherence coherence) const noexcept;
  /// Same as intersect for lane 0 alone.
  void intersect_one(RayPacket& packet) const noexcept;

  /// The share of light that passes from `origin` along `direction` over `distance`: the product
  /// of thin sheets' transmissions, 0 behind anything else.
  float transmittance(Vec3f origin, Vec3f direction, float distance, float time) const noexcept;

  /// The surface that lane `lane` has hit.
  Surface surface(const RayPacket& packet, int lane) const noexcept;
  /// The surfaces that all valid lanes have hit.
  void surfaces(const RayPacket& packet, const LaneMask& valid,
                LaneSurfaces& result) const noexcept {
    table_.fill(packet, valid, result);
  }
  /// The corners of the triangle that was hit; of a sphere, three times the hit point.
  std::array<Corner, 3> corners(const Surface& surface) const noexcept;
  const Material& material(const Surface& surface) const noexcept;
  const Material& material(std::int32_t index) const noexcept {
    return scene_.materials[static_cast<std::size_t>(index)];
  }
  Interpolation interpolation(std::uint32_t object) const noexcept;

  /// Bytes held by Embree and by textures.
  std::size_t memory_bytes() const noexcept;

 private:
  struct Acceleration;
  /// A geometry of its own for some triangles of an object: those of one group of emitters.
  struct Part {
    std::uint32_t object = 0;
    std::vector<std::uint32_t> triangles = {};
  };
  void add_object(const Object& object);
  void add_parts(std::uint32_t number, const Mesh& mesh,
                 const std::vector<std::uint32_t>& triangle_masks);
  void attach(RTCGeometryTy* geometry, std::uint32_t number, std::uint32_t mask);
  void name_objects(RayPacket& packet) const noexcept;

  Scene scene_;
  float brightest_ = brightest_radiance(scene_);  // while textures hold their images
  std::vector<Texture> textures_;
  std::vector<Emitter> emitters_;
  std::vector<Part> parts_;                       // geometries numbered after the objects'
  std::vector<std::vector<float>> uv_per_metre_;  // by object, by triangle
  SurfaceTable table_;
  std::unique_ptr<Acceleration> acceleration_;
  bool moves_ = false;
  bool lit_ = false;
  bool branches_ = false;
  bool has_thin_sheets_ = false;
  bool has_screen_maps_ = false;
  bool has_relief_ = false;
};

/// Objects move linearly over at most this many seconds.
inline constexpr double kLongestShutter = 64.0;

}  // namespace fstop
