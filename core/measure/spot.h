#pragma once

#include <optional>
#include <vector>

#include "core/film/image.h"
#include "core/measure/slanted_edge.h"

namespace fstop {

/// Which spot is to be measured: the image of a small bright source on an even background.
struct SpotSpec {
  PixelRegion region = {};  // holds all of the spot and nothing else
  int channel = 0;          // of the interleaved ones
  /// What every pixel has beside the spot; absent: the mean of the region's outermost pixels.
  std::optional<double> background = {};
  double source_diameter = 0.0;        // px: of the source's own sharp image, a disc
  int blades = 0;                      // of the iris that shapes the spot; 0: a disc
  std::vector<double> fractions = {};  // of the energy, each between 0 and 1
};

/// What a spot says of the blur that made it. A spot is a point's blur, spread over the source's
/// disc and the pixel's square: their second moments add.
struct Spot {
  double background = 0.0;
  double energy = 0.0;       // sum over the region's pixels, background taken off
  Vec2 centroid = {};        // raster px
  double mean_square = 0.0;  // px^2 from the centroid: the blur's own, source and pixel taken off
  /// px: of the uniform disc with that mean square, d = sqrt(8 mean_square); of an iris with n
  /// blades the disc of the polygon's area, mean square R^2 (2 + cos(2 pi/n))/6 by its
  /// circumradius.
  double disc_diameter = 0.0;
  /// px: of the circles around the centroid that hold the fractions of the energy, as they are in
  /// the picture: with source and pixel.
  std::vector<double> encircled_diameters = {};
};

/// Valid: the sum over pixels is the integral but for 0.182/sqrt(d) px^2 of a disc of d px:
///        1.3 % of its diameter at 5 px, 0.23 % at 10 px, 0.01 % at 40 px (spot_test.cpp). Moments
///        weigh light by its squared distance, so the region must hold all of the spot and noise
///        must be low; of waves, whose rings go on for ever, the moments grow with the region,
///        while encircled diameters hold. A pixel's light counts as even over its square.
/// Throws: Error{outside_domain} unless the region lies inside the image, is at least 3 px wide
///         and high, the channel exists, values are finite, blades is 0 or at least 3, fractions
///         lie between 0 and 1, there is light, and the spot is wider than source and pixel.
Spot measured_spot(ImageView<const float> image, const SpotSpec& spec);

}  // namespace fstop
