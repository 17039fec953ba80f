#include "core/scene/ray_scene.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <utility>

#include <embree3/rtcore.h>

#include "core/build_stop.h"
#include "core/error.h"
#include "core/scene/half_packets.h"
#include "core/scene/mapping_check.h"
#include "core/scene/mesh_islands.h"

namespace fstop {
namespace {

static_assert(sizeof(RayPacket) == sizeof(RTCRayHit16));
static_assert(offsetof(RayPacket, far) == offsetof(RTCRay16, tfar));
static_assert(offsetof(RayPacket, time) == offsetof(RTCRay16, time));
static_assert(offsetof(RayPacket, flags) == offsetof(RTCRay16, flags));
static_assert(offsetof(RayPacket, normal_x) == offsetof(RTCRayHit16, hit));
static_assert(offsetof(RayPacket, u) == offsetof(RTCRayHit16, hit) + offsetof(RTCHit16, u));
static_assert(offsetof(RayPacket, object) ==
              offsetof(RTCRayHit16, hit) + offsetof(RTCHit16, geomID));

constexpr double kLargestCoordinate = 1e7;     // metres
constexpr std::uint32_t kOrdinarySurface = 1;  // bit 0 of masks

Vec3f vec(const std::array<float, 3>& a) { return {a[0], a[1], a[2]}; }
float largest(Vec3f a) { return std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z)}); }

void require_finite(Vec3 a, const char* what) {
  const auto is_legal = [](double x) { return std::abs(x) <= kLargestCoordinate; };
  if (!(is_legal(a.x) && is_legal(a.y) && is_legal(a.z))) {  // false for NaN too
    throw Error(ErrorCode::bad_geometry,
                std::string(what) + " must be finite and at most 1e7 m from the origin");
  }
}

void check_mesh(const MeshObject& object) {
  const Mesh& mesh = object.mesh;
  if (mesh.triangles.empty()) {
    throw Error(ErrorCode::bad_geometry, "mesh " + object.file + " has no triangle");
  }
  for (const auto& p : mesh.positions) require_finite({p[0], p[1], p[2]}, "mesh vertices");
  const auto count = static_cast<std::uint32_t>(mesh.positions.size());
  for (const auto& t : mesh.triangles) {
    if (std::max({t[0], t[1], t[2]}) >= count) {
      throw Error(ErrorCode::bad_geometry, "mesh " + object.file + " has an index out of range");
    }
  }
}

// The quad as two triangles; their corners in the order of Embree's barycentric coordinates.
Mesh triangles_of(const QuadObject& quad) {
  require_finite(quad.corner, "a quad's corner");
  require_finite(quad.edge_u, "a quad's edge");
  require_finite(quad.edge_v, "a quad's edge");
  if (!(norm(cross(quad.edge_u, quad.edge_v)) > 0.0)) {
    throw Error(ErrorCode::bad_geometry, "a quad's edges must span an area");
  }
  Mesh mesh;
  for (const Vec3 p : {quad.corner, quad.corner + quad.edge_u,
                       quad.corner + quad.edge_u + quad.edge_v, quad.corner + quad.edge_v}) {
    const Vec3f f = to_float(p);
    mesh.positions.push_back({f.x, f.y, f.z});
  }
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

std::vector<float> uv_rates(const Mesh& mesh) {
  std::vector<float> rates(mesh.triangles.size(), 0.0F);
  if (mesh.uvs.empty()) return rates;
  for (std::size_t i = 0; i < rates.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const Vec3f a = vec(mesh.positions[t[0]]);
    const Vec3f b = vec(mesh.positions[t[1]]);
    const Vec3f c = vec(mesh.positions[t[2]]);
    const auto& p = mesh.uvs[t[0]];
    const auto& q = mesh.uvs[t[1]];
    const auto& r = mesh.uvs[t[2]];
    const float uv_area = std::abs((q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1]));
    const float area = norm(cross(b - a, c - a));
    if (area > 0.0F) rates[i] = std::sqrt(uv_area / area);
  }
  return rates;
}

void check_shape(const Object& object) {
  require_finite(object.velocity * kLongestShutter, "the way an object moves in 64 s");
  if (const auto* mesh = std::get_if<MeshObject>(&object.shape)) {
    check_mesh(*mesh);
  } else if (const auto* sphere = std::get_if<SphereObject>(&object.shape)) {
    require_finite(sphere->center, "a sphere's centre");
    if (!(sphere->radius > 0.0 && sphere->radius <= kLargestCoordinate)) {
      throw Error(ErrorCode::bad_geometry, "a sphere's radius must lie in 0 to 1e7 m");
    }
  }
}

