#include "core/study/expected_optics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;

struct LensNumbers {
  double f = 0.0;  // metres
  double pupil = 0.0;
  double s = 0.0;
  double v = 0.0;       // image of the focused plane
  double sensor = 0.0;  // where the sensor stands
};

LensNumbers lens_of(const CameraSpec& camera) {
  const auto* lens = std::get_if<LensSpec>(&camera.optics);
  if (lens == nullptr)
    throw Error(ErrorCode::outside_domain, "this check needs a camera with a lens");
  LensNumbers numbers{.f = lens->lens.focal_length.si(), .s = lens->focus_distance.si()};
  numbers.pupil = numbers.f / lens->lens.f_number;
  // f/(1 - f/s): finite for a lens focused at infinity.
  numbers.v = numbers.f / (1.0 - numbers.f / numbers.s);
  numbers.sensor = camera.breathing ? numbers.v : numbers.f;
  return numbers;
}

// Object distance of the image at v: f v/(v - f); beyond infinity there is none.
Length object_of(double f, double v) {
  return v > f ? Length::si(f * v / (v - f)) : kInfinitelyFar;
}

}  // namespace

Length expected_blur_diameter(const CameraSpec& camera, Length object_distance) {
  const LensNumbers lens = lens_of(camera);
  const double d = object_distance.si();
  // Of the cone from the pupil to the image at f d/(d - f), cut at v: A |1 - v/image|.
  const double cut = std::isinf(d) ? lens.v / lens.f : lens.v * (d - lens.f) / (lens.f * d);
  return Length::si(lens.pupil * std::abs(1.0 - cut) * lens.sensor / lens.v);
}

ExpectedDepthOfField expected_depth_of_field(const CameraSpec& camera, Length coc_limit) {
  const LensNumbers lens = lens_of(camera);
  // On a sensor at another distance the same cone is cut in proportion.
  const double share = coc_limit.si() * lens.v / (lens.sensor * lens.pupil);
  if (!(share > 0.0 && share < 1.0))
    throw Error(ErrorCode::outside_domain, "coc_limit must lie between 0 and the pupil's diameter");
  return {.near = object_of(lens.f, lens.v / (1.0 - share)),
          .far = object_of(lens.f, lens.v / (1.0 + share))};
}

double expected_magnification(const CameraSpec& camera) {
  const LensNumbers lens = lens_of(camera);
  return camera.breathing ? lens.f / (lens.s - lens.f) : lens.f / lens.s;
}

double expected_exposure(const CameraSpec& camera) {
  const LensNumbers lens = lens_of(camera);
  if (!camera.exposure)
    throw Error(ErrorCode::outside_domain, "this check needs a camera with ISO exposure");
  const double working = lens.v / lens.pupil;
  return 80.0 * camera.shutter_seconds * camera.exposure->iso / (working * working);
}

TransferFunction disc_transfer(Length diameter) {
  return [c = diameter.si()](double nu) {
    const double x = kPi * std::abs(nu) * c;
    return x < 1e-6 ? 1.0 : 2.0 * std::cyl_bessel_j(1.0, x) / x;
  };
}

Vergence expected_cut_off(const CameraSpec& camera) {
  const LensNumbers lens = lens_of(camera);
  return Vergence::si(lens.pupil / (camera.wavelength.si() * lens.sensor));
}

TransferFunction diffraction_transfer(const CameraSpec& camera) {
  return [cut_off = expected_cut_off(camera).si()](double nu) {
    const double t = std::abs(nu) / cut_off;
    return t >= 1.0 ? 0.0 : 2.0 / kPi * (std::acos(t) - t * std::sqrt(1.0 - t * t));
  };
}

TransferFunction pinhole_transfer(const CameraSpec& camera, Length object_distance) {
  const auto* hole = std::get_if<PinholeSpec>(&camera.optics);
  if (hole == nullptr)
    throw Error(ErrorCode::outside_domain, "this check needs a camera with a pinhole");
  const double a = 0.5 * hole->diameter.si();
  const double z = hole->image_distance.si();
  const double vergence = 1.0 / z + 1.0 / object_distance.si();
  return [a, z, vergence, lambda = camera.wavelength.si()](double nu) {
    const double half_shift = 0.5 * std::abs(nu) * lambda * z;
    const double end = a - half_shift;
    if (end <= 0.0) return 0.0;
    // The phases k W x^2/2 of pupils 2 h apart differ by 2 pi W x (2 h)/lambda.
    const double turn = 2.0 * kPi * vergence * 2.0 * half_shift / lambda;
    // x = end (1 - t^2) takes the root's end out of the integrand; Simpson's rule in t.
    const int steps = 2 * (64 + static_cast<int>(1.5 * turn * end));
    double sum = 0.0;
    for (int i = 0; i <= steps; ++i) {
      const double t = static_cast<double>(i) / steps;
      const double x = end * (1.0 - t * t);
      const double chord = std::sqrt(std::max(0.0, a * a - (x + half_shift) * (x + half_shift)));
      const double weight = i == 0 || i == steps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
      sum += weight * chord * std::cos(turn * x) * 2.0 * end * t;
    }
    return 4.0 * sum / (3.0 * steps) / (kPi * a * a);
  };
}

Length expected_circumradius(Length blur_diameter, int blades) {
  const double sector = 2.0 * kPi / blades;
  return 0.5 * blur_diameter * std::sqrt(sector / std::sin(sector));
}

}  // namespace fstop
