#pragma once

#include "core/film/image.h"
#include "core/parallel.h"
#include "core/post/point_spread.h"

namespace fstop {

/// Pixels about the chief ray: it arrives at the raster's centre, (width/2, height/2), which is a
/// pixel's middle where the count is odd and a corner where it is even.
struct PointSpreadRaster {
  int width = 0;
  int height = 0;
  Length pitch = {};
};

struct PointSpreadImage {
  Image density = {};    // 1/m^2, the mean over each pixel's square; one or three channels
  Channels energy = {};  // the share of each channel's light inside the image
};

/// What a sensor of these pixels would see of the point: the density averaged over every pixel's
/// square, y down.
///
/// Round images: a table of the profile (step 0.1 of v, six points), k x k Gauss-Legendre points a
/// pixel, k by the phase that the profile turns through in it: 1e-6 of the peak. Others: the
/// Fourier series of density and pixel, up to the cut-off, with a period of four images or more;
/// what lies beyond half a period returns on the other side. That is the tail there, below 1e-4 of
/// the peak; nothing of the light inside is lost.
/// Throws: Error{outside_domain} unless width, height and pitch are positive; Error{cancelled}.
PointSpreadImage point_spread_image(const PointSpread& spread, const PointSpreadRaster& raster,
                                    const RunControl& run);

/// What that costs, about, in the units of PointSpread::density_cost.
double point_spread_image_cost(const PointSpread& spread, const PointSpreadRaster& raster);

}  // namespace fstop