// The mask of each triangle of an object of which only some shine, or in different groups; empty
// where all have the same.
std::vector<std::uint32_t> triangle_masks(const std::vector<Emitter>& emitters,
                                          std::uint32_t number, const Mesh& mesh) {
  std::vector<std::uint32_t> masks;
  const auto of_object = std::ranges::equal_range(emitters, number, {}, &Emitter::object);
  if (of_object.empty()) return masks;
  masks.assign(mesh.triangles.size(), kOrdinarySurface);
  for (const Emitter& emitter : of_object) {
    for (const std::uint32_t i : emitter.triangles) masks[i] = emitter.mask();
  }
  if (std::ranges::count(masks, masks.front()) == std::ssize(masks)) masks.clear();
  return masks;
}

}  // namespace

struct RayScene::Acceleration {
  // Embree's own configuration may be given by FSTOP_EMBREE: "isa=avx2" on a machine that has more.
  Acceleration() : device(rtcNewDevice(std::getenv("FSTOP_EMBREE"))) {
    if (device == nullptr) throw Error(ErrorCode::internal, "Embree has no device");
    rtcSetDeviceErrorFunction(device, &Acceleration::on_error, this);
    rtcSetDeviceMemoryMonitorFunction(device, &Acceleration::on_memory, this);
    scene = rtcNewScene(device);
    // Watertight along shared edges: no light leaks between a mesh's triangles.
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneProgressMonitorFunction(scene, &Acceleration::on_progress, this);
    has_packets = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
    has_halves = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0;
  }
  ~Acceleration() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Acceleration(const Acceleration&) = delete;
  Acceleration& operator=(const Acceleration&) = delete;

  static void on_error(void* self, RTCError code, const char* text) {
    auto& errors = *static_cast<Acceleration*>(self);
    errors.out_of_memory = errors.out_of_memory || code == RTC_ERROR_OUT_OF_MEMORY;
    if (errors.message.empty()) errors.message = text != nullptr ? text : "Embree failed";
  }
  static bool on_memory(void* self, ssize_t bytes, bool) {
    static_cast<Acceleration*>(self)->bytes += bytes;
    return true;
  }
  // On any thread of Embree's.
  static bool on_progress(void* self, double) {
    return !static_cast<Acceleration*>(self)->stop.stop_requested();
  }
  void check() const {
    BuildStop::throw_if_requested();
    if (message.empty()) return;
    throw Error(out_of_memory ? ErrorCode::over_budget : ErrorCode::bad_geometry, message);
  }

  const std::stop_token stop = BuildStop::current();
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  bool has_packets = false;  // of kLanes
  bool has_halves = false;   // of kLanes / 2
  bool out_of_memory = false;
  std::string message;
  std::atomic<std::ptrdiff_t> bytes = 0;
};

namespace {

RTCGeometry triangle_geometry(RTCDevice device, const Mesh& mesh, Vec3 velocity, bool moves) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryTimeStepCount(geometry, moves ? 2 : 1);
  for (unsigned step = 0; step < (moves ? 2U : 1U); ++step) {
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, step, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), mesh.positions.size()));
    if (vertices == nullptr) break;
    const Vec3f shift = to_float(velocity * (step * kLongestShutter));
    for (const auto& p : mesh.positions) {
      *vertices++ = p[0] + shift.x;
      *vertices++ = p[1] + shift.y;
      *vertices++ = p[2] + shift.z;
    }
  }
  auto* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(std::uint32_t), mesh.triangles.size());
  if (indices != nullptr) {
    std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
  }
  return geometry;
}

RTCGeometry sphere_geometry(RTCDevice device, const SphereObject& sphere, Vec3 velocity,
                            bool moves) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
  rtcSetGeometryTimeStepCount(geometry, moves ? 2 : 1);
  for (unsigned step = 0; step < (moves ? 2U : 1U); ++step) {
    auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, step, RTC_FORMAT_FLOAT4, 4 * sizeof(float), 1));
    if (vertex == nullptr) break;
    const Vec3f center = to_float(sphere.center + velocity * (step * kLongestShutter));
    vertex[0] = center.x;
    vertex[1] = center.y;
    vertex[2] = center.z;
    vertex[3] = static_cast<float>(sphere.radius);
  }
  return geometry;
}

}  // namespace

