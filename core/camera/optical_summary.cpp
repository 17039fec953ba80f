#include "core/camera/optical_summary.h"

#include <cmath>

#include "core/error.h"
#include "core/optics/depth_of_field.h"
#include "core/optics/exposure.h"
#include "core/optics/pinhole.h"

namespace fstop {
namespace {

// The usual full-frame 0.03 mm is the diagonal, 43.27 mm, over 1442.
constexpr double kDiagonalOverCoc = 1442.0;

DepthOfField sharp_range(const CameraSpec& camera, Length coc_limit) {
  if (const auto* lens = std::get_if<LensSpec>(&camera.optics)) {
    return depth_of_field(lens->lens, lens->focus_distance, coc_limit);
  }
  // D (1 + f'/u) = c  at  u = f' D/(c - D): sharp from there to infinity, never if D >= c.
  const auto& pinhole = std::get<PinholeSpec>(camera.optics);
  const Length margin = coc_limit - pinhole.diameter;
  if (!(margin > Length{})) return {.near = kInfinitelyFar, .far = kInfinitelyFar};
  return {.near = pinhole.image_distance * (pinhole.diameter / margin), .far = kInfinitelyFar};
}

ObjectPlane object_plane(const CameraSpec& camera, const Sensor& sensor, Length distance) {
  ObjectPlane plane{.object_distance = distance,
                    .image_distance = sensor_distance(camera),
                    .blur_diameter = blur_diameter(camera, distance)};
  if (const auto* lens = std::get_if<LensSpec>(&camera.optics)) {
    plane.image_distance = image_distance(lens->lens.focal_length, distance);
  }
  plane.blur_px = plane.blur_diameter / sensor.pixel_pitch;
  return plane;
}

}  // namespace

OpticalSummary optical_summary(const CameraSpec& camera, const Sensor& sensor,
                               std::optional<Length> coc_limit,
                               const std::vector<Length>& object_distances) {
  OpticalSummary summary;
  const Length diagonal =
      Length::si(std::hypot(camera.sensor_width.si(), camera.sensor_height.si()));
  summary.coc_limit = coc_limit.value_or(diagonal / kDiagonalOverCoc);
  summary.image_distance = sensor_distance(camera);
  if (const auto* lens = std::get_if<LensSpec>(&camera.optics)) {
    summary.magnification = magnification(lens->lens.focal_length, lens->focus_distance);
    summary.hyperfocal = hyperfocal_distance(lens->lens, summary.coc_limit);
  }
  const DepthOfField range = sharp_range(camera, summary.coc_limit);
  summary.near = range.near;
  summary.far = range.far;
  if (std::holds_alternative<PinholeSpec>(camera.optics)) summary.hyperfocal = range.near;
  summary.working_f_number = working_f_number(camera);
  summary.airy_diameter = airy_diameter(camera.wavelength, summary.working_f_number);
  summary.view_angle = {view_angle(camera.sensor_width, summary.image_distance),
                        view_angle(camera.sensor_height, summary.image_distance)};
  summary.focal_px = summary.image_distance / sensor.pixel_pitch;
  summary.principal_point = sensor.centre();
  summary.illuminance_on_axis = relative_illuminance_on_axis(summary.working_f_number);
  summary.illuminance_at_corner =
      relative_illuminance(summary.working_f_number, diagonal / 2.0, summary.image_distance);
  for (const Length distance : object_distances) {
    summary.at.push_back(object_plane(camera, sensor, distance));
  }
  return summary;
}

}  // namespace fstop
