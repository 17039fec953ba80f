#include "core/film/replicate_film.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/film/square_sums.h"
#include "core/simd.h"

namespace fstop {
namespace {

FSTOP_KERNEL float clipped(float value) {
  return value < 0.0F ? 0.0F : (value > 1.0F ? 1.0F : value);
}

// By halves: short chains of additions, the same on every processor.
FSTOP_KERNEL double total(std::array<float, kBlockPixels> lanes) {
  for (std::size_t half = kBlockPixels / 2; half > 0; half /= 2) {
    for (std::size_t k = 0; k < half; ++k) lanes[k] += lanes[k + half];
  }
  return static_cast<double>(lanes[0]);
}

// n^-kNetOrder: 1/(n n^(1/4)).
double net_error(double samples) {
  static_assert(ReplicateFilm::kNetOrder == 1.25);
  return 1.0 / (samples * std::sqrt(std::sqrt(samples)));
}

}  // namespace

// What a row of blocks adds to the figures of the whole.
struct ReplicateFilm::RowSums {
  SquareSums clipped = {};       // squares by block, values clipped to [0,1]
  SquareSums unclipped = {};     // (A - B)^2/4 by block
  double energy = 0.0;           // (A + B)/2
  double energy_variance = 0.0;  // squares of blocks' (A - B)/2
  double paired = 0.0;           // blocks that both replicates have sampled
  double single = 0.0;           // and that one has
};

ReplicateFilm::ReplicateFilm(BlockGrid grid) : grid_(std::move(grid)) {
  for (std::size_t r = 0; r < kReplicates; ++r) {
    sums_[r] = std::make_unique_for_overwrite<Lanes[]>(grid_.count());
    counts_[r].resize(grid_.count());
    spreads_[r].assign(grid_.count(), -1.0F);
    defocus_[r].assign(grid_.count(), std::numeric_limits<float>::infinity());
  }
}

void ReplicateFilm::add(int replicate, std::size_t block, const BlockSums& sums,
                        std::uint32_t count) noexcept {
  const auto r = static_cast<std::size_t>(replicate);
  Lanes added;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < kBlockPixels; ++k) {
      added.value[c][k] = static_cast<float>(sums.value[c][k]);
    }
  }
  defocus_[r][block] = std::min(defocus_[r][block], sums.least_defocus);
  if (grid_.pixels(block) < kBlockPixels) {
    Lanes inside = {};
    grid_.for_each_pixel(block, [&](std::size_t lane, int, int) {
      for (std::size_t c = 0; c < 3; ++c) inside.value[c][lane] = added.value[c][lane];
    });
    added = inside;
  }
  Lanes& whole = sums_[r][block];
  const std::uint32_t before = counts_[r][block];
  counts_[r][block] += count;
  if (before == 0) {
    whole = added;
    return;
  }
  std::array<float, kBlockPixels> squares = {};
  const float old_scale = 1.0F / static_cast<float>(before);
  const float new_scale = 1.0F / static_cast<float>(count);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < kBlockPixels; ++k) {
      const float change =
          clipped(whole.value[c][k] * old_scale) - clipped(added.value[c][k] * new_scale);
      squares[k] += change * change;
      whole.value[c][k] += added.value[c][k];
    }
  }
  const double expected = net_error(before) + net_error(count);
  spreads_[r][block] = static_cast<float>(total(squares) / (3.0 * grid_.pixels(block) * expected));
}

void ReplicateFilm::set_extra(int replicate, Image light) {
  extra_[static_cast<std::size_t>(replicate)] = std::move(light);
}

void ReplicateFilm::add_extra(int replicate, const Image& light) {
  Image& extra = extra_[static_cast<std::size_t>(replicate)];
  if (extra.empty()) return set_extra(replicate, light);
  for (std::size_t i = 0; i < extra.pixels().size(); ++i) extra.pixels()[i] += light.pixels()[i];
}

FSTOP_KERNEL void ReplicateFilm::values(std::size_t r, std::size_t block,
                                        Lanes& values) const noexcept {
  const std::uint32_t count = counts_[r][block];
  if (count == 0) {  // its extra light would be counted beside the other's
    values = {};
    return;
  }
  const float scale = 1.0F / static_cast<float>(count);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < kBlockPixels; ++k) {
      values.value[c][k] = scale * sums_[r][block].value[c][k];
    }
  }
  if (extra_[r].empty()) return;
  grid_.for_each_pixel(block, [&](std::size_t lane, int x, int y) {
    const float* light = extra_[r].at(x, y);
    for (std::size_t c = 0; c < 3; ++c) values.value[c][lane] += light[c];
  });
}