RayScene::RayScene(Scene scene)
    : scene_(std::move(scene)), acceleration_(std::make_unique<Acceleration>()) {
  textures_.reserve(scene_.textures.size());
  for (TextureSource& source : scene_.textures) {
    textures_.emplace_back(source);
    source.image = Image{};  // the pyramid holds it now
  }
  for (Object& object : scene_.objects) {
    // Quads become meshes here, so that every surface but a sphere is a triangle.
    if (const auto* quad = std::get_if<QuadObject>(&object.shape)) {
      object.shape = MeshObject{
          .file = "quad", .interpolation = Interpolation::flat, .mesh = triangles_of(*quad)};
    }
    check_shape(object);
    check_mapping(object, scene_.materials[static_cast<std::size_t>(object.material)]);
    BuildStop::throw_if_requested();
  }
  emitters_ = find_emitters(scene_, textures_);
  for (const Object& object : scene_.objects) {
    add_object(object);
    const Material& surface = scene_.materials[static_cast<std::size_t>(object.material)];
    lit_ = lit_ || (!scene_.lights.empty() && surface.model != ShadingModel::unlit);
    branches_ = branches_ || surface.reflection > 0.0 || surface.transmission > 0.0;
    has_screen_maps_ = has_screen_maps_ || std::holds_alternative<ScreenMapping>(object.mapping);
    has_relief_ = has_relief_ || gives_relief(surface);
    has_thin_sheets_ = has_thin_sheets_ || (surface.transmission > 0.0 && !surface.ior);
  }
  table_ = SurfaceTable(scene_, uv_per_metre_);
  rtcCommitScene(acceleration_->scene);
  acceleration_->check();
}

RayScene::~RayScene() = default;

void RayScene::add_object(const Object& object) {
  const bool moves = object.velocity != Vec3{};
  moves_ = moves_ || moves;
  const auto number = static_cast<std::uint32_t>(uv_per_metre_.size());
  const auto emitter = std::ranges::lower_bound(emitters_, number, {}, &Emitter::object);
  const bool shines = emitter != emitters_.end() && emitter->object == number;
  const std::uint32_t mask = shines ? emitter->mask() : kOrdinarySurface;
  if (const auto* mesh = std::get_if<MeshObject>(&object.shape)) {
    uv_per_metre_.push_back(uv_rates(mesh->mesh));
    const std::vector<std::uint32_t> masks = triangle_masks(emitters_, number, mesh->mesh);
    if (!masks.empty()) {
      add_parts(number, mesh->mesh, masks);
      return;
    }
    attach(triangle_geometry(acceleration_->device, mesh->mesh, object.velocity, moves), number,
           mask);
  } else {
    const auto& sphere = std::get<SphereObject>(object.shape);
    // u spans the equator 2 pi r, v half of it.
    const double rate = 1.0 / (std::sqrt(2.0) * 3.141592653589793 * sphere.radius);
    uv_per_metre_.push_back({static_cast<float>(rate)});
    attach(sphere_geometry(acceleration_->device, sphere, object.velocity, moves), number, mask);
  }
}

void RayScene::add_parts(std::uint32_t number, const Mesh& mesh,
                         const std::vector<std::uint32_t>& triangle_masks) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> triangles_of_mask;
  for (std::uint32_t i = 0; i < triangle_masks.size(); ++i) {
    triangles_of_mask[triangle_masks[i]].push_back(i);
  }
  for (auto& [mask, triangles] : triangles_of_mask) {
    const auto geometry = static_cast<std::uint32_t>(scene_.objects.size() + parts_.size());
    attach(triangle_geometry(acceleration_->device, selected(mesh, triangles), {}, false), geometry,
           mask);
    parts_.push_back({.object = number, .triangles = std::move(triangles)});
  }
}

void RayScene::attach(RTCGeometryTy* geometry, std::uint32_t number, std::uint32_t mask) {
  rtcSetGeometryMask(geometry, mask);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(acceleration_->scene, geometry, number);
  rtcReleaseGeometry(geometry);
  acceleration_->check();
}

