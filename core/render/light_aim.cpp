#include "core/render/light_aim.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <variant>

#include "core/sampling/warp.h"

namespace fstop {
namespace {

constexpr double kMargin = 1.0001;  // of balls about objects, against roundings

class Box {
 public:
  void add(const Vec3& p) {
    low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y), std::min(low_.z, p.z)};
    high_ = {std::max(high_.x, p.x), std::max(high_.y, p.y), std::max(high_.z, p.z)};
  }
  Vec3 center() const { return (low_ + high_) * 0.5; }
  double half_diagonal() const { return low_.x <= high_.x ? 0.5 * norm(high_ - low_) : 0.0; }

 private:
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  Vec3 low_ = {kNone, kNone, kNone};
  Vec3 high_ = {-kNone, -kNone, -kNone};
};

Vec3 across(const Vec3& axis) {
  return normalized(cross(axis, std::abs(axis.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
}

Vec3 vec(const std::array<float, 3>& p) { return {double{p[0]}, double{p[1]}, double{p[2]}}; }

// The quad that a mesh is, as RayScene makes one of two triangles.
std::optional<QuadObject> quad_of(const Object& object) {
  const auto* mesh_object = std::get_if<MeshObject>(&object.shape);
  if (mesh_object == nullptr) return std::nullopt;
  const Mesh& mesh = mesh_object->mesh;
  using Triangle = std::array<std::uint32_t, 3>;
  if (mesh.positions.size() != 4 ||
      mesh.triangles != std::vector<Triangle>{Triangle{0, 1, 2}, Triangle{0, 2, 3}}) {
    return std::nullopt;
  }
  const Vec3 corner = vec(mesh.positions[0]);
  const QuadObject quad{.corner = corner,
                        .edge_u = vec(mesh.positions[1]) - corner,
                        .edge_v = vec(mesh.positions[3]) - corner};
  const Vec3 off = vec(mesh.positions[2]) - corner - quad.edge_u - quad.edge_v;
  // Roundings of single precision, by the largest number that was rounded.
  const double largest = norm(corner) + norm(quad.edge_u) + norm(quad.edge_v);
  if (norm(off) > 1e-6 * largest) return std::nullopt;
  return quad;
}

bool turns_light(const Material& material) {
  return material.reflection > 0.0 || (material.transmission > 0.0 && material.ior);
}

}  // namespace

struct LightAimer::BallOf {
  Ball operator()(const SphereObject& sphere) const {
    return {sphere.center, kMargin * sphere.radius};
  }
  Ball operator()(const QuadObject&) const { return {}; }  // RayScene has made meshes of them
  Ball operator()(const MeshObject& object) const {
    Box box;
    for (const auto& p : object.mesh.positions) box.add(vec(p));
    return {box.center(), kMargin * box.half_diagonal()};
  }
};

LightAimer::Ball LightAimer::ball_of(const Object& object) {
  return std::visit(BallOf{}, object.shape);
}

// One ray, as a lamp's kind has it.
struct LightAimer::Aimed {
  const LightAimer& aimer;
  Vec3 shift = {};  // how far the object has moved
  Vec2 way = {};
  Vec2 place = {};
  float at_time = 0.0F;
  int lane = 0;
  RayPacket& ray;

  double operator()(const DirectionalLight& lamp) const {
    const Vec3 direction = normalized(lamp.direction);
    const Vec3 center = aimer.ball_.center + shift;
    const double back =
        aimer.scene_.radius + norm(center - aimer.scene_.center) + aimer.ball_.radius;
    if (const auto& quad = aimer.quad_) {
      set(point(*quad) - direction * back, direction);
      return std::abs(dot(cross(quad->edge_u, quad->edge_v), direction));
    }
    const Vec3 right = across(direction);
    const Vec2 disc = disc_point(way);
    const Vec3 off = right * disc.x + cross(direction, right) * disc.y;
    set(center + off * aimer.ball_.radius - direction * back, direction);
    return std::numbers::pi * aimer.ball_.radius * aimer.ball_.radius;
  }
  double operator()(const PointLight& lamp) const { return from(lamp.position); }
  double operator()(const SpotLight& lamp) const {
    const double angle = from(lamp.position);
    const double cosine = dot(to_float(normalized(lamp.direction)), ray.direction(lane));
    return cosine > 0.0 ? angle * std::pow(cosine, lamp.exponent) : 0.0;
  }
  double operator()(const AreaLight& lamp) const {
    return from(lamp.corner + lamp.edge_u * place.x + lamp.edge_v * place.y);
  }

  void set(const Vec3& origin, const Vec3& direction) const {
    ray.set(lane, to_float(origin), normalized(to_float(direction)), kFar, at_time);
  }
  Vec3 point(const QuadObject& quad) const {
    return quad.corner + quad.edge_u * way.x + quad.edge_v * way.y + shift;
  }

  double from(const Vec3& origin) const {
    const Vec3 to_center = aimer.ball_.center + shift - origin;
    const double distance = norm(to_center);
    const bool inside = !(distance > aimer.ball_.radius);
    const auto& quad = aimer.quad_;
    if (quad && !inside) {
      const Vec3 to_point = point(*quad) - origin;
      const double squared = dot(to_point, to_point);
      const Vec3 direction = to_point * (1.0 / std::sqrt(squared));
      set(origin, direction);
      return std::abs(dot(cross(quad->edge_u, quad->edge_v), direction)) / squared;
    }
    // 1 - cos of the half angle, without cancellation for distant balls.
    const double sine = inside ? 1.0 : aimer.ball_.radius / distance;
    const double cap = inside ? 2.0 : sine * sine / (1.0 + std::sqrt(1.0 - sine * sine));
    const Vec2 disc = disc_point(way);
    const Vec3 axis = distance > 0.0 ? to_center * (1.0 / distance) : Vec3{0.0, 0.0, 1.0};
    const double rise = std::min(cap, (disc.x * disc.x + disc.y * disc.y) * cap);  // 1 - cos
    const double around = std::sqrt(std::max(0.0, cap * (2.0 - rise)));
    const Vec3 right = across(axis);
    set(origin,
        axis * (1.0 - rise) + right * (disc.x * around) + cross(axis, right) * (disc.y * around));
    return 2.0 * std::numbers::pi * cap;
  }
};

LightAimer::LightAimer(const RayScene& scene, const LightAim& aim, double shutter_seconds)
    : light_(scene.scene().lights[aim.light]),
      object_(scene.scene().objects[aim.object]),
      quad_(quad_of(object_)),
      ball_(ball_of(object_)) {
  if (!std::holds_alternative<DirectionalLight>(light_.kind)) return;
  Box box;
  for (const Object& object : scene.scene().objects) {
    const Ball ball = ball_of(object);
    const double reach = ball.radius + norm(object.velocity) * shutter_seconds;
    box.add(ball.center + Vec3{reach, reach, reach});
    box.add(ball.center - Vec3{reach, reach, reach});
  }
  scene_ = {box.center(), box.half_diagonal()};
}

double LightAimer::aim(Vec2 way, Vec2 place, double seconds, int lane, RayPacket& ray) const {
  return std::visit(Aimed{.aimer = *this,
                          .shift = object_.velocity * seconds,
                          .way = way,
                          .place = place,
                          .at_time = static_cast<float>(seconds / kLongestShutter),
                          .lane = lane,
                          .ray = ray},
                    light_.kind);
}

std::vector<LightAim> light_aims(const RayScene& scene, Illumination illumination) {
  std::vector<LightAim> aims;
  if (illumination != Illumination::global || !scene.lit()) return aims;
  const Scene& all = scene.scene();
  for (std::uint32_t object = 0; object < all.objects.size(); ++object) {
    const int material = all.objects[object].material;
    if (!turns_light(all.materials[static_cast<std::size_t>(material)])) continue;
    for (std::uint32_t light = 0; light < all.lights.size(); ++light) {
      if (all.lights[light].intensity != Rgb{0, 0, 0})
        aims.push_back({.light = light, .object = object});
    }
  }
  return aims;
}

}  // namespace fstop