FSTOP_KERNEL ReplicateFilm::RowSums ReplicateFilm::any_row_sums(int row) const noexcept {
  RowSums sums;
  for (int column = 0; column < grid_.columns; ++column) {
    const std::size_t block = grid_.index(column, row);
    const bool has_a = counts_[0][block] > 0;
    const bool has_b = counts_[1][block] > 0;
    if (!has_a && !has_b) continue;
    Lanes a;
    Lanes b;
    values(0, block, a);
    values(1, block, b);
    if (has_a != has_b) {
      sums.single += 1.0;
      for (const auto& channel : (has_a ? a : b).value) sums.energy += total(channel);
      continue;
    }
    sums.paired += 1.0;
    std::array<float, kBlockPixels> clipped_squares = {};
    std::array<float, kBlockPixels> squares = {};
    std::array<float, kBlockPixels> light = {};
    std::array<float, kBlockPixels> off = {};
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t k = 0; k < kBlockPixels; ++k) {
        const float p = a.value[c][k];
        const float q = b.value[c][k];
        const float half = 0.5F * (p - q);
        const float middle = 0.5F * (p + q);
        const float up = clipped(p) - clipped(middle);
        const float down = clipped(q) - clipped(middle);
        clipped_squares[k] += 0.5F * (up * up + down * down);
        squares[k] += half * half;
        light[k] += middle;
        off[k] += half;
      }
    }
    sums.clipped.add(total(clipped_squares) / 3.0);
    sums.unclipped.add(total(squares) / 3.0);
    sums.energy += total(light);
    const double all_off = total(off);
    sums.energy_variance += all_off * all_off;
  }
  return sums;
}

ReplicateFilm::RowSums ReplicateFilm::row_sums(int row) const noexcept {
  return has_avx512() ? wide_row_sums(row) : any_row_sums(row);
}
FSTOP_AVX512 ReplicateFilm::RowSums ReplicateFilm::wide_row_sums(int row) const noexcept {
  return any_row_sums(row);
}

NoiseEstimate ReplicateFilm::noise(const RunControl& run) const {
  std::vector<RowSums> rows(static_cast<std::size_t>(grid_.rows));
  parallel_for(run, grid_.rows,
               [&](int row) { rows[static_cast<std::size_t>(row)] = row_sums(row); });
  RowSums all;
  for (const RowSums& row : rows) {  // in order: sums never depend on the threads
    all.clipped.add(row.clipped);
    all.unclipped.add(row.unclipped);
    all.energy += row.energy;
    all.energy_variance += row.energy_variance;
    all.paired += row.paired;
    all.single += row.single;
  }
  const auto blocks = static_cast<double>(grid_.count());
  if (all.paired < 1.0 || all.paired + all.single < blocks) {
    return {.mse = 1.0, .mse_upper_95 = 1.0, .unclipped_mse_upper_95 = 1.0, .energy = 1.0};
  }
  // Sums are per block, figures per pixel. One replicate alone has twice the variance of both.
  const double pairs = all.paired;
  const double alone = (pairs + 2.0 * all.single) / blocks;
  const double scale = alone * blocks / (static_cast<double>(grid_.width) * grid_.height);
  const double energy_variance = all.energy_variance * alone * blocks / pairs;
  return {.mse = scale * all.clipped.mean(pairs),
          .mse_upper_95 = scale * all.clipped.upper_95(pairs),
          .unclipped_mse_upper_95 = scale * all.unclipped.upper_95(pairs),
          .energy = all.energy > 0.0 ? std::sqrt(energy_variance) / all.energy : 0.0};
}

bool ReplicateFilm::is_paired() const noexcept {
  const auto sampled = [](std::uint32_t count) { return count > 0; };
  return std::ranges::all_of(counts_[0], sampled) && std::ranges::all_of(counts_[1], sampled);
}

Image ReplicateFilm::replicate(int replicate, const RunControl& run) const {
  Image image;
  copy_replicate(replicate, image, run);
  return image;
}

void ReplicateFilm::copy_replicate(int replicate, Image& image, const RunControl& run) const {
  if (image.width() != grid_.width || image.height() != grid_.height || image.channels() != 3) {
    image = Image(grid_.width, grid_.height, 3);
  }
  parallel_for(run, grid_.rows, [&](int row) {
    for (int column = 0; column < grid_.columns; ++column) {
      Lanes v;
      values(static_cast<std::size_t>(replicate), grid_.index(column, row), v);
      write(grid_.index(column, row), v, image);
    }
  });
}

