#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/scene/lane_colors.h"
#include "core/scene/scene.h"
#include "core/scene/summed_area.h"

namespace fstop {

/// An image ready for lookup: linear RGB with its mip pyramid, four floats a texel.
/// uv (0,0) is the lower left corner; texel centres lie at half-integers.
class Texture {
 public:
  /// Throws: Error{bad_image} for an empty image.
  explicit Texture(const TextureSource& source);

  /// Colour at (u, v), averaged over a square of about `footprint` texels of the full image
  /// (trilinear over the pyramid) where the filter is `mipmap`; exactly that square's mean, of at
  /// least one texel, where it is `summed-area`; one texel of it, by a hash of (u, v), where it is
  /// `stochastic`, so that the mean of many samples is the square's. `bilinear` and `nearest` read
  /// the full image whatever the footprint, `brute-force` is `bilinear`, averaged by the many
  /// samples of a pixel. `anisotropic` is as `mipmap`, of which its user takes several.
  /// Source: Williams 1983 (pyramid); Crow 1984 (summed area); Cook 1986 (stochastic).
  Rgb sample(float u, float v, float footprint) const noexcept;

  /// The same for every lane of a packet; lanes that are not valid get some texel.
  void sample(const LaneMask& valid, const std::array<float, kLanes>& u,
              const std::array<float, kLanes>& v, const std::array<float, kLanes>& footprint,
              LaneColors& colors) const noexcept;

  /// Square root of the number of texels: what a unit square of uv spans on average.
  float texels_per_uv() const noexcept { return texels_per_uv_; }
  /// Texels that a unit of u spans, and one of v.
  float width() const noexcept { return static_cast<float>(levels_.front().width); }
  float height() const noexcept { return static_cast<float>(levels_.front().height); }
  TextureFilter filter() const noexcept { return filter_; }

  std::size_t memory_bytes() const noexcept {
    return texels_.size() * sizeof(Texel) + (sums_ ? sums_->memory_bytes() : 0);
  }

 private:
  // Rows and columns hold one texel more than the image, the next one of a lookup across the
  // border: the four texels of a lookup are two pairs of neighbours in memory.
  struct Level {
    int width = 0;
    int height = 0;
    int stride = 0;         // texels from row to row
    std::size_t first = 0;  // index of its first texel
  };
  // Four floats in one register: the lookups of one texel's channels are one instruction.
  using Texel [[gnu::vector_size(16)]] = float;

  template <bool kWide>
  void sample_lanes(const LaneMask& valid, const std::array<float, kLanes>& u,
                    const std::array<float, kLanes>& v, const std::array<float, kLanes>& footprint,
                    LaneColors& colors) const noexcept;
  void sample_wide(const LaneMask& valid, const std::array<float, kLanes>& u,
                   const std::array<float, kLanes>& v, const std::array<float, kLanes>& footprint,
                   LaneColors& colors) const noexcept;
  Texel bilinear(const Level& level, float u, float v) const noexcept;
  Texel nearest(float u, float v) const noexcept;
  Texel mean_of_square(float u, float v, float side) const noexcept;
  Texel any_of_square(float u, float v, float side) const noexcept;
  void lay_out_levels(int width, int height);
  void begin_row(const Level& level, int y);
  void fill_level(const Level& coarser, const Level& finer);
  void add_border(const Level& level);
  Texel& texel(const Level& level, std::size_t x, std::size_t y) noexcept {
    return texels_[level.first + y * static_cast<std::size_t>(level.stride) + x];
  }
  bool has_pyramid() const noexcept {
    return filter_ == TextureFilter::mipmap || filter_ == TextureFilter::anisotropic;
  }
  int wrapped(int i, int size) const noexcept;

  TextureFilter filter_;
  TextureWrap wrap_;
  std::vector<Level> levels_;
  std::vector<Texel> texels_;
  std::optional<SummedArea> sums_ = {};
  float texels_per_uv_ = 1.0F;
};

}  // namespace fstop
