#pragma once

#include <vector>

#include "core/film/image.h"

namespace fstop {

enum class HalftoneMethod {
  clustered_dot,    ///< ordered dither: lit pixels of a cell hang together
  dispersed_dot,    ///< ordered dither: lit pixels of a cell lie as far apart as they can
  varying_dot,      ///< round dots whose size is the tone, on a screen of any size and angle
  error_diffusion,  ///< each pixel's error goes to the neighbours that come after it
};

/// How a picture is made of the few levels that a device can show.
struct HalftoneSpec {
  HalftoneMethod method = HalftoneMethod::clustered_dot;
  double cell = 4.0;       // pixels from dot to dot; whole but for varying_dot
  double angle = 0.0;      // radians, from +x towards +y: the screen of varying_dot
  int levels = 2;          // k >= 2, evenly spaced from 0 to 1 in linear light
  bool symmetric = false;  // clustered_dot: pixels at one distance from the centre light together
  bool patterns = false;   // ordered dither: every pixel becomes a cell of its own
  bool gray = false;       // of the luminance, not of each channel
};

inline constexpr int kLargestCell = 16;

/// The order in which the pixels of an n x n cell are lit as the tone rises, row by row, 0 first.
///
/// Clustered: n = 2 and 3 after Foley et al.; others by growing distance from the centre, pixels
/// of one distance clockwise from the left, which at n = 4 is Ulichney's spiral. One pixel comes
/// after another, so that only a closed ring is symmetric: patterns that are their own mirror
/// images run together into streaks. Symmetric cells give pixels of one distance the same rank,
/// and have fewer levels.
/// Dispersed: n = 2^a or 3 2^a, by Bayer's recursion D(2n) = 4 D(n) + D(2) for each quarter, from
/// the cell of 2 or of 3.
/// Throws: Error{outside_domain} for other n, or n outside 2 to kLargestCell.
/// Source: Foley, van Dam, Feiner & Hughes 1990, 13.1.2; Ulichney 1987; Bayer 1973.
std::vector<int> clustered_order(int n);
std::vector<double> symmetric_order(int n);
std::vector<int> dispersed_order(int n);
bool has_dispersed_order(int n) noexcept;

/// The threshold that a pixel's tone must exceed to be lit, in (0, 1): one function for all methods
/// that look at one pixel alone. Over a cell the thresholds are spread evenly, so that a tone t
/// lights the share t of the pixels: exactly round(t n^2) of an n x n cell, in n^2 + 1 levels.
/// Round dots are bright as cos 2 pi u + cos 2 pi v about their centres; how bright pixels are is
/// ranked over the pixels themselves, so that a screen in step with them keeps its tone as a cell
/// does.
class HalftoneScreen {
 public:
  /// Throws: Error{outside_domain} for error_diffusion, which is no threshold, and for cells
  ///         outside 2 to kLargestCell pixels.
  explicit HalftoneScreen(const HalftoneSpec& spec);

  double threshold(int x, int y) const noexcept;

 private:
  struct DotThreshold {
    double brightness = 0.0;
    double threshold = 0.0;  // share of the pixels that are brighter, half of those alike with them
  };
  void rank_dots();
  double brightness_of_dots(int x, int y) const noexcept;
  double threshold_of_dots(int x, int y) const noexcept;

  int side_ = 0;                         // of `cell_`; 0: round dots
  std::vector<double> cell_ = {};        // thresholds, row by row
  std::vector<DotThreshold> dots_ = {};  // round dots, the brightest first
  double across_ = 0.0;                  // round dots: cells a pixel to the right, along the screen
  double down_ = 0.0;
};

/// `color` (1 or 3 channels, linear, clipped to [0,1], NaN is 0) in `spec.levels` levels: of level
/// j = floor(t (k-1)) and the next one, whichever the screen's threshold at the pixel says for the
/// rest. As large as `color`; with `patterns`, `cell` times as wide and high.
/// Error diffusion: Floyd & Steinberg's weights 7, 3, 5, 1 of 16, rows in alternating directions.
/// Throws: Error{outside_domain} for a spec that cannot be (see HalftoneScreen), fewer than 2 or
///         more than 256 levels, patterns of a method without cells.
/// Source: Floyd & Steinberg 1976; Ulichney 1987 (serpentine order).
Image halftone(const Image& color, const HalftoneSpec& spec);

}  // namespace fstop
