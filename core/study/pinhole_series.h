#pragma once

#include <array>
#include <numbers>
#include <vector>

#include "core/film/image.h"
#include "core/measure/slanted_edge.h"
#include "core/measure/star_contrast.h"
#include "core/render/simulation.h"

namespace fstop {

/// A point of the screen, from its centre, in the upright picture.
struct ScreenPoint {
  Length x = {};  // right
  Length y = {};  // up
};

/// What of a flat target is measured; lengths on the screen at `image_distance`, where the target
/// of core/scenes/pinhole-series has them.
struct PinholeTarget {
  Length distance = Length::si(1.9998);
  Length image_distance = Length::si(0.050);
  ScreenPoint edge = {Length::si(4.2183e-3), Length::si(-1.6183e-3)};  // its middle
  Length edge_reach = Length::si(3.4e-3);  // free on both sides, across a nearly upright edge
  Length edge_half_length = Length::si(3.2e-3);
  double edge_slant = 5.0 * std::numbers::pi / 180.0;  // of its normal, anticlockwise from +x
  EdgeLevels edge_levels = {.dark = 0.05, .bright = 0.8};
  ScreenPoint star = {Length::si(-7.2e-3), Length::si(-1.2e-3)};
  Length star_radius = Length::si(6.2e-3);
  int star_cycles = 16;
  double star_mean = 0.425;
  double star_amplitude = 0.375;
};

/// One target through many holes.
struct PinholeSeriesSpec {
  SimulationSpec shot = {};  // camera.optics apart, which each hole replaces
  std::vector<Length> diameters = {};
  PinholeTarget target = {};
};

/// Resolution by two measures, in cycles per length on the screen.
struct PinholeResolution {
  Vergence mtf50 = {};  // where a slanted edge's contrast has fallen to 50 %
  Vergence mtf10 = {};  // where the star's has fallen to 10 %
};

/// One hole: its picture, what was measured in it and what theory says.
struct PinholePicture {
  Length diameter = {};
  double fresnel_number = 0.0;                     // at camera.wavelength
  std::array<PinholeResolution, 3> measured = {};  // by channel; 0: the star is blurred throughout
  std::array<PinholeResolution, 3> theory = {};
  Photograph photograph = {};
};

/// Resolution of a hole in the picture of `shot`: wave optics of the channel's band (or of
/// camera.wavelength where camera.monochromatic) times the pixel's box, at the places of edge and
/// star off axis; the star's as the mean over all directions.
/// Throws: Error{outside_domain} as ChannelOtf.
PinholeResolution theoretical_resolution(const PinholeSeriesSpec& spec, Length diameter,
                                         int channel);

/// Photographs the target through every hole and measures edge and star in all channels.
/// Throws: as simulate, measured_slanted_edge and star_contrast.
std::vector<PinholePicture> pinhole_series(const PinholeSeriesSpec& spec, const RayScene& scene,
                                           const RunControl& run);

/// The measured part alone, of a finished picture of the target. `blur`: the point spread's width,
/// which keeps that far from the star's rim.
PinholeResolution measured_resolution(const Image& picture, const PinholeSeriesSpec& spec,
                                      int channel, Length blur);

}  // namespace fstop
