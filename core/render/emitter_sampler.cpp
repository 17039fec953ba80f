#include "core/render/emitter_sampler.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/sampling/warp.h"

namespace fstop {
namespace {

Vec3 corner(const Mesh& mesh, std::uint32_t i) {
  const auto& p = mesh.positions[i];
  return {double{p[0]}, double{p[1]}, double{p[2]}};
}

}  // namespace

EmitterSampler::EmitterSampler(const RayScene& scene, const Emitter& emitter,
                               const FilmProjection& film)
    : film_(film),
      center_(film.world_from_camera.from_world(emitter.center)),
      radius_(emitter.radius),
      one_sided_(emitter.outwards != 0) {
  if (!emitter.triangles.empty()) add_triangles(scene, emitter);
}

void EmitterSampler::add_triangles(const RayScene& scene, const Emitter& emitter) {
  const Mesh& mesh = std::get<MeshObject>(scene.scene().objects[emitter.object].shape).mesh;
  // How far the cosine at a point, seen from the pupil, may be from that at the triangle's middle,
  // seen from the pupil's centre: unit vectors at an angle of sine x < 1 differ by at most
  // sqrt(2) x. Triangles that are turned away by more are seen from nowhere.
  const auto room = [](double sine) { return sine < 1.0 ? std::numbers::sqrt2 * sine : 2.0; };
  const double parallax = room(kFarthestCorner * film_.pupil_radius / (center_.z - radius_));
  double sum = 0.0;
  for (const std::uint32_t i : emitter.triangles) {
    const auto& t = mesh.triangles[i];
    const Vec3 a = film_.world_from_camera.from_world(corner(mesh, t[0]));
    const Vec3 ab = film_.world_from_camera.from_world(corner(mesh, t[1])) - a;
    const Vec3 ac = film_.world_from_camera.from_world(corner(mesh, t[2])) - a;
    const Vec3 across = cross(ab, ac);
    const double area = 0.5 * norm(across);
    if (!(area > 0.0)) continue;
    const Vec3 normal = across * ((emitter.outwards < 0 ? -0.5 : 0.5) / area);
    const Vec3 middle = a + (ab + ac) * (1.0 / 3.0);
    const Vec3 towards = normalized(middle);
    const double own = room(std::max(norm(ab), norm(ac)) / norm(middle));
    const double cosine = one_sided_ ? -dot(normal, towards) : std::abs(dot(normal, towards));
    const double seen = area * std::max(0.0, cosine + parallax + own);
    if (!(seen > 0.0)) continue;
    sum += seen;
    upto_.push_back(sum);
    triangles_.push_back({.a = a,
                          .ab = ab,
                          .ac = ac,
                          .normal = normal,
                          .inverse_density = area / seen,
                          .primitive = i});
  }
  for (double& share : upto_) share /= sum;
  for (Triangle& triangle : triangles_) triangle.inverse_density *= sum;
}

void EmitterSampler::sample(const LaneValues& lens_x, const LaneValues& lens_y, const LaneValues& u,
                            const LaneValues& v, EmitterPoints& points) const noexcept {
  if (triangles_.empty()) {
    sample_sphere(lens_x, lens_y, u, v, points);
  } else {
    sample_triangles(lens_x, lens_y, u, v, points);
  }
}

void EmitterSampler::sample_sphere(const LaneValues& lens_x, const LaneValues& lens_y,
                                   const LaneValues& u, const LaneValues& v,
                                   EmitterPoints& points) const noexcept {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const Vec3 lens{lens_x[i], lens_y[i], 0.0};
    const Vec3 to_center = center_ - lens;
    const double squared = dot(to_center, to_center);
    const double distance = std::sqrt(squared);
    const Vec3 axis = to_center * (1.0 / distance);
    const double sine_squared = radius_ * radius_ / squared;  // of the cone's half angle
    // 1 - cos of the half angle, without cancellation for distant spheres.
    const double cap = sine_squared / (1.0 + std::sqrt(1.0 - sine_squared));
    const Vec2 disc = disc_point({u[i], v[i]});
    const double rise = (disc.x * disc.x + disc.y * disc.y) * cap;  // 1 - cos, evenly
    const double across = std::sqrt(cap * (2.0 - rise));
    const bool sideways = std::abs(axis.x) > 0.7;
    const Vec3 raw = sideways ? Vec3{-axis.y, axis.x, 0.0} : Vec3{0.0, axis.z, -axis.y};
    const Vec3 right = raw * (1.0 / norm(raw));
    const Vec3 up = cross(axis, right);
    const Vec3 direction = axis * (1.0 - rise) + right * (disc.x * across) + up * (disc.y * across);
    const double off_squared = squared * rise * (2.0 - rise);  // of the ray from the centre
    const double hit =
        distance * (1.0 - rise) - std::sqrt(std::max(0.0, radius_ * radius_ - off_squared));
    points.x[i] = lens.x + direction.x * hit;
    points.y[i] = lens.y + direction.y * hit;
    points.z[i] = direction.z * hit;
    points.distance[i] = hit;
    points.weight_px[i] = 2.0 * std::numbers::pi * cap * film_.px_per_steradian(direction.z);
    points.primitive[i] = 0;
  }
}

void EmitterSampler::sample_triangles(const LaneValues& lens_x, const LaneValues& lens_y,
                                      const LaneValues& u, const LaneValues& v,
                                      EmitterPoints& points) const noexcept {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const auto chosen = std::ranges::upper_bound(upto_, u[i]);
    const auto last = static_cast<std::ptrdiff_t>(triangles_.size()) - 1;
    const auto k = static_cast<std::size_t>(std::min(chosen - upto_.begin(), last));
    const Triangle& t = triangles_[k];
    const double from = k > 0 ? upto_[k - 1] : 0.0;
    const double along = std::clamp((u[i] - from) / (upto_[k] - from), 0.0, 1.0);
    const double root = std::sqrt(along);
    const double b1 = root * (1.0 - v[i]);
    const double b2 = root * v[i];
    const Vec3 p = t.a + t.ab * b1 + t.ac * b2;
    const Vec3 ray = p - Vec3{lens_x[i], lens_y[i], 0.0};
    const double squared = dot(ray, ray);
    const double distance = std::sqrt(squared);
    const double facing = -dot(ray, t.normal) / distance;
    const double cosine = one_sided_ ? std::max(0.0, facing) : std::abs(facing);
    points.x[i] = p.x;
    points.y[i] = p.y;
    points.z[i] = p.z;
    points.distance[i] = distance;
    points.weight_px[i] =
        t.inverse_density * cosine / squared * film_.px_per_steradian(ray.z / distance);
    points.primitive[i] = t.primitive;
    points.b1[i] = static_cast<float>(b1);
    points.b2[i] = static_cast<float>(b2);
  }
}

}  // namespace fstop
