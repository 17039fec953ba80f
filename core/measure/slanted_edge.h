#pragma once

#include <complex>
#include <optional>
#include <vector>

#include "core/film/image.h"
#include "core/geometry.h"

namespace fstop {

/// Whole pixels of an image; (x, y) is the upper left one.
struct PixelRegion {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// Values far from an edge on either side, blur and neighbours apart.
struct EdgeLevels {
  double dark = 0.0;
  double bright = 0.0;
};

/// Which edge is to be measured.
struct SlantedEdgeSpec {
  PixelRegion region = {};                // holds one straight edge and nothing else
  int channel = 0;                        // of the interleaved ones
  std::optional<EdgeLevels> levels = {};  // what contrast is counted from, where known
};

/// The image of a line across the edge, of unit energy where the levels hold all of it.
struct LineSpread {
  double first = 0.0;                // px from the edge towards the bright side, of density[0]
  double step = 0.0;                 // px
  std::vector<double> density = {};  // 1/px
};

/// The transfer function of a line's image at `frequency` in cycles/px: the Fourier sum
/// step * sum of density_k exp(-2 pi i frequency x_k). Real and signed for symmetrical images.
/// Valid: up to 1 cycle/px, where the profile's splines still pass 0.9998.
std::complex<double> transfer(const LineSpread& line, double frequency) noexcept;

/// The lowest frequency (cycles/px) at which |transfer| has fallen to `contrast`; infinity where
/// it does not up to 1 cycle/px. Throws: Error{outside_domain} unless 0 < contrast < 1.
double frequency_of_contrast(const LineSpread& line, double contrast);

/// What a straight edge in a linear picture says of its sharpness.
struct SlantedEdge {
  Vec2 point = {};               // raster px, where the profile passes half of its contrast
  Vec2 normal = {};              // unit, raster, towards the bright side
  double slant = 0.0;            // radians between the edge and the nearer pixel axis, 0 to pi/4
  EdgeLevels levels = {};        // at the ends of the profile, or as they were given
  double reach = 0.0;            // px: the profile is known this far to both sides
  double noise = 0.0;            // root mean square of what the straight edge does not explain
  double rise_10_90 = 0.0;       // px, of the profile between its levels
  double mtf50 = 0.0;            // cycles/px; infinity where not reached up to 1
  std::vector<double> mtf = {};  // |transfer| at k/100 cycles/px, k = 0 to 100
  LineSpread line_spread = {};
};

/// Measures one edge by the slanted-edge method of ISO 12233: the rows' edges give a line, every
/// pixel its distance from it, and all of them together a profile finer than the pixels.
///
/// Unlike the standard's bins of 1/4 px, the profile is the least-squares cubic spline on knots of
/// 1/4 px: bins average and their differences attenuate, both by a sinc that would have to be
/// divided out; the spline's slope is exact and its response is 1 to 2e-4 up to 1 cycle/px. The
/// line's slope is the one that leaves the smallest residual (Gauss-Newton with the profile
/// projected out), so that no plateau is needed to find it. The line spread is tapered from
/// 2 rises + 4 px on to zero at twice that or at the end of the profile.
///
/// The pixel's own box is part of what is measured: along the normal a trapezoid,
/// sinc(nu cos) sinc(nu sin) of the slant.
///
/// Values are linear; slants lie between 2 and 43 degrees: nearer to the axes and the diagonal
/// pixels repeat each other's distances. The MTF of blurs from 0.25 px on holds to 5e-4 up to
/// 1 cycle/px where the distances fill the knots; where tan(slant) is within 0.1 % of 1/2, 1/3,
/// 2/3 or 1/4 they lie 0.447 px and less apart, and it holds to 0.013 up to 0.6 cycles/px.
/// Throws: Error{outside_domain} with the reason: a region outside the image or too small, values
///         that are not finite, no edge, an edge too short for its slant, a slant out of range,
///         contrast too low for the noise, a blur wider than the region.
/// Source: ISO 12233:2017, annex D; Kaufman, BIT 15, 49 (1975) for the projection.
SlantedEdge measured_slanted_edge(ImageView<const float> image, const SlantedEdgeSpec& spec);

}  // namespace fstop
