#pragma once

#include <optional>
#include <string>
#include <variant>

#include "core/camera/sensor.h"
#include "core/optics/aperture.h"
#include "core/optics/thin_lens.h"

namespace fstop {

/// A focused thin lens behind its iris.
struct LensSpec {
  ThinLens lens = {};
  Length focus_distance = Length::si(2.0);  // from the lens, along the axis; may be kInfinitelyFar
  Aperture aperture = {};
};

/// A round hole before a screen.
struct PinholeSpec {
  Length image_distance = {};
  Length diameter = {};
};

/// ISO exposure; absent in CameraSpec means pixel values are mean radiance.
struct IsoExposure {
  double iso = 100.0;
};

/// A camera as it is asked for: plain values, every one checked by the constructors of camera.h.
struct CameraSpec {
  Vec3 position = {0.0, 0.0, 0.0};  // of the pupil's centre, world, metres
  Vec3 look_at = {0.0, 0.0, -1.0};
  Vec3 up = {0.0, 1.0, 0.0};
  Length sensor_width = Length::si(0.036);
  Length sensor_height = Length::si(0.024);
  std::variant<LensSpec, PinholeSpec> optics = {};
  Length wavelength = Length::si(550e-9);  // what Airy numbers refer to
  bool monochromatic = false;  // all light has `wavelength`; else each channel has its own band
  bool breathing = true;  // lens only: sensor at the image distance of the focused plane, else at f
  double shutter_seconds = 0.0;
  Vec3 velocity = {};  // metres per second, world: what stands still passes by the other way
  std::optional<IsoExposure> exposure = {};
};

/// Distance from the pupil to the sensor: v, or f where the lens does not breathe, or f'.
/// Throws: Error{outside_domain} where the lens cannot focus so close.
Length sensor_distance(const CameraSpec& camera);

/// Diameter of the pupil: f/N, or the hole's.
Length pupil_diameter(const CameraSpec& camera);

/// N_w: N(1+|m|) for a lens, f'/D for a pinhole.
double working_f_number(const CameraSpec& camera);

/// Signed blur diameter on the sensor of a point at `object_distance` (may be kInfinitelyFar);
/// negative in front of the focused plane, positive always for a pinhole's shadow image.
Length blur_diameter(const CameraSpec& camera, Length object_distance);

/// The sensor of `camera` divided into width x height square pixels.
/// Throws: Error{outside_domain} if the pixels are not square: off by over 1/1000 pixel in all.
Sensor sensor_of(const CameraSpec& camera, int width, int height);

}  // namespace fstop
