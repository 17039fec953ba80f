#pragma once

#include <vector>

#include "core/measure/slanted_edge.h"

namespace fstop {

/// A region's values, turned so that the edge runs rather down than across: "across" is x, or y
/// where `transposed`. Pixel centres at half-integers from the region's corner.
struct EdgePixels {
  int across = 0;
  int along = 0;
  bool transposed = false;
  std::vector<double> values = {};  // along rows of across

  double at(int i, int j) const {
    return values[static_cast<std::size_t>(j) * static_cast<std::size_t>(across) +
                  static_cast<std::size_t>(i)];
  }
};

/// The edge at across = crossing + slope (along - along_centre).
struct EdgeLine {
  double crossing = 0.0;
  double slope = 0.0;
  double along_centre = 0.0;
  double sign = 1.0;  // +1 where values rise with `across`

  /// Distance of a pixel centre from the line, positive on the bright side.
  double distance(double across, double along) const noexcept;
};

/// Throws: Error{outside_domain} for a region outside the image, under 16 px a side, a channel
///         that the image does not have, or values that are not finite.
EdgePixels edge_pixels(ImageView<const float> image, const SlantedEdgeSpec& spec);

/// The distances of all pixels from `line`, in the order of pixels.values.
std::vector<double> edge_distances(const EdgePixels& pixels, const EdgeLine& line);

/// How far the profile across `line` is known to both sides, with half of the rows at least.
double edge_reach(const EdgePixels& pixels, const EdgeLine& line) noexcept;

/// A first line: in every row the step that leaves the smallest squares, and a straight line
/// through the steps, weighted with the squares that they explain. Turns `pixels` so that the
/// edge runs down. Throws: Error{outside_domain} where steps explain less than half of the
/// variance: there is no edge.
EdgeLine first_edge_line(EdgePixels& pixels);

/// The line with the slope that leaves the smallest residual of all pixels against one profile on
/// knots of `knot_spacing` px: fine enough for the profile's rise, and no finer, because what turns
/// the line is the profile's slope, which fine knots fill with noise.
/// Throws: Error{outside_domain} where the search does not settle.
EdgeLine refined_edge_line(const EdgePixels& pixels, EdgeLine line, double knot_spacing);

}  // namespace fstop
