#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/camera/camera_spec.h"

namespace fstop {

/// What a camera does to one object distance.
struct ObjectPlane {
  Length object_distance = {};
  Length image_distance = {};  // of a pinhole: its screen's
  Length blur_diameter = {};   // on the sensor, signed, near negative
  double blur_px = 0.0;
};

/// The closed-form numbers of a camera.
struct OpticalSummary {
  Length image_distance = {};  // pupil to sensor
  double magnification = 0.0;  // of the focused plane, negative; 0 for a pinhole
  Length near = {};            // a pinhole's blur never vanishes: near = far = infinity
  Length far = {};
  Length hyperfocal = {};
  Length coc_limit = {};
  double working_f_number = 0.0;
  Length airy_diameter = {};
  std::array<double, 2> view_angle = {};  // radians, horizontal and vertical
  double focal_px = 0.0;                  // intrinsics: image distance in pixels
  Vec2 principal_point = {};              // raster
  double illuminance_on_axis = 0.0;       // over pi L, flat disc pupil, exact
  double illuminance_at_corner = 0.0;
  std::vector<ObjectPlane> at = {};
};

/// `coc_limit` absent: the sensor's diagonal / 1442. A pinhole's near limit is where its
/// geometric spot reaches the limit, far infinity (both infinite where the hole is larger).
/// Throws: Error{outside_domain} as the formulas it calls.
OpticalSummary optical_summary(const CameraSpec& camera, const Sensor& sensor,
                               std::optional<Length> coc_limit,
                               const std::vector<Length>& object_distances);

}  // namespace fstop
