#pragma once

#include <vector>

#include "core/film/image.h"
#include "core/optics/aperture.h"
#include "core/parallel.h"

namespace fstop {

/// A picture seen through the centre of projection, `margin` pixels wider on every side than the
/// blurred one that it is for.
struct SharpPicture {
  Image color = {};  // 3 channels, linear
  Image coc = {};    // 1 channel: signed blur diameter in pixels, near negative
  int margin = 0;
};

/// Where a blurred pixel looks, as seen from it, and how far that is in the pupil's outline: the
/// radius of the smallest blur disc (or polygon of its area) from there that reaches the pixel.
struct GatherTap {
  int x = 0;
  int y = 0;
  float near = 0.0F;   // for light from in front of the focused plane, whose outline is turned
  float far = 0.0F;    // for light from behind it
  float round = 0.0F;  // for small discs, which are round whatever the outline
  float area = 1.0F;   // pixels that the tap stands for
};

/// Taps for discs of up to `radius` pixels, nearest first: every pixel up to 16 pixels away, beyond
/// one of each cell whose side is at most an eighth of its distance, always the same one.
std::vector<GatherTap> gather_taps(const Aperture& aperture, double radius);

/// Pixels that discs of `blur_px` diameter reach at most.
int gather_margin(const Aperture& aperture, double blur_px);

/// Blurs a picture by its depth. Every pixel of `sharp` spreads its light evenly over its own disc;
/// a pixel of the result is the mean of the light that reaches it, weighted by what each disc gives
/// to a pixel. Light from behind what the pixel shows spreads at most as far as the pixel's own
/// disc, so that a blurred background does not run over a sharp foreground. Discs have soft edges
/// one pixel wide, and the second moment of the true disc; polygons of less than 3 px are replaced
/// by discs with their second moment.
///
/// Exact, but for sampling, where all depths in reach are equal. What the sharp picture does not
/// show, light from behind a blurred foreground, is replaced by what it does.
/// **Source**: Potmesil & Chakravarty 1981 (a picture blurred by discs as wide as its depths say);
/// Demers, GPU Gems 1 (2004), ch. 23, surveys discs gathered instead of scattered.
/// Throws: Error{cancelled}.
Image gathered(const SharpPicture& sharp, const Aperture& aperture, const RunControl& run);

}  // namespace fstop
