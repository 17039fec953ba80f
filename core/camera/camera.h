#pragma once

#include <variant>

#include "core/camera/camera_spec.h"
#include "core/camera/pinhole_camera.h"
#include "core/camera/thin_lens_camera.h"

namespace fstop {

/// The closed set of cameras: visited once per tile, not per ray.
using Camera = std::variant<PinholeCamera, ThinLensCamera>;

/// The camera of `spec` with its pupil of finite size.
/// Throws: Error{outside_domain} as the cameras' constructors and sensor_of.
Camera camera_of(const CameraSpec& spec, const Sensor& sensor);

/// The centre of projection alone: same image distance, no pupil. What `pinhole` renders and
/// what depth and circle-of-confusion layers refer to.
PinholeCamera central_projection(const CameraSpec& spec, const Sensor& sensor);

/// The outline of the pupil; a disc for a pinhole.
Aperture aperture_of(const CameraSpec& spec);

}  // namespace fstop
