#pragma once

#include "core/film/image.h"
#include "core/measure/slanted_edge.h"

namespace fstop {

/// Scores that rank pictures of one subject by their focus. None of them is a sharpness: each
/// grows with the subject's contrast and with noise, and none may be compared between subjects.
/// On periodic subjects a blurred image can score above a sharper one (contrast reversal). Where
/// a number in pixels is wanted, measure an edge (slanted_edge.h, disc_edge.h).
enum class SharpnessScore {
  /// Variance of the 3 x 3 Laplacian (4 neighbours). Falls steadily with blur where there is no
  /// noise; counts noise from a disc radius of about 5 to 8 px on (noise 0.5 %), 2 to 3 px (2 %).
  variance_of_laplacian,
  /// Mean of the squared 3 x 3 Sobel gradient, over 64: the squared slope per px of a ramp.
  /// Ranks textures to a radius of 16 to 20 px through 2 % of noise; flat below 0.5 px on an edge.
  tenengrad,
  /// Mean squared difference of pixels two apart in a row, over 4. As Tenengrad, and blind to what
  /// changes along columns only.
  brenner
};

/// The score of one channel of a region with linear values, on pixels whose neighbours all lie
/// inside the region. In squared units of the values.
/// Throws: Error{outside_domain} unless the region lies inside the image, is at least 3 px wide
///         and high, the channel exists and the values are finite.
/// Source: Pertuz, Puig & Garcia, Pattern Recognition 46, 1415 (2013); Brenner et al., J.
///         Histochem. Cytochem. 24, 100 (1976).
double sharpness(SharpnessScore score, ImageView<const float> image, int channel,
                 const PixelRegion& region);

}  // namespace fstop