void ReplicateFilm::write_mean(std::size_t block, Image& image) const noexcept {
  Lanes a;
  Lanes b;
  values(0, block, a);
  values(1, block, b);
  const float share = counts_[0][block] > 0 && counts_[1][block] > 0 ? 0.5F : 1.0F;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < kBlockPixels; ++k) {
      a.value[c][k] = share * (a.value[c][k] + b.value[c][k]);
    }
  }
  write(block, a, image);
}

void ReplicateFilm::write(std::size_t block, const Lanes& values, Image& image) const noexcept {
  if (grid_.is_interleaved(block)) {
    grid_.for_each_pixel(block, [&](std::size_t lane, int x, int y) {
      for (std::size_t c = 0; c < 3; ++c) image.at(x, y)[c] = values.value[c][lane];
    });
    return;
  }
  const int right = std::min(kBlockSide, grid_.width - grid_.left(block));
  const int bottom = std::min(kBlockSide, grid_.height - grid_.top(block));
  for (int y = 0; y < bottom; ++y) {
    float* pixel = image.at(grid_.left(block), grid_.top(block) + y);
    for (int x = 0; x < right; ++x, pixel += 3) {
      const auto lane = static_cast<std::size_t>(kBlockSide * y + x);
      for (std::size_t c = 0; c < 3; ++c) pixel[c] = values.value[c][lane];
    }
  }
}

Image ReplicateFilm::mean(const RunControl& run) const {
  Image image(grid_.width, grid_.height, 3);
  parallel_for(run, grid_.rows, [&](int row) {
    for (int column = 0; column < grid_.columns; ++column) {
      write_mean(grid_.index(column, row), image);
    }
  });
  return image;
}

Image ReplicateFilm::tile_variance(const RunControl& run) const {
  static_assert(kErrorTile % kBlockSide == 0);
  constexpr int kBlocks = kErrorTile / kBlockSide;  // a side
  const int tile_columns = (grid_.columns + kBlocks - 1) / kBlocks;
  const int tile_rows = (grid_.rows + kBlocks - 1) / kBlocks;
  const double anywhere = noise(run).mse;  // where no block of a tile has both replicates
  Image image(grid_.width, grid_.height, 3);
  parallel_for(run, tile_columns * tile_rows, [&](int tile) {
    const int left = tile % tile_columns * kBlocks;
    const int top = tile / tile_columns * kBlocks;
    const int right = std::min(grid_.columns, left + kBlocks);
    const int bottom = std::min(grid_.rows, top + kBlocks);
    std::array<double, 3> squares = {};
    double pixels = 0.0;
    double single = 0.0;
    for (int row = top; row < bottom; ++row) {
      for (int column = left; column < right; ++column) {
        const std::size_t block = grid_.index(column, row);
        const bool is_pair = counts_[0][block] > 0 && counts_[1][block] > 0;
        (is_pair ? pixels : single) += grid_.pixels(block);
        if (!is_pair) continue;
        Lanes a;
        Lanes b;
        values(0, block, a);
        values(1, block, b);
        for (std::size_t c = 0; c < 3; ++c) {
          for (std::size_t k = 0; k < kBlockPixels; ++k) {
            const double off = 0.5 * (double(a.value[c][k]) - double(b.value[c][k]));
            squares[c] += off * off;
          }
        }
      }
    }
    const double alone = (pixels + 2.0 * single) / (pixels + single);
    std::array<float, 3> found;
    for (std::size_t c = 0; c < 3; ++c) {
      found[c] = static_cast<float>(alone * (pixels > 0.0 ? squares[c] / pixels : anywhere));
    }
    for (int row = top; row < bottom; ++row) {
      for (int column = left; column < right; ++column) {
        grid_.for_each_pixel(grid_.index(column, row), [&](std::size_t, int x, int y) {
          std::ranges::copy(found, image.at(x, y));
        });
      }
    }
  });
  return image;
}

double ReplicateFilm::samples_mean() const {
  double samples = 0.0;
  double pixels = 0.0;
  for (std::size_t block = 0; block < grid_.count(); ++block) {
    const double inside = grid_.pixels(block);
    samples += inside * (static_cast<double>(counts_[0][block]) + counts_[1][block]);
    pixels += inside;
  }
  return samples / pixels;
}

int ReplicateFilm::samples_max() const {
  std::uint32_t most = 0;
  for (std::size_t block = 0; block < grid_.count(); ++block) {
    most = std::max(most, counts_[0][block] + counts_[1][block]);
  }
  return static_cast<int>(most);
}

}  // namespace fstop
