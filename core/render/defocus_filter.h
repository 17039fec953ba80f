#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/film/replicate_film.h"
#include "core/parallel.h"

namespace fstop {

/// How samples of neighbouring pixels are shared where everything is out of focus.
struct FilterKind {
  bool keeps_parabolas = true;  // Savitzky-Golay weights; else the plain mean
  double share = 0.0;           // of the smallest blur diameter around: the window's half width
};

/// A mean over windows that follows the defocus: where all that a neighbourhood's samples have met
/// is blurred by at least c pixels, the picture changes slowly over a fraction of c, and nearby
/// pixels tell of each other. The half width is floor(share c), one for each tile of 8 x 8 pixels,
/// c being the smallest blur diameter of any sample in 3 x 3 tiles; 0 where something is sharp,
/// mirrors or transmits, or where light is brighter than a pixel shows. One filter for whole
/// pixels: nothing is separated by depth.
///
/// Where light of different depths hides each other the picture may change faster than c tells:
/// the filter then has a bias, which `FilterCertificate` measures.
///
/// Source: the bandwidth of defocused light, Soler et al. 2009; weights: Savitzky & Golay 1964.
class DefocusFilter {
 public:
  static constexpr int kTileSide = 8;
  static constexpr int kLargestRadius = 8;

  /// `a`, `b`: the film's replicates; `blur_px`: blur diameter in pixels of a vergence of 1/metre
  /// beside the focus.
  DefocusFilter(const ReplicateFilm& film, const Image& a, const Image& b, double blur_px,
                const FilterKind& kind, const RunControl& run = {});

  bool does_something() const noexcept { return filters_; }
  int columns() const noexcept { return columns_; }
  int rows() const noexcept { return rows_; }
  /// Half width of the windows of a tile, pixels; 0: untouched.
  int radius(int column, int row) const noexcept {
    return radii_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(column)];
  }

  /// The filtered picture, 3 channels; the borders mirror it.
  Image applied(const Image& picture, const RunControl& run) const;

  /// Its tile at (column, row), channels interleaved; what sticks out of the picture is
  /// unspecified.
  struct alignas(64) Tile {
    std::array<std::array<float, 3 * kTileSide>, kTileSide> rows;
  };
  void filter_tile(const Image& picture, int column, int row, Tile& result) const noexcept;

 private:
  int columns_;
  int rows_;
  bool filters_ = false;
  FilterKind kind_;
  std::vector<std::uint8_t> radii_;
};

/// What a filtered picture's error is, bias included.
struct FilterCertificate {
  double variance = 0.0;  // mean square over pixels and channels
  double bias_squared = 0.0;
  double mse = 0.0;           // their sum
  double mse_upper_95 = 0.0;  // one-sided
  /// By half width: variance left of the unfiltered picture's.
  std::array<double, DefocusFilter::kLargestRadius + 1> gain = {};
};

/// From independent unbiased replicates A, B of a picture P and a linear filter F:
///
///     E (FA - FB)^2/4 = variance of (FA + FB)/2,   E (FA - A)(FB - B) = (FP - P)^2
///
/// so that both parts are estimated without bias, however wrong the filter is. Values are clipped
/// to [0,1] for the variance. The bound takes areas of 16 x 16 pixels as units and doubles their
/// scatter for what neighbours share. Only one row of units in `every` is looked at.
FilterCertificate filter_certificate(const DefocusFilter& filter, const Image& a, const Image& b,
                                     int every = 1, const RunControl& run = {});

/// The same by tiles of kErrorTile pixels a side, 3 channels, not clipped: every pixel has its
/// tile's expected square of the error, at least 0.
Image error_tiles(const Image& a, const Image& b, const Image& filtered_a, const Image& filtered_b);

}  // namespace fstop