void RayScene::name_objects(RayPacket& packet) const noexcept {
  if (parts_.empty()) return;
  const auto first = static_cast<std::uint32_t>(scene_.objects.size());
  for (std::size_t i = 0; i < kLanes; ++i) {
    const std::uint32_t part = packet.object[i] - first;  // huge for objects and for no hit
    if (part >= parts_.size()) continue;
    packet.object[i] = parts_[part].object;
    packet.primitive[i] = parts_[part].triangles[packet.primitive[i]];
  }
}

void RayScene::intersect_one(RayPacket& packet) const noexcept {
  LaneMask first = {};
  first[0] = -1;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit one;
  auto* all = reinterpret_cast<RTCRayHitN*>(&packet);
  one.ray = rtcGetRayFromRayN(RTCRayHitN_RayN(all, kLanes), kLanes, 0);
  one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  one.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(acceleration_->scene, &context, &one);
  packet.far[0] = one.ray.tfar;
  packet.object[0] = one.hit.geomID;
  packet.primitive[0] = one.hit.primID;
  packet.u[0] = one.hit.u;
  packet.v[0] = one.hit.v;
  name_objects(packet);
}

void RayScene::intersect(RayPacket& packet, const LaneMask& valid,
                         Coherence coherence) const noexcept {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (coherence == Coherence::coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  auto* rays = reinterpret_cast<RTCRayHit16*>(&packet);
  if (acceleration_->has_packets) {
    rtcIntersect16(valid.data(), acceleration_->scene, &context, rays);
    name_objects(packet);
    return;
  }
  if (acceleration_->has_halves) {
    intersect_halves(acceleration_->scene, context, valid, packet);
    return name_objects(packet);
  }
  auto* all = reinterpret_cast<RTCRayHitN*>(rays);
  for (unsigned i = 0; i < kLanes; ++i) {
    if (valid[i] == 0) continue;
    RTCRayHit one;
    one.ray = rtcGetRayFromRayN(RTCRayHitN_RayN(all, kLanes), kLanes, i);
    one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    one.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(acceleration_->scene, &context, &one);
    packet.far[i] = one.ray.tfar;
    packet.object[i] = one.hit.geomID;
    packet.primitive[i] = one.hit.primID;
    packet.u[i] = one.hit.u;
    packet.v[i] = one.hit.v;
  }
  name_objects(packet);
}

void RayScene::occlude(RayPacket& packet, const LaneMask& valid,
                       Coherence coherence) const noexcept {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (coherence == Coherence::coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  auto* rays = reinterpret_cast<RTCRay16*>(&packet);
  if (acceleration_->has_packets) {
    rtcOccluded16(valid.data(), acceleration_->scene, &context, rays);
    return;
  }
  if (acceleration_->has_halves) {
    return occlude_halves(acceleration_->scene, context, valid, packet);
  }
  for (unsigned i = 0; i < kLanes; ++i) {
    if (valid[i] == 0) continue;
    RTCRay one = rtcGetRayFromRayN(reinterpret_cast<RTCRayN*>(rays), kLanes, i);
    rtcOccluded1(acceleration_->scene, &context, &one);
    packet.far[i] = one.tfar;
  }
}

float RayScene::transmittance(Vec3f origin, Vec3f direction, float distance,
                              float time) const noexcept {
  float passed = 1.0F;
  RayPacket packet;
  while (passed > 0.0F && distance > 0.0F) {
    packet.set(0, origin, direction, distance, time);
    intersect_one(packet);
    if (!packet.hit(0)) return passed;
    const Surface sheet = surface(packet, 0);
    const Material& blocked = material(sheet);
    if (!(blocked.transmission > 0.0) || blocked.ior) return 0.0F;
    passed *= static_cast<float>(blocked.transmission);
    // Two sheets closer than the error of a hit count as one.
    const float step = packet.far[0] + sheet.error;
    origin = origin + direction * step;
    distance -= step;
  }
  return passed;
}

Surface RayScene::surface(const RayPacket& packet, int lane) const noexcept {
  const auto k = static_cast<std::size_t>(lane);
  Surface s{.object = packet.object[k],
            .primitive = packet.primitive[k],
            .b1 = packet.u[k],
            .b2 = packet.v[k]};
  const Object& object = scene_.objects[s.object];
  const float seconds = packet.time[k] * static_cast<float>(kLongestShutter);
  s.shift = moves_ ? to_float(object.velocity) * seconds : Vec3f{};
  Vec3f outwards = {};
  if (const auto* mesh_object = std::get_if<MeshObject>(&object.shape)) {
    const Mesh& mesh = mesh_object->mesh;
    const auto& t = mesh.triangles[s.primitive];
    const Vec3f a = vec(mesh.positions[t[0]]);
    const Vec3f b = vec(mesh.positions[t[1]]);
    const Vec3f c = vec(mesh.positions[t[2]]);
    const float b0 = 1.0F - s.b1 - s.b2;
    s.position = a * b0 + b * s.b1 + c * s.b2 + s.shift;
    s.geometric_normal = normalized(cross(b - a, c - a));
    outwards = s.geometric_normal;
    s.shading_normal = s.geometric_normal;
    if (mesh_object->interpolation == Interpolation::phong && !mesh.normals.empty()) {
      s.shading_normal = normalized(vec(mesh.normals[t[0]]) * b0 + vec(mesh.normals[t[1]]) * s.b1 +
                                    vec(mesh.normals[t[2]]) * s.b2);
      if (dot(s.shading_normal, s.geometric_normal) < 0.0F) s.shading_normal = -s.shading_normal;
    }
    if (!mesh.uvs.empty()) {
      const auto& p = mesh.uvs[t[0]];
      const auto& q = mesh.uvs[t[1]];
      const auto& r = mesh.uvs[t[2]];
      s.u = b0 * p[0] + s.b1 * q[0] + s.b2 * r[0];
      s.v = b0 * p[1] + s.b1 * q[1] + s.b2 * r[1];
    }
    s.uv_per_metre = uv_per_metre_[s.object][s.primitive];
    s.error = kHitError * std::max({largest(a), largest(b), largest(c), largest(s.shift)});
  } else {
    const auto& sphere = std::get<SphereObject>(object.shape);
    const Vec3f center = to_float(sphere.center) + s.shift;
    const auto radius = static_cast<float>(sphere.radius);
    outwards = normalized(packet.origin(lane) + packet.direction(lane) * packet.far[k] - center);
    s.position = center + outwards * radius;
    s.geometric_normal = outwards;
    s.shading_normal = outwards;
    s.u = 0.5F + std::atan2(outwards.x, outwards.z) * 0.15915494F;
    s.v = 0.5F + std::asin(std::clamp(outwards.y, -1.0F, 1.0F)) * 0.31830989F;
    s.uv_per_metre = uv_per_metre_[s.object][0];
    // A grazing hit's distance is uncertain by the square root of a rounding of the radius.
    s.error = kHitError * (largest(center) + 8.0F * radius + packet.far[k]);
  }
  if (maps_by_position(object.mapping)) {
    const UvPoint point = SurfaceMap(object.mapping).at(s.position - s.shift);
    s.u = point.u;
    s.v = point.v;
    s.uv_per_metre = uv_rate(point, outwards);
  }
  if (dot(outwards, packet.direction(lane)) > 0.0F) {
    s.from_outside = false;
    s.geometric_normal = -s.geometric_normal;
    s.shading_normal = -s.shading_normal;
  }
  return s;
}

std::array<Corner, 3> RayScene::corners(const Surface& s) const noexcept {
  const auto* object = std::get_if<MeshObject>(&scene_.objects[s.object].shape);
  std::array<Corner, 3> result = {};
  if (object == nullptr) {
    result.fill({s.position, s.shading_normal});
    return result;
  }
  const Mesh& mesh = object->mesh;
  const auto& t = mesh.triangles[s.primitive];
  const Vec3f face = s.geometric_normal;
  for (std::size_t i = 0; i < 3; ++i) {
    Vec3f normal = mesh.normals.empty() ? face : normalized(vec(mesh.normals[t[i]]));
    if (dot(normal, face) < 0.0F) normal = -normal;
    result[i] = {vec(mesh.positions[t[i]]) + s.shift, normal};
  }
  return result;
}

const Material& RayScene::material(const Surface& s) const noexcept {
  return scene_.materials[static_cast<std::size_t>(scene_.objects[s.object].material)];
}

Interpolation RayScene::interpolation(std::uint32_t object) const noexcept {
  const auto* mesh = std::get_if<MeshObject>(&scene_.objects[object].shape);
  return mesh != nullptr ? mesh->interpolation : Interpolation::phong;
}

std::size_t RayScene::memory_bytes() const noexcept {
  auto bytes = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, acceleration_->bytes.load()));
  for (const Texture& texture : textures_) bytes += texture.memory_bytes();
  return bytes;
}

}  // namespace fstop
