#include "core/camera/camera.h"

namespace fstop {
namespace {

Pose pose_of(const CameraSpec& spec) {
  return Pose::looking_at(spec.position, spec.look_at, spec.up);
}

}  // namespace

Camera camera_of(const CameraSpec& spec, const Sensor& sensor) {
  if (const auto* pinhole = std::get_if<PinholeSpec>(&spec.optics)) {
    return PinholeCamera(pinhole->image_distance, pinhole->diameter, sensor, pose_of(spec));
  }
  const auto& lens = std::get<LensSpec>(spec.optics);
  return ThinLensCamera(lens.lens, lens.focus_distance, sensor_distance(spec), sensor,
                        pose_of(spec));
}

PinholeCamera central_projection(const CameraSpec& spec, const Sensor& sensor) {
  return PinholeCamera(sensor_distance(spec), Length{}, sensor, pose_of(spec));
}

Aperture aperture_of(const CameraSpec& spec) {
  const auto* lens = std::get_if<LensSpec>(&spec.optics);
  return lens != nullptr ? lens->aperture : Aperture{};
}

}  // namespace fstop
