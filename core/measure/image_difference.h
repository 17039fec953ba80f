#pragma once

#include "core/film/image.h"

namespace fstop {

/// How far a picture is from a reference, over all pixels and channels, linear values.
struct ImageDifference {
  double rmse = 0.0;          // root mean square of the differences as they are
  double rmse_clipped = 0.0;  // of values clipped to [0, 1] first: what max_error counts
  double rel_mse = 0.0;       // mean of (x - ref)^2 / (ref^2 + 0.01)
  double largest = 0.0;       // largest absolute difference, unclipped
  int largest_x = 0;          // the pixel that has it
  int largest_y = 0;
  double psnr = 0.0;  // dB, -20 log10(rmse_clipped); infinity for equal pictures
};

/// Throws: Error{outside_domain} unless both have the same width, height and channels, at least
///         one value, and all values finite.
ImageDifference image_difference(ImageView<const float> image, ImageView<const float> reference);

}  // namespace fstop
