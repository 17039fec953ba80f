#include "core/camera/film_projection.h"

#include <gtest/gtest.h>

namespace fstop {
namespace {

std::vector<CameraSpec> cameras() {
  CameraSpec lens;
  lens.position = {0.3, -0.2, 1.0};
  lens.look_at = {1.0, 0.5, -2.0};
  lens.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 1.4}, .focus_distance = 2.0_m};
  CameraSpec fixed = lens;
  fixed.breathing = false;
  CameraSpec far = lens;
  std::get<LensSpec>(far.optics).focus_distance = kInfinitelyFar;
  CameraSpec pinhole = lens;
  pinhole.optics = PinholeSpec{.image_distance = 40.0_mm, .diameter = 2.0_mm};
  return {lens, fixed, far, pinhole};
}

// Points along a camera's ray fall back where the ray came from. Tolerance: 1e-16 of 3 m over the
// pixel at 1,300 px a unit of slope, a hundred roundings.
TEST(FilmProjection, IsTheInverseOfTheCamerasRay) {
  for (const CameraSpec& spec : cameras()) {
    const Camera camera = camera_of(spec, sensor_of(spec, 96, 64));
    const FilmProjection film(camera);
    for (const Vec2 raster : {Vec2{3.25, 60.5}, Vec2{48, 32}, Vec2{90, 2}}) {
      for (const Vec2 pupil : {Vec2{0, 0}, Vec2{0.9, -0.3}, Vec2{-0.5, 0.7}}) {
        for (const double distance : {0.4, 2.0, 50.0}) {
          const Ray ray =
              std::visit([&](const auto& any) { return any.ray(raster, pupil); }, camera);
          const Vec3 point =
              film.world_from_camera.from_world(ray.origin + ray.direction * distance);
          const Vec2 found =
              film.raster(point, pupil.x * film.pupil_radius, pupil.y * film.pupil_radius);
          EXPECT_NEAR(found.x, raster.x, 1e-10);
          EXPECT_NEAR(found.y, raster.y, 1e-10);
        }
      }
    }
  }
}

// A small patch of a slanted plane, moved by differences, covers as much film as its solid angle
// says. Differences of 1e-6 leave 1e-6 of the product.
TEST(FilmProjection, SolidAngleTimesPixelsPerSteradianIsTheFilmsArea) {
  const double step = 1e-6;
  for (const CameraSpec& spec : cameras()) {
    const FilmProjection film(camera_of(spec, sensor_of(spec, 96, 64)));
    const Vec3 point{0.7, -0.4, 1.7};
    const Vec3 along{0.8 * step, 0.1 * step, 0.3 * step};
    const Vec3 across{-0.2 * step, 0.9 * step, -0.5 * step};
    const Vec2 lens{0.3 * film.pupil_radius, -0.6 * film.pupil_radius};
    const Vec2 here = film.raster(point, lens.x, lens.y);
    const Vec2 u = film.raster(point + along, lens.x, lens.y) - here;
    const Vec2 v = film.raster(point + across, lens.x, lens.y) - here;
    const Vec3 ray = point - Vec3{lens.x, lens.y, 0.0};
    const double distance = norm(ray);
    const double solid_angle =
        std::abs(dot(cross(along, across), ray)) / (distance * distance * distance);
    EXPECT_NEAR(
        std::abs(u.x * v.y - u.y * v.x) / (solid_angle * film.px_per_steradian(ray.z / distance)),
        1.0, 1e-5);
  }
}

TEST(FilmProjection, BlurIsTheCamerasBlurDiameter) {
  for (const CameraSpec& spec : cameras()) {
    const Sensor sensor = sensor_of(spec, 96, 64);
    const FilmProjection film(camera_of(spec, sensor));
    for (const double depth : {0.7, 2.0, 30.0}) {
      // A pinhole's blur is positive always; as a lens focused behind itself it is negative.
      const double expected = blur_diameter(spec, Length::si(depth)) / sensor.pixel_pitch;
      EXPECT_NEAR(std::abs(film.blur_px(depth)), std::abs(expected), 1e-9);
    }
  }
}

}  // namespace
}  // namespace fstop
