#include "core/study/pinhole_series.h"

#include <algorithm>
#include <cmath>

#include "core/optics/pinhole.h"
#include "core/study/pinhole_theory.h"

namespace fstop {
namespace {

Length pitch_of(const SimulationSpec& shot) { return shot.camera.sensor_width / shot.width; }

Length image_distance_of(const PinholeSeriesSpec& spec) { return spec.target.image_distance; }

// Raster point of a point on the screen.
Vec2 raster_point(const SimulationSpec& shot, const ScreenPoint& point) {
  const Length pitch = pitch_of(shot);
  return {0.5 * shot.width + point.x / pitch, 0.5 * shot.height - point.y / pitch};
}

PixelRegion edge_region(const PinholeSeriesSpec& spec) {
  const Vec2 middle = raster_point(spec.shot, spec.target.edge);
  const double reach = spec.target.edge_reach / pitch_of(spec.shot);
  const double half = spec.target.edge_half_length / pitch_of(spec.shot);
  const int left = static_cast<int>(std::ceil(middle.x - reach));
  const int top = static_cast<int>(std::ceil(middle.y - half));
  return {.x = left,
          .y = top,
          .width = static_cast<int>(std::floor(middle.x + reach)) - left,
          .height = static_cast<int>(std::floor(middle.y + half)) - top};
}

// From the rim inwards until the contrast is gone: the lowest frequency of 10 %.
Vergence star_resolution(ImageView<const float> picture, const PinholeSeriesSpec& spec, int channel,
                         Length blur) {
  constexpr double kContrast = 0.1;
  constexpr double kStep = 0.25;  // px
  const PinholeTarget& target = spec.target;
  const Length pitch = pitch_of(spec.shot);
  const SinusoidalStar star{.centre = raster_point(spec.shot, target.star),
                            .cycles = target.star_cycles,
                            .mean = target.star_mean,
                            .amplitude = target.star_amplitude};
  StarContrast outer;
  for (double radius = (target.star_radius - 0.5 * blur) / pitch - 1.0;; radius -= kStep) {
    if (star.cycles > 3.0 * radius) return {};  // finer than the pixels show
    const StarContrast ring = star_contrast(picture, channel, star, radius);
    if (ring.modulation <= kContrast) {
      if (outer.frequency == 0.0) return {};  // blurred throughout
      const double share = (outer.modulation - kContrast) / (outer.modulation - ring.modulation);
      return (outer.frequency + share * (ring.frequency - outer.frequency)) / pitch;
    }
    outer = ring;
  }
}

// Wide enough for the disc of rays and for Airy's.
Length blur_of(const PinholeSeriesSpec& spec, Length diameter) {
  const Length wavelength = spec.shot.camera.wavelength;
  return geometric_spot_diameter(diameter, image_distance_of(spec), spec.target.distance) +
         airy_diameter(wavelength, image_distance_of(spec) / diameter);
}

SimulationSpec shot_through(const PinholeSeriesSpec& spec, Length diameter) {
  SimulationSpec shot = spec.shot;
  shot.camera.optics = PinholeSpec{.image_distance = image_distance_of(spec), .diameter = diameter};
  return shot;
}

}  // namespace

PinholeResolution theoretical_resolution(const PinholeSeriesSpec& spec, Length diameter,
                                         int channel) {
  const CameraSpec& camera = spec.shot.camera;
  ChannelLight light{.channel = channel};
  if (camera.monochromatic) light.wavelength = camera.wavelength;
  const CircularPupil pupil =
      pinhole_pupil(diameter, image_distance_of(spec), spec.target.distance);
  const auto otf_at = [&](const ScreenPoint& point) {
    const Vec2 field{point.x / image_distance_of(spec), -(point.y / image_distance_of(spec))};
    return ChannelOtf(pupil, light, pitch_of(spec.shot), field);
  };
  const Vec2 across{std::cos(spec.target.edge_slant), -std::sin(spec.target.edge_slant)};
  return {.mtf50 = otf_at(spec.target.edge).frequency_of_contrast(0.5, across),
          .mtf10 = otf_at(spec.target.star).mean_frequency_of_contrast(0.1)};
}

PinholeResolution measured_resolution(const Image& picture, const PinholeSeriesSpec& spec,
                                      int channel, Length blur) {
  const SlantedEdge edge = measured_slanted_edge(
      picture.view(),
      {.region = edge_region(spec), .channel = channel, .levels = spec.target.edge_levels});
  return {.mtf50 = edge.mtf50 / pitch_of(spec.shot),
          .mtf10 = star_resolution(picture.view(), spec, channel, blur)};
}

std::vector<PinholePicture> pinhole_series(const PinholeSeriesSpec& spec, const RayScene& scene,
                                           const RunControl& run) {
  std::vector<PinholePicture> series;
  for (const Length diameter : spec.diameters) {
    PinholePicture picture{.diameter = diameter};
    picture.fresnel_number = fresnel_number(diameter, image_distance_of(spec),
                                            spec.shot.camera.wavelength, spec.target.distance);
    picture.photograph = simulate(shot_through(spec, diameter), scene, run);
    for (int c = 0; c < 3; ++c) {
      const auto k = static_cast<std::size_t>(c);
      picture.measured[k] =
          measured_resolution(picture.photograph.color, spec, c, blur_of(spec, diameter));
      picture.theory[k] = theoretical_resolution(spec, diameter, c);
    }
    series.push_back(std::move(picture));
  }
  return series;
}

}  // namespace fstop
