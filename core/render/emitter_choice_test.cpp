#include "core/render/emitter_choice.h"

#include <gtest/gtest.h>

#include "core/render/sample_loop.h"

namespace fstop {
namespace {

CameraSpec lens_camera() {
  CameraSpec spec;
  spec.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 1.4}, .focus_distance = 2.0_m};
  return spec;
}

Scene lamps(std::vector<SphereObject> spheres, float radiance = 50.0F) {
  Scene scene;
  scene.materials = {{.emission = {.value = {radiance, radiance, radiance}}}};
  for (const SphereObject& sphere : spheres) scene.objects.push_back({.shape = sphere});
  return scene;
}

EmitterChoice chosen(const RayScene& scene, double exposure = 1.0) {
  const CameraSpec spec = lens_camera();
  return emitter_choice(scene, camera_of(spec, sensor_of(spec, 960, 640)), exposure);
}

TEST(EmitterChoice, SmallAndBrightIsSplattedLargeIsNot) {
  // 1 px covers 0.73 mm per metre of distance: 2 px and 400 px wide.
  const RayScene scene(
      lamps({{.center = {0, 0, -10}, .radius = 0.0073}, {.center = {0.5, 0, -3}, .radius = 0.44}}));
  const EmitterChoice choice = chosen(scene);
  ASSERT_EQ(choice.emitters.size(), 1U);
  EXPECT_EQ(choice.emitters[0].number, 0U);
  EXPECT_EQ(choice.found, 2U);
  EXPECT_EQ(choice.bright, 2U);
  EXPECT_NEAR(choice.emitters[0].sharp_px, 2.0, 0.1);
  EXPECT_EQ(choice.camera_mask, ~scene.emitters()[0].mask());
  EXPECT_TRUE(chosen(scene, 0.01).emitters.empty());
  EXPECT_EQ(chosen(scene, 0.01).camera_mask, 0xffffffffU);
}

TEST(EmitterChoice, NothingIsSplattedThatTouchesThePupilPlane) {
  const RayScene scene(lamps({{.center = {0.01, 0, 0}, .radius = 0.001}}));
  EXPECT_TRUE(chosen(scene).emitters.empty());
  EXPECT_EQ(chosen(scene).camera_mask, 0xffffffffU);
}

// Beyond the border by 0.3 of the disc's diameter some light comes in; by 0.9, more than even a
// triangle's corner reaches (0.78), none. At 1 m the disc is A v/p (1/1 - 1/2) wide.
TEST(EmitterChoice, DiscsReachIntoTheFrame) {
  const double px_at_1_m = (1.0 / 0.050 - 1.0 / 2.0) * 37.5e-6;  // metres
  const double blur_px = 0.050 / 1.4 * 0.5 / px_at_1_m;
  for (const double side : {-1.0, 1.0}) {
    const RayScene scene(
        lamps({{.center = {side * (480.0 + 0.3 * blur_px) * px_at_1_m, 0, -1}, .radius = 0.0005},
               {.center = {0, side * (320.0 + 0.3 * blur_px) * px_at_1_m, -1}, .radius = 0.0005},
               {.center = {side * (480.0 + 0.9 * blur_px) * px_at_1_m, 0, -1}, .radius = 0.0005}}));
    const EmitterChoice choice = chosen(scene);
    ASSERT_EQ(choice.emitters.size(), 2U);
    EXPECT_EQ(choice.emitters[0].number, 0U);
    EXPECT_EQ(choice.emitters[1].number, 1U);
    EXPECT_NEAR(choice.emitters[0].blur_px, blur_px, 0.01 * blur_px);
  }
}

// Emitters all around the camera, in 31 groups of several: whatever a camera ray of the unmasked
// kind hits first is either not splatted at all or on the list.
TEST(EmitterChoice, NoneThatACameraRayMeetsIsForgotten) {
  std::vector<SphereObject> spheres;
  std::uint32_t state = 7;
  const auto random = [&] {
    state = hash_of(state, 1);
    return state * 0x1p-32;
  };
  for (int i = 0; i < 4000; ++i) {
    const Vec3 center{8.0 * random() - 4.0, 6.0 * random() - 3.0, 1.0 - 6.0 * random()};
    spheres.push_back({.center = center, .radius = 0.002 + 0.01 * random()});
  }
  const RayScene scene(lamps(spheres));
  const CameraSpec spec = lens_camera();
  const Sensor sensor = sensor_of(spec, 240, 160);
  const Camera camera = camera_of(spec, sensor);
  const EmitterChoice choice = emitter_choice(scene, camera, 1.0);
  EXPECT_GT(choice.emitters.size(), 100U);
  EXPECT_GT(choice.beyond, 100U);
  std::vector<char> listed(spheres.size());
  for (const SplattedEmitter& e : choice.emitters) listed[e.number] = 1;
  int hits = 0;
  for (int i = 0; i < 200000; ++i) {
    const Vec2 raster{240.0 * random(), 160.0 * random()};
    const Vec2 pupil = disc_point({random(), random()});
    const Ray ray = std::visit([&](const auto& any) { return any.ray(raster, pupil); }, camera);
    RayPacket packet;
    packet.set(0, to_float(ray.origin), to_float(ray.direction), kFar, 0.0F);
    scene.intersect_one(packet);
    if (!packet.hit(0)) continue;
    const std::uint32_t object = packet.object[0];
    const bool is_splatted = (scene.emitters()[object].mask() & choice.splat_mask()) != 0;
    if (!is_splatted) continue;
    ++hits;
    EXPECT_EQ(listed[object], 1) << "emitter " << object;
  }
  EXPECT_GT(hits, 1000);
}

}  // namespace
}  // namespace fstop
