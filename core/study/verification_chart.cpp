#include "core/study/verification_chart.h"

#include <cmath>

namespace fstop {
namespace {

Scene glowing(Vec3 corner, Vec3 edge_u, Vec3 edge_v) {
  Scene scene;
  scene.materials = {Material{.name = "glow", .emission = {.value = {1.0F, 1.0F, 1.0F}}}};
  scene.objects = {
      {.shape = QuadObject{.corner = corner, .edge_u = edge_u, .edge_v = edge_v}, .material = 0}};
  return scene;
}

// Twice as far from the axis at `depth` as any ray through the pupil ends, and the frame again for
// what a method looks at beside it.
double reach_at(const SimulationSpec& shot, double depth) {
  const CameraSpec& camera = shot.camera;
  const double frame = std::max(camera.sensor_width.si(), camera.sensor_height.si());
  double pupil = 0.0;
  double at_focus = 0.0;
  if (const auto* lens = std::get_if<LensSpec>(&camera.optics)) {
    pupil = lens->lens.focal_length.si() / lens->lens.f_number;
    at_focus = depth / lens->focus_distance.si();
  } else {
    pupil = std::get<PinholeSpec>(camera.optics).diameter.si();
  }
  return 4.0 * frame * depth / chart_sensor_distance(camera) + 2.0 * pupil * (1.0 + at_focus);
}

// Along the edge (upwards), and across it into the bright side; world, y up.
struct EdgeAxes {
  Vec3 along = {-std::sin(kChartSlant), -std::cos(kChartSlant), 0.0};
  Vec3 across = {std::cos(kChartSlant), -std::sin(kChartSlant), 0.0};
};

}  // namespace

double chart_sensor_distance(const CameraSpec& camera) {
  if (const auto* hole = std::get_if<PinholeSpec>(&camera.optics)) return hole->image_distance.si();
  const auto& lens = std::get<LensSpec>(camera.optics);
  const double f = lens.lens.focal_length.si();
  return camera.breathing ? f / (1.0 - f / lens.focus_distance.si()) : f;
}

SimulationSpec chart_shot(const VerificationCheck& check, Length pitch, int width, int height) {
  SimulationSpec shot;
  shot.camera = check.camera;
  shot.camera.position = {};
  shot.camera.look_at = {0.0, 0.0, -1.0};
  shot.camera.up = {0.0, 1.0, 0.0};
  shot.camera.velocity = {};
  shot.camera.sensor_width = pitch * width;
  shot.camera.sensor_height = pitch * height;
  shot.width = width;
  shot.height = height;
  shot.effects.motion = EffectChoice::off;
  shot.effects.defocus = EffectChoice::on;
  shot.effects.diffraction = EffectChoice::off;
  shot.quality.method = check.method.empty() ? "lens-sampling" : check.method;
  if (check.samples > 0) shot.quality.samples = check.samples;
  shot.seed = 1;
  return shot;
}

Scene edge_chart(const SimulationSpec& shot, Length depth) {
  const EdgeAxes axes;
  const double reach = reach_at(shot, depth.si());
  return glowing(Vec3{0.0, 0.0, -depth.si()} - axes.along * reach, axes.along * (2.0 * reach),
                 axes.across * reach);
}

Scene strip_chart(const SimulationSpec& shot, Length depth, Length width) {
  const EdgeAxes axes;
  const double reach = reach_at(shot, depth.si());
  return glowing(
      Vec3{0.0, 0.0, -depth.si()} - axes.along * reach - axes.across * (0.5 * width.si()),
      axes.along * (2.0 * reach), axes.across * width.si());
}

Scene wall_chart(const SimulationSpec& shot, Length depth) {
  const double reach = reach_at(shot, depth.si());
  return glowing({-reach, -reach, -depth.si()}, {2.0 * reach, 0.0, 0.0}, {0.0, 2.0 * reach, 0.0});
}

Scene point_chart(Length depth, Length side) {
  const double half = 0.5 * side.si();
  return glowing({-half, -half, -depth.si()}, {side.si(), 0.0, 0.0}, {0.0, side.si(), 0.0});
}

}  // namespace fstop
