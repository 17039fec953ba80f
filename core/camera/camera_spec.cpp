#include "core/camera/camera_spec.h"

#include <cmath>

#include "core/error.h"
#include "core/optics/pinhole.h"

namespace fstop {

Length sensor_distance(const CameraSpec& camera) {
  if (const auto* pinhole = std::get_if<PinholeSpec>(&camera.optics))
    return pinhole->image_distance;
  const auto& spec = std::get<LensSpec>(camera.optics);
  // Asked for even where the sensor stays at f: a lens that cannot focus there is refused.
  magnification(spec.lens.focal_length, spec.focus_distance);
  return camera.breathing ? image_distance(spec.lens.focal_length, spec.focus_distance)
                          : spec.lens.focal_length;
}

Length pupil_diameter(const CameraSpec& camera) {
  if (const auto* pinhole = std::get_if<PinholeSpec>(&camera.optics)) return pinhole->diameter;
  return aperture_diameter(std::get<LensSpec>(camera.optics).lens);
}

double working_f_number(const CameraSpec& camera) {
  if (const auto* pinhole = std::get_if<PinholeSpec>(&camera.optics)) {
    return pinhole->image_distance / pinhole->diameter;
  }
  const auto& spec = std::get<LensSpec>(camera.optics);
  return working_f_number(spec.lens, spec.focus_distance);
}

Length blur_diameter(const CameraSpec& camera, Length object_distance) {
  if (const auto* pinhole = std::get_if<PinholeSpec>(&camera.optics)) {
    return geometric_spot_diameter(pinhole->diameter, pinhole->image_distance, object_distance);
  }
  const auto& spec = std::get<LensSpec>(camera.optics);
  return signed_circle_of_confusion(spec.lens, spec.focus_distance, object_distance,
                                    sensor_distance(camera));
}

Sensor sensor_of(const CameraSpec& camera, int width, int height) {
  const Length pitch = camera.sensor_width / width;
  const double aspect = (camera.sensor_height / height) / pitch;
  // A whole number of pixels cannot match every ratio: a thousandth of a pixel over the image.
  if (!(std::abs(aspect - 1.0) * std::max(width, height) <= 1e-3)) {
    throw Error(ErrorCode::outside_domain,
                "needs square pixels: width/height must equal the sensor's");
  }
  return {.pixel_pitch = pitch, .width = width, .height = height};
}

}  // namespace fstop
