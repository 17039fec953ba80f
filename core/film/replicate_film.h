#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/film/block.h"
#include "core/film/image.h"
#include "core/film/noise_estimate.h"
#include "core/parallel.h"

namespace fstop {

inline constexpr int kReplicates = 2;
/// Pixels whose error is told together, in squares of this side.
inline constexpr int kErrorTile = 16;

/// Two independent replicates A and B of one picture, sampled block by block, each block of each
/// replicate by as many samples as it needs. The picture is (A + B)/2; the replicates' difference
/// tells its error without bias, however the samples of one replicate depend on each other:
///
///     E (A - B)^2/4 = Var (A + B)/2
///
/// A block's count in one replicate may follow from what the *other* has seen, never from its own
/// samples: then rare bright samples are not diluted by the counts they cause, and means stay
/// unbiased.
class ReplicateFilm {
 public:
  ReplicateFilm(int width, int height) : ReplicateFilm(BlockGrid(width, height)) {}
  explicit ReplicateFilm(BlockGrid grid);

  const BlockGrid& grid() const noexcept { return grid_; }
  std::uint32_t samples(int replicate, std::size_t block) const noexcept {
    return counts_[static_cast<std::size_t>(replicate)][block];
  }

  /// Adds `count` further samples of every pixel of a block. One thread a block and replicate.
  void add(int replicate, std::size_t block, const BlockSums& sums, std::uint32_t count) noexcept;

  /// Light of a replicate beside its samples, 3 channels; replaces what was there.
  void set_extra(int replicate, Image light);
  /// More of it, beside what is there.
  void add_extra(int replicate, const Image& light);

  /// How fast a replicate's block converges by its own samples: V of the law that the mean squared
  /// error, values clipped to [0,1], is V n^-kNetOrder. Negative before a second pass.
  float spread(int replicate, std::size_t block) const noexcept {
    return spreads_[static_cast<std::size_t>(replicate)][block];
  }
  /// Smallest BlockSums::least_defocus of both replicates.
  float least_defocus(std::size_t block) const noexcept {
    return std::min(defocus_[0][block], defocus_[1][block]);
  }

  /// Of scrambled nets, between independent samples' 1 and smooth integrands' 3.
  static constexpr double kNetOrder = 1.25;

  /// With values clipped to [0,1] the mean M is as far from the truth as A and B are from M:
  /// ((A - M)^2 + (B - M)^2)/2, each clipped, which is (A - B)^2/4 inside; clipped A and B alone
  /// would hide what their mean, clipped less, still shows.
  /// Blocks are the independent units: their pixels share pupil points. The bounds add 1.645 sqrt 2
  /// standard errors of the mean over blocks, as the error that was made scatters like the
  /// estimate. Where only one replicate has samples its error counts twice that of the blocks that
  /// both have sampled, which must have been chosen blindly. Without such blocks, or with blocks
  /// that none has sampled, nothing is known: the bound is 1.
  NoiseEstimate noise(const RunControl& run = {}) const;

  /// Whether both replicates have samples everywhere.
  bool is_paired() const noexcept;

  /// (A + B)/2, 3 channels; where one replicate has no samples, the other.
  Image mean(const RunControl& run = {}) const;
  Image replicate(int replicate, const RunControl& run = {}) const;
  /// The same into an image that may be reused.
  void copy_replicate(int replicate, Image& image, const RunControl& run = {}) const;
  /// Mean of (A - B)^2/4 over tiles of kErrorTile pixels a side, 3 channels, every pixel its
  /// tile's.
  Image tile_variance(const RunControl& run = {}) const;

  /// Mean and largest number of samples of a pixel, both replicates together.
  double samples_mean() const;
  int samples_max() const;

 private:
  // Of a block's pixels, per channel and lane; lanes outside the picture hold 0. Single precision:
  // a block is added to a few times, each a rounding of 2^-24, far below any error asked for.
  // Not initialised: a replicate's first samples are written, not added, so that the threads that
  // trace touch the memory first.
  struct alignas(64) Lanes {
    std::array<std::array<float, kBlockPixels>, 3> value;
  };
  struct RowSums;

  // Values of a block in one replicate; 0 without samples.
  void values(std::size_t replicate, std::size_t block, Lanes& values) const noexcept;
  RowSums row_sums(int row) const noexcept;
  RowSums any_row_sums(int row) const noexcept;
  RowSums wide_row_sums(int row) const noexcept;
  void write_mean(std::size_t block, Image& image) const noexcept;
  void write(std::size_t block, const Lanes& values, Image& image) const noexcept;

  BlockGrid grid_;
  std::array<std::unique_ptr<Lanes[]>, kReplicates> sums_;
  std::array<std::vector<std::uint32_t>, kReplicates> counts_;
  std::array<std::vector<float>, kReplicates> spreads_;
  std::array<std::vector<float>, kReplicates> defocus_;
  std::array<Image, kReplicates> extra_ = {};
};

}  // namespace fstop
