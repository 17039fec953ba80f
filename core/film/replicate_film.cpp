#include "core/film/replicate_film.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/film/square_sums.h"

namespace fstop {
namespace {

double clipped(double value) { return std::clamp(value, 0.0, 1.0); }

// Sums over a block's pixels and channels.
struct BlockDifference {
  double clipped = 0.0;     // (A - B)^2/4, values clipped to [0,1]
  double unclipped = 0.0;   // the same of values as they are
  double energy = 0.0;      // (A + B)/2
  double energy_off = 0.0;  // (A - B)/2
};

}  // namespace

ReplicateFilm::ReplicateFilm(int width, int height) : grid_(width, height) {
  for (std::size_t r = 0; r < kReplicates; ++r) {
    sums_[r].resize(grid_.count());
    counts_[r].resize(grid_.count());
    spreads_[r].assign(grid_.count(), -1.0F);
    defocus_[r].assign(grid_.count(), std::numeric_limits<float>::infinity());
  }
}

void ReplicateFilm::add(int replicate, std::size_t block, const BlockSums& sums,
                        std::uint32_t count) noexcept {
  const auto r = static_cast<std::size_t>(replicate);
  BlockSums& total = sums_[r][block];
  const std::uint32_t before = counts_[r][block];
  if (before > 0) {
    double squares = 0.0;
    grid_.for_each_pixel(block, [&](std::size_t lane, int, int) {
      for (std::size_t c = 0; c < 3; ++c) {
        const double change =
            clipped(total.value[c][lane] / before) - clipped(sums.value[c][lane] / count);
        squares += change * change;
      }
    });
    const double expected = std::pow(before, -kNetOrder) + std::pow(count, -kNetOrder);
    spreads_[r][block] = static_cast<float>(squares / (3.0 * grid_.pixels(block) * expected));
  }
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < kBlockPixels; ++k) total.value[c][k] += sums.value[c][k];
  }
  defocus_[r][block] = std::min(defocus_[r][block], sums.least_defocus);
  counts_[r][block] += count;
}

void ReplicateFilm::set_extra(int replicate, Image light) {
  extra_[static_cast<std::size_t>(replicate)] = std::move(light);
}

void ReplicateFilm::values(std::size_t r, std::size_t block, BlockSums& values) const noexcept {
  const std::uint32_t count = counts_[r][block];
  const double scale = count > 0 ? 1.0 / count : 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < kBlockPixels; ++k) {
      values.value[c][k] = scale * sums_[r][block].value[c][k];
    }
  }
  if (extra_[r].empty()) return;
  grid_.for_each_pixel(block, [&](std::size_t lane, int x, int y) {
    const float* light = extra_[r].at(x, y);
    for (std::size_t c = 0; c < 3; ++c) {
      values.value[c][lane] += static_cast<double>(light[c]);
    }
  });
}

NoiseEstimate ReplicateFilm::noise() const {
  SquareSums clipped_sums;
  SquareSums sums;
  double energy = 0.0;
  double energy_variance = 0.0;
  double pixels = 0.0;
  bool known = true;
  for (std::size_t block = 0; block < grid_.count(); ++block) {
    known = known && counts_[0][block] > 0 && counts_[1][block] > 0;
    BlockSums a;
    BlockSums b;
    values(0, block, a);
    values(1, block, b);
    BlockDifference d;
    grid_.for_each_pixel(block, [&](std::size_t lane, int, int) {
      for (std::size_t c = 0; c < 3; ++c) {
        const double p = a.value[c][lane];
        const double q = b.value[c][lane];
        const double off = clipped(p) - clipped(q);
        d.clipped += 0.25 * off * off;
        d.unclipped += 0.25 * (p - q) * (p - q);
        d.energy += 0.5 * (p + q);
        d.energy_off += 0.5 * (p - q);
      }
    });
    clipped_sums.add(d.clipped / 3.0);
    sums.add(d.unclipped / 3.0);
    energy += d.energy;
    energy_variance += d.energy_off * d.energy_off;
    pixels += grid_.pixels(block);
  }
  if (!known)
    return {.mse = 1.0, .mse_upper_95 = 1.0, .unclipped_mse_upper_95 = 1.0, .energy = 1.0};
  // Sums are per block, figures per pixel.
  const auto blocks = static_cast<double>(grid_.count());
  const double per_pixel = blocks / pixels;
  return {.mse = per_pixel * clipped_sums.mean(blocks),
          .mse_upper_95 = per_pixel * clipped_sums.upper_95(blocks),
          .unclipped_mse_upper_95 = per_pixel * sums.upper_95(blocks),
          .energy = energy > 0.0 ? std::sqrt(energy_variance) / energy : 0.0};
}

Image ReplicateFilm::replicate(int replicate) const {
  Image image(grid_.width, grid_.height, 3);
  for (std::size_t block = 0; block < grid_.count(); ++block) {
    BlockSums v;
    values(static_cast<std::size_t>(replicate), block, v);
    grid_.for_each_pixel(block, [&](std::size_t lane, int x, int y) {
      for (std::size_t c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>(v.value[c][lane]);
    });
  }
  return image;
}

Image ReplicateFilm::mean() const {
  Image image(grid_.width, grid_.height, 3);
  for (std::size_t block = 0; block < grid_.count(); ++block) {
    BlockSums a;
    BlockSums b;
    values(0, block, a);
    values(1, block, b);
    const bool both = counts_[0][block] > 0 && counts_[1][block] > 0;
    const double share = both ? 0.5 : 1.0;
    grid_.for_each_pixel(block, [&](std::size_t lane, int x, int y) {
      for (std::size_t c = 0; c < 3; ++c) {
        image.at(x, y)[c] = static_cast<float>(share * (a.value[c][lane] + b.value[c][lane]));
      }
    });
  }
  return image;
}

Image ReplicateFilm::tile_variance() const {
  const Image a = replicate(0);
  const Image b = replicate(1);
  Image image(grid_.width, grid_.height, 3);
  for (int top = 0; top < grid_.height; top += kErrorTile) {
    for (int left = 0; left < grid_.width; left += kErrorTile) {
      const int right = std::min(grid_.width, left + kErrorTile);
      const int bottom = std::min(grid_.height, top + kErrorTile);
      std::array<double, 3> squares = {};
      for (int y = top; y < bottom; ++y) {
        for (int x = left; x < right; ++x) {
          for (std::size_t c = 0; c < 3; ++c) {
            const double off =
                static_cast<double>(a.at(x, y)[c]) - static_cast<double>(b.at(x, y)[c]);
            squares[c] += 0.25 * off * off;
          }
        }
      }
      const double pixels = static_cast<double>(right - left) * (bottom - top);
      for (int y = top; y < bottom; ++y) {
        for (int x = left; x < right; ++x) {
          for (std::size_t c = 0; c < 3; ++c) {
            image.at(x, y)[c] = static_cast<float>(squares[c] / pixels);
          }
        }
      }
    }
  }
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
